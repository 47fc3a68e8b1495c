"""Keeping drives with a timeout alive: read in time, before polls, and reported."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import suppress
from dataclasses import replace
from typing import Any, cast

import pytest

from tests.waiting import until
from tui.bus.api import DeviceState, LineWorker, Priority
from tui.bus.keep_alive import KeepAlive
from tui.session.drive import DriveSession
from tui.session.monitor.line_watch import LineWatch
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.unknown_drive_poller import UnknownDrivePoller
from tui.session.read.presence import UNKNOWN_TIMEOUT

from .fakes import OneDrive, parameter, profile_of

STATE, TIME_OUT = 10, 50
PROFILE = profile_of(
    parameter("STATE", STATE),
    parameter("TTO", TIME_OUT, unit="s", scale="0.1"),
    communication_fault={
        "timeout": "TTO",
        "off": 0,
        "starts": "With the first request.",
        "source": "manual",
    },
    charts=[
        {
            "id": "drivecom",
            "name": "Drivecom",
            "kind": "drivecom",
            "status": "STATE",
            "states": [{"id": "run", "name": "Run", "kind": "running", "mask": 3, "value": 1}],
        }
    ],
)


class BackgroundListener(OneDrive):
    """Record the priority of reads of the drive, and keep its workers."""

    def __init__(self, tenths: int) -> None:
        super().__init__({STATE: 1, TIME_OUT: tenths})
        self.heard: float | None = None
        self.looked: list[tuple[int, Priority]] = []
        self.workers: list[LineWorker] = []
        self.answers = asyncio.Event()
        """True if polls are answered by now."""
        self.answers.set()

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        self.looked.append((registers.start, priority))
        if priority is Priority.POLL:
            await self.answers.wait()
        self.heard = time.monotonic()

    def device_state(self, device: int) -> DeviceState:
        return replace(super().device_state(device), heard=self.heard)

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        self.workers.append(super().spawn(work, name))
        return self.workers[-1]


class Kept:
    """A watched drive with this many tenths of a second to its timeout."""

    def __init__(self, tenths: int) -> None:
        self.line = BackgroundListener(tenths)
        session = DriveSession(self.line, 1, PROFILE)
        self.watch = LineWatch(self.line)
        self.watch.keep(session, Monitor(session))

    async def end(self) -> None:
        self.watch.stop()
        for worker in self.line.workers:
            with suppress(asyncio.CancelledError):
                await cast("asyncio.Task[object]", worker)


@pytest.fixture
async def keep() -> AsyncIterator[Callable[[int], Kept]]:
    """Looks after drives until the test has ended."""
    made: list[Kept] = []

    def keep_alive(tenths: int) -> Kept:
        made.append(Kept(tenths))
        return made[-1]

    yield keep_alive
    for kept in made:
        await kept.end()


def kept_alive(line: BackgroundListener) -> list[KeepAlive]:
    """Devices that the holder of the line keeps alive."""
    return line.facts.keep_alives.of(line.facts.me.id)


async def test_drive_is_kept_alive_by_its_own_timeout(keep: Callable[[int], Kept]) -> None:
    kept = keep(35)
    await until(lambda: kept.watch.watch(1) is not None)
    assert kept_alive(kept.line) == [KeepAlive(1, 3.5, STATE)]
    # the holder of the line reads, and no worker of this program
    assert Priority.FEED not in [priority for _, priority in kept.line.looked]
    kept.watch.stop()
    assert kept_alive(kept.line) == []


@pytest.mark.parametrize(("silent", "reported"), [(40.0, False), (60.0, True), (150.0, True)])
async def test_drive_silent_for_half_its_timeout_is_reported(
    keep: Callable[[int], Kept], silent: float, reported: bool
) -> None:
    kept = keep(1000)
    await until(lambda: kept.watch.watch(1) is not None)
    kept.line.heard = time.monotonic() - silent
    warnings = kept.watch.warnings()
    assert bool(warnings) is reported
    for warning in warnings:
        assert warning.device == 1
        assert warning.watch.timeout == 100.0
        assert warning.left == pytest.approx(100.0 - silent, abs=10.0)


async def test_drive_without_a_timeout_is_neither_kept_alive_nor_reported(
    keep: Callable[[int], Kept],
) -> None:
    kept = keep(0)
    await until(lambda: (TIME_OUT, Priority.POLL) in kept.line.looked)
    kept.line.heard = time.monotonic() - 1000
    assert kept.watch.watch(1) is None
    assert kept.watch.warnings() == []
    assert kept.watch.pending_timeouts() == {}
    await until(lambda: kept_alive(kept.line) == [])


async def test_drive_of_unknown_family_is_kept_alive_until_it_is_known() -> None:
    line = BackgroundListener(20)
    strangers = UnknownDrivePoller(line)
    strangers.keep(7)
    await until(lambda: kept_alive(line) != [])
    assert [(alive.device, alive.timeout) for alive in kept_alive(line)] == [(7, UNKNOWN_TIMEOUT)]
    strangers.stop()
    assert kept_alive(line) == []


async def test_drive_is_kept_alive_while_its_timeout_is_learned(
    keep: Callable[[int], Kept],
) -> None:
    """Polls wait for seconds after the silence at a word that it does not have."""
    kept = keep(70)
    kept.line.answers.clear()
    assert kept_alive(kept.line) == [KeepAlive(1, UNKNOWN_TIMEOUT, STATE)]
    assert kept.watch.watch(1) is None
    kept.line.answers.set()
    await until(lambda: kept.watch.watch(1) is not None)


async def test_drive_is_checked_soon_after_a_stop_has_ended(
    keep: Callable[[int], Kept], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Line showed STOPPING for up to 3 s after the report that the motor is stopped."""
    monkeypatch.setattr("tui.session.monitor.line_watch.EARLY", 0.01)
    monkeypatch.setattr("tui.session.monitor.line_watch.GLANCE", 6000.0)
    kept = keep(35)
    await until(lambda: 1 in kept.watch.looks)
    before = kept.watch.looks[1].time
    kept.watch._kept[1].session.request_full_read()
    await until(lambda: kept.watch.looks[1].time > before)
