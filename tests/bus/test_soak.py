"""All faults together, at random: requests may fail, but none gets the reply to another."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Sequence

import pytest

from tests.sweeps import kept
from tui.bus.api import LineStatus, Priority
from tui.bus.errors import ExchangeError
from tui.bus.line import Line, Timing
from tui.bus.link import RtuTcpLink, SerialLink
from tui.bus.schedule import connection
from tui.bus.transport.serial_thread import ThreadedSerial
from tui.wire.frames import frame

from .conftest import OpenLine
from .peer import PtyPeer, Step, TcpPeer, eventually, honest, reply, silent

TIMING = Timing(
    first_timeout=0.06,
    min_timeout=0.03,
    late_reply=0.6,
    back_off_first=0.02,
    back_off_longest=0.05,
    frame_gap=0.01,
    frame_gap_tcp=0.01,
)


class Faulty:
    """Drives that make every fault of a line, some more than once at a time."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)

    def __call__(self, request: bytes, _count: int) -> Sequence[Step]:
        right = reply(request)
        cut = self.chance.randrange(1, len(right))
        bit = bytes([right[cut] ^ 1 << self.chance.randrange(8)])
        faults: list[list[Step]] = [
            [],
            [0.1, right],
            [right, right],
            [right[:cut]],
            [right[:cut] + bit + right[cut + 1 :]],
            [self.chance.randbytes(self.chance.randrange(1, 6)), right],
            [frame(7, right[1:-2]) + right],
            [right[:cut], 0.004, right[cut:]],
        ]
        return self.chance.choice(faults) if self.chance.random() < 0.4 else [right]


async def ask(line: Line, seed: int, count: int) -> tuple[int, int]:
    """Read at random; returns how many were answered and how many failed."""
    chance = random.Random(seed)
    answered = failed = 0
    for _ in range(count):
        device, address = chance.randrange(1, 4), chance.randrange(60000)
        words = chance.randrange(1, 9)
        priority = chance.choice([Priority.POLL, Priority.OPERATOR_READ, Priority.BACKGROUND])
        try:
            got = await line.read(device, address, words, priority=priority)
        except ExchangeError:
            failed += 1
            continue
        assert got.words == tuple(range(address, address + words))
        answered += 1
    return answered, failed


@pytest.mark.parametrize("seed", kept([1, 2], 1))
@pytest.mark.parametrize("way", ["serial", "thread", "tcp"])
async def test_every_reply_reaches_its_request(
    way: str, seed: int, open_line: OpenLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    if way == "thread":
        monkeypatch.setattr(connection, "PosixSerial", ThreadedSerial)
    with PtyPeer(Faulty(seed)) if way != "tcp" else TcpPeer(Faulty(seed)) as peer:
        link = (
            RtuTcpLink("127.0.0.1", peer.port)
            if isinstance(peer, TcpPeer)
            else SerialLink(peer.path, 115200)
        )
        line = open_line(link, TIMING)
        results = await asyncio.gather(*(ask(line, seed * 10 + n, 15) for n in range(4)))
        answered = sum(result[0] for result in results)
        assert answered >= 15
        assert sum(answered + failed for answered, failed in results) == 60


async def test_port_read_by_its_own_thread_keeps_gaps(
    open_line: OpenLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "PosixSerial", ThreadedSerial)
    with PtyPeer(honest) as peer:
        line = open_line(SerialLink(peer.path, 2400))
        for address in range(5):
            assert (await line.read(1, address)).words == (address,)
        pauses = zip(peer.departures, peer.arrivals[1:], strict=False)
        assert min(came - left for left, came in pauses) >= 0.016
        peer.script = silent
        reading = asyncio.create_task(line.read(1, 5))
        await asyncio.to_thread(peer.await_requests, 6)
        peer.unplug()
        with pytest.raises(Exception, match="lost"):
            await reading
        await asyncio.to_thread(eventually, lambda: line.state.status is LineStatus.LOST)
