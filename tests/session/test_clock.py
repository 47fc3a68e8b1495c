"""The clock of a session: times that depend on it, and the clock that tests advance."""

from __future__ import annotations

import ast
import asyncio
import time
from collections.abc import Iterator
from pathlib import Path
from typing import cast

import pytest

import tui.session
from tests.limits import ARMED_FOR
from tui.bus.api import LineState, LineStatus
from tui.bus.limits import Limits
from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.bus.shared_state import SharedState
from tui.drive.profile import library
from tui.session.clock import Clock
from tui.session.drive import DriveSession

from .fake_clock import FakeClock

OWN_TIME = {
    "acceptance/acceptance_run.py",
    "acceptance/motion.py",
    "clock.py",
    "journal.py",
    "journal_file.py",
    "events.py",
    "command/stop.py",
    "command/under_way.py",
    "api/running_motor.py",
    "running/motor_run.py",
    "running/watching.py",
    "record/record_file.py",
    "record/replay_clock.py",
    "record/recorder.py",
    "record/ring.py",
    "connect/recorded_line.py",
    "recording/recording_file.py",
    "sharing/stop_others.py",
}
"""Modules that use the real clock: the threads of the journal and of the recorder, times that are
recorded, the clock of a replay, threads that wait for a stop, and programs that wait for the motor
that they run.
"""
SESSION = Path(tui.session.__file__).parent


def real_times(tree: ast.Module) -> Iterator[str]:
    """Places where a module reads the real clock, or sleeps by it."""
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(
                value=ast.Name(id="time"), attr="monotonic" | "time" | "sleep" as name
            ):
                yield f"line {node.lineno}: time.{name}"
            case ast.Attribute(value=ast.Name(id="asyncio"), attr="sleep"):
                yield f"line {node.lineno}: asyncio.sleep"


def test_session_modules_use_the_injected_clock() -> None:
    found = {
        name: list(real_times(ast.parse(path.read_text("utf-8"))))
        for path in sorted(SESSION.rglob("*.py"))
        if (name := path.relative_to(SESSION).as_posix()) not in OWN_TIME
    }
    assert {name: places for name, places in found.items() if places} == {}


class ConnectedLine:
    """A line on which nothing happens."""

    read_only = False
    state = LineState(LineStatus.CONNECTED, "", 0.0)
    held = ""
    facts = SharedState()
    link = SerialLink("/dev/none")

    def describe(self, _device: int, _limits: Limits) -> None:
        """The limits of a device do not matter here."""


@pytest.fixture
def session() -> DriveSession:
    """A drive on a line that sends nothing, by a clock that the test moves on."""
    line = cast("Line", ConnectedLine())
    return DriveSession(line, 1, library.load("atv71"), clock=FakeClock())


def clock_of(session: DriveSession) -> FakeClock:
    assert isinstance(session.clock, FakeClock)
    return session.clock


def test_arming_ends_one_minute_after_the_last_key(session: DriveSession) -> None:
    clock = clock_of(session)
    session.arming.arm()
    clock.advance(ARMED_FOR - 5)
    assert session.arming.armed
    session.arming.touch()
    clock.advance(ARMED_FOR - 5)
    assert session.arming.armed
    clock.advance(10)
    assert not session.arming.armed
    assert "no key pressed for 60 s" in session.arming.why_disarmed


def test_known_value_becomes_stale(session: DriveSession) -> None:
    clock = clock_of(session)
    session.image.confirm("ACC", 30, clock.line_time(time.monotonic()))
    assert session.image.fresh(5.0) == {"ACC": 30}
    clock.advance(60)
    assert session.image.fresh(5.0) == {}
    assert session.image.age("ACC") >= 60
    # an earlier value keeps its age, however late it is requested
    session.image.confirm("DEC", 40, clock.line_time(time.monotonic()))
    assert session.image.age("DEC") < 60


def test_time_of_day_is_stable_unless_the_clock_is_set() -> None:
    class Notified(Clock):
        now, ahead = 100.0, 5000.0

        def monotonic(self) -> float:
            return self.now

        def wall(self) -> float:
            return self.now + self.ahead

    clock = Notified()
    assert clock.wall_of(99.0) == 5099.0
    # both clocks are read one after the other, and the time of day is controlled
    clock.now, clock.ahead = 101.0, 5000.001
    assert clock.wall_of(99.0) == 5099.0
    clock.ahead = 4000.0
    assert clock.wall_of(99.0) == 4099.0


async def test_fake_sleep_ends_when_the_clock_advances() -> None:
    clock = FakeClock()
    sleeper = asyncio.create_task(clock.sleep(3600))
    await asyncio.sleep(0.02)
    assert not sleeper.done()
    clock.advance(3600)
    await asyncio.wait_for(sleeper, 20)


async def test_clock_of_a_session_is_that_of_the_computer() -> None:
    clock = Clock()
    before = time.monotonic(), time.time()
    await clock.sleep(0.01)
    now = clock.monotonic(), clock.wall()
    assert [0.009 < late - early < 0.9 for late, early in zip(now, before, strict=True)] == [
        True
    ] * 2
    assert clock.line_time(before[0]) == before[0]
