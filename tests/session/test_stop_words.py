"""The word that stops a motor, and the condition for "stopped"."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from tests.sent import words_written
from tui.bus.errors import DeviceException, NoAnswer
from tui.bus.line import Reply
from tui.drive.orders import OrderRefused, stop_in_any
from tui.drive.profile import library
from tui.session.command import motor_stop
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase
from tui.session.connect.limits import limits_of
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.monitor.monitor import Monitor
from tui.session.read.reader import Reader
from tui.session.settings.write import Writer
from tui.session.work import Stopped
from tui.simulator import DriveSpec

from .fake_clock import FakeClock
from .slow_drive import FREQUENCY, STATUS, SWITCHED_ON, SlowBench
from .test_stop import Start, ended, start, wait_for

__all__ = ["start"]
ATV71 = library.load("atv71")


async def test_refused_profile_write_does_not_change_the_stop_word(
    start: Start, journal: Journal
) -> None:
    """CHCF = 1 was refused: 16#0007 would run the motor forward in the I/O profile."""
    simulation, line = start(DriveSpec("atv71", 1, sets={"CHCF": 3, "TCC": 0}))
    drive = simulation.drive(1)
    line.describe(1, limits_of(ATV71))
    for address, word in ((8502, 200), (8501, 1)):
        await line.write(1, address, [word])
    await wait_for(lambda: drive.motor.frequency > 15)
    session = DriveSession(line, 1, ATV71)
    session.arming.arm(seconds=math.inf)
    await Reader(session).read(["CHCF", "ETA"])
    writer = Writer(session, journal, session.work.permit())
    with pytest.raises(DeviceException):
        await writer.write_parameter(ATV71["CHCF"], 1, why="setting")
    sent = len(words_written(line))
    stopper = Stopper(line, journal)
    stopper.stop([session])
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    assert {word for address, word in words_written(line)[sent:] if address == 8501} == {0x0000}
    assert drive.motor.frequency == 0


async def test_value_changed_at_rest_is_read_again(start: Start, journal: Journal) -> None:
    """At rest the profile may be changed at the keypad: 16#0007 would start the motor then."""
    simulation, line = start(DriveSpec("atv71", 1, sets={"CHCF": 1, "TCC": 0}))
    drive = simulation.drive(1)
    session = DriveSession(line, 1, ATV71)
    assert not session.reported_by_line
    await Reader(session).read(["CHCF", "DOTD", "ETA"])
    drive.set("CHCF", 3)
    session.image._trusted_from = -math.inf
    await wait_for(lambda: session.image.age("CHCF") > 1.1)
    stopper = Stopper(line, journal)
    stopper.stop([session])
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    assert words_written(line) == [(8501, 0x0000)]
    assert session.reported_by_line, "a drive that watches from its first write on watches now"


async def test_values_fixed_while_running_are_not_read_again(
    start: Start, journal: Journal
) -> None:
    simulation, line = start(DriveSpec("atv71", 1, run_hz=20.0))
    await wait_for(lambda: simulation.drive(1).motor.frequency > 5)
    session = DriveSession(line, 1, ATV71)
    monitor = Monitor(session)
    monitor.start(["ETA", "RFR"], 0.1)
    await Reader(session).read(["CHCF", "DOTD"])
    await wait_for(lambda: session.image.age("CHCF") > 1.5)
    before = len(line.trace)
    stopper = Stopper(line, journal)
    stopper.stop([session])
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    monitor.stop()
    requested = [f.data for f in list(line.trace)[before:] if f.direction == "out"]
    at = next(i for i, data in enumerate(requested) if data[1] == 6)
    assert requested[at][2:6].hex() == "21350007"
    assert not any(data[2:4] == (8401).to_bytes(2, "big") for data in requested[:at])


