"""Adapters that echo requests, distinguished from drives whose reply repeats the request."""

from __future__ import annotations

import pytest

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.bus.line import Timing

from .conftest import BRISK, WIDE, OpenLine
from .peer import PtyPeer, honest, silent
from .plain import outcome, plain_serial

# a probe after an unsure write may take a second timeout
SHORT = Timing(first_timeout=0.3, min_timeout=0.3, late_reply=0.5, retries=0)


async def test_plain_client_takes_an_echo_for_the_reply_to_a_write() -> None:
    with PtyPeer(silent, echo=True) as peer:
        async with plain_serial(peer.path) as client:
            assert await outcome(client.write_register(5, 7, device_id=1)) == [7]


async def test_plain_client_set_for_echo_fails_without_one() -> None:
    with PtyPeer(honest) as peer:
        async with plain_serial(peer.path, echo=True) as client:
            assert await outcome(client.write_register(5, 7, device_id=1)) is None


@pytest.mark.parametrize("after", ["nothing", "a read", "a broadcast"])
async def test_echo_alone_is_not_a_reply(after: str, open_line: OpenLine) -> None:
    with PtyPeer(silent, echo=True) as peer:
        line = open_line(peer.path, SHORT)
        if after == "a read":
            with pytest.raises(NoAnswer):
                await line.read(1, 5, priority=Priority.OPERATOR_READ)
        elif after == "a broadcast":
            await line.broadcast(5, [7], limits=WIDE)
        with pytest.raises(NoAnswer, match="echo"):
            await line.write(1, 5, [7])
        writes = [request for request in peer.requested(1) if request[1] == 6]
        assert len(writes) == 1


@pytest.mark.parametrize("echo", [True, False])
@pytest.mark.parametrize("first", ["read", "write", "diagnose", "broadcast"])
async def test_line_works_with_and_without_echo(
    first: str, echo: bool, open_line: OpenLine
) -> None:
    with PtyPeer(honest, echo=echo) as peer:
        line = open_line(peer.path, SHORT)
        match first:
            case "read":
                assert (await line.read(1, 5)).words == (5,)
            case "write":
                await line.write(1, 5, [7])
            case "diagnose":
                assert await line.diagnose(1, 0, 0x55AA) == 0x55AA
            case "broadcast":
                await line.broadcast(5, [7], limits=WIDE)
        await line.write(1, 5, [7])
        await line.write(1, 6, [7, 8])
        assert (await line.read_write(1, 5, 2, 9, [1])).words == (5, 6)
        assert await line.diagnose(1, 0, 0x1234) == 0x1234
        assert (await line.identify(1)).objects == {0: b"none"}
        assert (await line.read(1, 9, 4)).words == (9, 10, 11, 12)
        assert line.counters.timeouts == line.counters.wrong == line.counters.checksum == 0
        assert any(frame.note == "echo" for frame in line.trace) is echo
        # requests that only detect an echo are counted too
        answered = line.counters.requests - (first == "broadcast")
        assert line.counters.replies == answered


async def test_echo_is_not_a_reply_to_a_read(open_line: OpenLine) -> None:
    with PtyPeer(silent, echo=True) as peer:
        line = open_line(peer.path, BRISK)
        with pytest.raises(NoAnswer):
            await line.read(1, 5, priority=Priority.OPERATOR_READ)
        assert line.counters.wrong == 0
