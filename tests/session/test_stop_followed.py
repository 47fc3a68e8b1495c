"""A stop is followed until the motor is at standstill: what it reports if that takes long."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Any

import pytest

from tui.bus.api import Priority
from tui.drive.profile import library
from tui.session.clock import Clock
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import OVER, Phase, StopReport
from tui.session.drive import DriveSession
from tui.session.journal import Journal

from .fakes import OneDrive

PROFILE = library.load("atv312")
STATUS, COMMAND, HERTZ = (PROFILE[code].address for code in ("ETA", "CMD", "rFr"))
RUNNING, SWITCHED_ON = 0x0627, 0x0223
LONG_RAMP = 3000


class OwnTime(Clock):
    """Time that advances only during sleeps."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now

    async def sleep(self, seconds: float) -> None:
        await asyncio.sleep(0)
        self.now += seconds

    def line_time(self, reported: float) -> float:
        return self.now


class Ramp(OneDrive):
    """An Altivar 312 that runs by the line; from its stop on its frequency falls for a time."""

    def __init__(self, clock: OwnTime, seconds: float, falls: int = 1) -> None:
        super().__init__(dict.fromkeys(range(0x10000), 0))
        held = {"LAC": 2, "CHCF": 1, "Fr1": 164}
        self.registers.update({PROFILE[code].address: raw for code, raw in held.items()})
        self.registers[STATUS], self.registers[HERTZ] = RUNNING, LONG_RAMP
        self.clock, self.seconds, self.falls = clock, seconds, falls
        self.stopped_at: float | None = None

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        if self.stopped_at is None:
            return
        if self.clock.now - self.stopped_at >= self.seconds:
            self.registers[STATUS], self.registers[HERTZ] = SWITCHED_ON, 0
        elif HERTZ in registers:
            self.registers[HERTZ] -= self.falls

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        if address == COMMAND and self.stopped_at is None:
            self.stopped_at = self.clock.now
        return await super().write(device, address, values, **how)


async def followed(drive: Ramp) -> StopReport:
    """The last report of a stop."""
    journal = Journal()
    stopper = Stopper(drive, journal)
    stopper.stop([DriveSession(drive, 1, PROFILE, clock=drive.clock)])
    async with asyncio.timeout(20.0):
        while stopper.reports[1].phase not in OVER:  # noqa: ASYNC110 - as the drive's clock goes
            await asyncio.sleep(0)
    journal.close()
    return stopper.reports[1]


@pytest.mark.parametrize("seconds", [0.0, 5.0, 58.0])
async def test_motor_on_a_ramp_is_followed_to_standstill(seconds: float) -> None:
    clock = OwnTime()
    report = await followed(Ramp(clock, seconds))
    assert (report.phase, report.text) == (Phase.STOPPED, "stopped")
    assert clock.now - 1000.0 < seconds + 2.0


async def test_motor_that_still_turns_after_a_minute_is_not_stopped() -> None:
    clock = OwnTime()
    report = await followed(Ramp(clock, 1000.0))
    assert report.phase is Phase.FAILED
    assert report.text.startswith("NOT STOPPED")
    assert "still turns after a minute" in report.text
    assert 60.0 <= clock.now - 1000.0 < 62.0


async def test_motor_that_does_not_slow_down_is_not_stopped() -> None:
    clock = OwnTime()
    report = await followed(Ramp(clock, 1000.0, falls=0))
    assert report.phase is Phase.FAILED
    assert "it answers and runs on" in report.text
    assert 1.5 <= clock.now - 1000.0 < 10.0
