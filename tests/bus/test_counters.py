"""Counts of each device on a line."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import pytest

from tui.bus.api import TURNAROUND_EDGES, DeviceCounters, Priority
from tui.bus.errors import ExchangeError
from tui.bus.link import TcpLink
from tui.bus.model import LastMinute
from tui.bus.tally import DeviceTally
from tui.wire.frames import frame

from .conftest import BRISK, OpenLine, Share
from .peer import PtyPeer, Step, TcpPeer, eventually, honest, reply, tcp_reply, tcp_request_length

READ_SIZE, REPLY_SIZE, REFUSAL_SIZE = 8, 7, 5


def answer_some_kinds(request: bytes, _count: int) -> Sequence[Step]:
    """Refuse register 10 with 2, damage 20, answer nothing to 30, and all else rightly."""
    address = int.from_bytes(request[2:4], "big")
    if address == 10:
        return [frame(request[0], b"\x83\x02")]
    if address == 20:
        whole = reply(request)
        return [whole[:-1] + bytes([whole[-1] ^ 1])]
    return [] if address == 30 else [reply(request)]


async def test_each_device_has_its_own_counts(open_line: OpenLine) -> None:
    with PtyPeer(answer_some_kinds) as peer:
        line = open_line(peer.path, replace(BRISK, retries=1))
        for device, address in ((1, 5), (1, 10), (1, 20), (2, 5), (2, 6), (1, 30)):
            with suppress(ExchangeError):
                await line.read(device, address, priority=Priority.OPERATOR_READ)
        counters, other = line.counters.devices[1], line.counters.devices[2]
        # the damaged and the unanswered request were sent twice
        assert (counters.requests, counters.replies, counters.repeats) == (6, 2, 2)
        assert (counters.checksum, counters.timeouts, counters.exceptions) == (2, 2, {2: 1})
        assert counters.bytes_out == 6 * READ_SIZE
        assert counters.bytes_in == 3 * REPLY_SIZE + REFUSAL_SIZE
        assert sum(counters.turnarounds) == counters.replies
        assert replace(other, busy_seconds=0.0, turnarounds=()) == DeviceCounters(
            2, 2, bytes_out=2 * READ_SIZE, bytes_in=2 * REPLY_SIZE, turnarounds=(),
            minute=LastMinute(good=2),
        )  # fmt: skip
        assert line.counters.repeats == 2
        assert counters.busy_seconds + other.busy_seconds == pytest.approx(
            line.counters.busy_seconds
        )
        assert counters.busy_seconds > 2 * BRISK.first_timeout


async def test_modbus_tcp_is_counted_too(open_line: OpenLine) -> None:
    with TcpPeer(lambda request, _: [tcp_reply(request)], length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port), BRISK)
        await line.read(3, 5, priority=Priority.OPERATOR_READ)
        found = line.counters.devices[3]
        assert (found.requests, found.replies, found.bytes_out, found.bytes_in) == (1, 1, 12, 11)


async def test_attached_program_has_the_counts_of_the_owner(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        await owner.read(1, 100)
        await owner.read(2, 100)
        eventually(lambda: other.counters.devices == owner.counters.devices)
        before = owner.counters.devices[2]
        await owner.read(1, 100)
        eventually(lambda: other.counters.devices[1].requests == 2)
        assert other.counters.devices[2] == before


@pytest.mark.parametrize(
    ("seconds", "bar"),
    [
        (0.0, 0),
        (TURNAROUND_EDGES[0], 0),
        (0.003, 1),
        (0.3, 7),
        (TURNAROUND_EDGES[-1], len(TURNAROUND_EDGES) - 1),
        (9.0, len(TURNAROUND_EDGES)),
    ],
)
def test_turnaround_is_counted_in_one_bar(seconds: float, bar: int) -> None:
    tally = DeviceTally()
    tally.count_reply(seconds)
    assert [at for at, count in enumerate(tally.frozen(0.0).turnarounds) if count] == [bar]


def test_snapshot_does_not_change_later() -> None:
    tally = DeviceTally()
    before = tally.frozen(0.0)
    tally.count_exception(2)
    tally.count_reply(0.1)
    assert before == DeviceCounters()
