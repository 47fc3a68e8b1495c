"""A drive that was frozen is believed again, even while it is kept from its timeout."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from tui.bus.errors import LineError, NoAnswer
from tui.bus.keep_alive import KeepAlive
from tui.bus.model import Priority, Timing

from .conftest import OpenLine
from .peer import PtyPeer, Step, eventually, reply

TIMING = Timing(first_timeout=0.25, min_timeout=0.1, late_reply=1.0, back_off_longest=0.5)
AGAIN, AWAY = 0.4, 1.1
"""Seconds between two reads that keep the drive alive, within `late_reply`; length of a freeze."""


async def test_drive_that_was_frozen_is_polled_as_before(open_line: OpenLine) -> None:
    frozen, held = asyncio.Event(), list[bytes]()

    def drive(request: bytes, _count: int) -> Sequence[Step]:
        held.append(request)
        if frozen.is_set():
            return []
        replies = b"".join(map(reply, held))
        held.clear()
        return [replies]

    polled: list[float] = []

    async def read_every(pause: float, priority: Priority, times: list[float]) -> None:
        while True:
            with suppress(LineError):
                await line.read(1, 100, 2, priority=priority)
                times.append(time.monotonic())
            await asyncio.sleep(pause)

    with PtyPeer(drive) as peer:
        line = open_line(peer.path, TIMING, probes=True)
        async with asyncio.TaskGroup() as group:
            tasks = [
                group.create_task(read_every(AGAIN, Priority.FEED, [])),
                group.create_task(read_every(0.02, Priority.POLL, polled)),
            ]
            await asyncio.sleep(AGAIN)
            for _ in range(3):
                frozen.set()
                await asyncio.sleep(AWAY)
                frozen.clear()
                await asyncio.sleep(AGAIN)
            await asyncio.sleep(TIMING.late_reply + 1.0)
            begun = len(polled)
            await asyncio.sleep(1.0)
            for task in tasks:
                task.cancel()
    assert len(polled) - begun > 10


async def test_keep_alive_read_takes_the_first_reply_while_an_earlier_one_may_come(
    open_line: OpenLine,
) -> None:
    """To wait for a second reply took the line from all drives: again and again, for minutes."""

    def drive(request: bytes, _count: int) -> Sequence[Step]:
        return [] if request[3] == 200 else [reply(request)]

    with PtyPeer(drive) as peer:
        line = open_line(peer.path, replace(TIMING, retries=0), probes=False)
        await line.read(1, 100)
        with suppress(NoAnswer):
            await line.read(1, 200)
        line.facts.keep_alives.keep(KeepAlive(1, 0.3, 100))
        await asyncio.to_thread(eventually, lambda: len(peer.requests) > 4)
        await asyncio.sleep(0.05)
        assert [request[3] for request in peer.requests] == [100, 200, *[100] * 3]
        assert line.device_state(1).answers
        assert not any(frame.note == "not the reply" for frame in line.trace)