async def test_unreadable_control_profile_gets_the_common_stop_word(
    start: Start, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulation, line = start(DriveSpec("atv71", 1, run_hz=20.0))
    drive = simulation.drive(1)
    await wait_for(lambda: drive.motor.frequency > 5)
    read = line.read

    async def deaf(device: int, address: int, count: int = 1, **how: Any) -> Reply:
        if address == 8401:
            raise NoAnswer(device, 3, address)
        return await read(device, address, count, **how)

    monkeypatch.setattr(line, "read", deaf)
    stopper = Stopper(line, journal)
    stopper.stop([DriveSession(line, 1, ATV71)])
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    assert words_written(line)[0] == (8501, 0x0000)
    assert drive.motor.frequency == 0


def test_common_stop_word_is_safe_in_all_charts() -> None:
    assert stop_in_any(ATV71, {})[1].words == [0x0000]
    assert stop_in_any(ATV71, {"CHCF": 1})[1].words == [0x0007]
    assert stop_in_any(ATV71, {"CHCF": 3})[1].words == [0x0000]
    with pytest.raises(OrderRefused, match="command words of this drive"):
        stop_in_any(ATV71, {"CHCF": 0})


async def test_enabled_motor_at_0_hz_is_not_reported_as_stopped(
    start: Start, journal: Journal
) -> None:
    """Run at the terminals with reference 0: the next touch of the potentiometer turns it."""
    simulation, line = start(DriveSpec("atv71", 1, sets={"FR1": 1}))
    simulation.drive(1).run(0.0)
    clock = FakeClock()
    session = DriveSession(line, 1, ATV71, clock=clock)
    chart = session.profile.data.charts[0]
    await Reader(session).read([chart.status])
    assert session.state(5.0).kind == "running"
    stopper = Stopper(line, journal)
    stopper.stop([session])
    report = await ended(stopper, 1, clock)
    assert report.phase is Phase.FAILED
    assert "0 Hz" in report.text
    assert "still enabled from its terminals or keypad" in report.text


async def test_halt_is_followed_by_disable_operation(start: Start, journal: Journal) -> None:
    """With DOTD = 0 the motor is halted; at 0 Hz the drive would still be enabled."""
    simulation, line = start(DriveSpec("atv71", 1, run_hz=20.0, sets={"DOTD": 0}))
    await wait_for(lambda: simulation.drive(1).motor.frequency > 5)
    stopper = Stopper(line, journal)
    session = DriveSession(line, 1, ATV71)
    stopper.stop([session])
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    assert [word for _, word in words_written(line)] == [0x010F, 0x0007]
    await Reader(session).read(["ETA"])
    assert session.state(5.0).kind != "running"


async def test_stop_disarms_and_cancels_earlier_input(start: Start, journal: Journal) -> None:
    _, line = start(DriveSpec("atv71", 1))
    session = DriveSession(line, 1, ATV71)
    session.arming.arm()
    typed, permit = session.work.stops, session.work.permit()
    Stopper(line, journal).stop([session], by="F9")
    assert session.arming.armed_for is None
    assert "Stopped" in session.arming.why_disarmed
    session.arming.arm()
    with pytest.raises(Stopped, match="F9"):
        session.work.permit(typed)
    assert "F9" in permit.refusal()


async def test_coasting_motor_is_not_stopped_before_standstill(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its state shows it immediately: nothing drives the motor, and it turns for a while."""
    monkeypatch.setattr(motor_stop, "STANDSTILL_POLL_INTERVAL", 0.01)
    here = SlowBench(tmp_path, looks=0)
    await here.start()
    here.line.registers[FREQUENCY] = 500
    stopper = Stopper(here.line, here.journal)
    stopper.stop([here.session])
    await wait_for(lambda: here.line.registers[STATUS] == SWITCHED_ON)
    looks = len(here.line.requests)
    await wait_for(lambda: len(here.line.requests) > looks + 5)
    assert stopper.reports[1].phase is Phase.STOPPING
    assert "50 Hz" in stopper.reports[1].text
    here.line.registers[FREQUENCY] = 0
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    here.end()
