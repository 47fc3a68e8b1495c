"""Stopping: every family's own way, whatever the line does, never by a word that starts a motor."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import cast

import pytest

from tests.sent import words_written
from tui.bus.api import Priority
from tui.bus.fake import FakeLine
from tui.bus.line import Line
from tui.bus.link import RtuTcpLink
from tui.drive.orders import OrderRefused, chart_in_force, choose, walk
from tui.drive.profile import library
from tui.session.command.stop import STOP_WAITS, Stopper
from tui.session.command.stop_report import Phase, StopReport
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.read.reader import Reader
from tui.simulator import DriveSpec, Simulation

from .fake_clock import FakeClock, let_go_until

FAMILIES = ["atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca"]
Start = Callable[..., tuple[Simulation, Line]]


@pytest.fixture
def start(journal: Journal) -> Iterator[Start]:
    """Simulated drives and a line to them, closed afterwards."""
    opened: list[tuple[Simulation, Line]] = []

    def begin(*specs: DriveSpec, read_only: bool = False) -> tuple[Simulation, Line]:
        simulation = Simulation(list(specs))
        simulation.start()
        line = Line(RtuTcpLink(*simulation.serve_rtu_tcp()), read_only=read_only)
        line.open(wait=5.0)
        opened.append((simulation, line))
        return opened[-1]

    yield begin
    for simulation, line in opened:
        line.close()
        simulation.stop()


async def ended(stopper: Stopper, device: int, clock: FakeClock | None = None) -> StopReport:
    """Report of an ended stop; with a clock, its time is advanced."""

    def over() -> bool:
        report = stopper.reports.get(device)
        return report is not None and report.phase in (Phase.STOPPED, Phase.FAILED)

    await let_go_until(clock or FakeClock(), over)
    return stopper.reports[device]


WORDS = {
    "atv21": (0xFA00, 0xC000),
    "atv31": (8501, 0x0007),
    "atv312": (8501, 0x0007),
    "atv71": (8501, 0x0007),
    "powerdrive": (641, 0x0001),
    "proxidrive": (641, 0x0001),
    "varmeca": (641, 0x0001),
}


@pytest.mark.parametrize("family", FAMILIES)
async def test_every_family_stops_on_its_ramp(start: Start, journal: Journal, family: str) -> None:
    sets = {} if family.startswith("atv") else {"6.43": 1, "6.42": 3}
    simulation, line = start(DriveSpec(family, 1, run_hz=20.0, sets=sets))
    drive = simulation.drive(1)
    await wait_for(lambda: drive.motor.frequency > 5)
    stopper = Stopper(line, journal)
    stopper.stop([DriveSession(line, 1, library.load(family))])
    await wait_for(lambda: bool(words_written(line)))
    assert words_written(line)[0] == WORDS[family]
    seen: list[float] = []
    while stopper.reports[1].phase not in (Phase.STOPPED, Phase.FAILED):
        seen.append(abs(drive.motor.frequency))
        await asyncio.sleep(0.02)
    assert stopper.reports[1].phase is Phase.STOPPED, stopper.reports[1].text
    assert drive.motor.frequency == 0
    # on the ramp, not coasting: the frequency was seen on its way down
    assert len({round(value) for value in seen if 0.5 < value < 19}) > 3


async def wait_for(holds: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it did not come to that"
        await asyncio.sleep(0.01)


async def test_altivar_71_in_the_io_profile_gets_no_drivecom_word(
    start: Start, journal: Journal
) -> None:
    """16#0007 has bit 0 set, which runs the motor in this profile."""
    simulation, line = start(DriveSpec("atv71", 1, sets={"CHCF": 3, "TCC": 0}))
    drive = simulation.drive(1)
    stopper = Stopper(line, journal)
    stopper.stop([DriveSession(line, 1, library.load("atv71"))])
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    assert words_written(line) == [(8501, 0x0000)]
    assert drive.motor.frequency == 0


async def test_profile_without_a_known_stop_is_reported(start: Start, journal: Journal) -> None:
    _, line = start(DriveSpec("atv71", 1, sets={"CHCF": 0}))
    stopper = Stopper(line, journal)
    stopper.stop([DriveSession(line, 1, library.load("atv71"))])
    report = await ended(stopper, 1)
    assert report.phase is Phase.FAILED
    assert "at the machine" in report.text
    assert words_written(line) == []


async def test_drive_with_dotd_at_freewheel_is_halted_instead(
    start: Start, journal: Journal
) -> None:
    simulation, line = start(DriveSpec("atv71", 1, run_hz=20.0, sets={"DOTD": 0}))
    await wait_for(lambda: simulation.drive(1).motor.frequency > 5)
    session = DriveSession(line, 1, library.load("atv71"))
    await Reader(session).read(["CHCF", "DOTD", "ETA"])
    stopper = Stopper(line, journal)
    stopper.stop([session])
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    assert words_written(line)[0] == (8501, 0x010F)


async def test_stop_does_not_unlock_a_leroy_somer(start: Start, journal: Journal) -> None:
    _, line = start(DriveSpec("powerdrive", 1, sets={"6.43": 1}))
    stopper = Stopper(line, journal)
    stopper.stop([DriveSession(line, 1, library.load("powerdrive"))])
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
    assert words_written(line) == [(641, 0x0000)]


async def test_stop_reports_a_drive_commanded_by_another_source(
    start: Start, journal: Journal
) -> None:
    simulation, line = start(DriveSpec("powerdrive", 1, run_hz=20.0))
    await wait_for(lambda: simulation.drive(1).motor.frequency > 5)
    stopper, clock = Stopper(line, journal), FakeClock()
    stopper.stop([DriveSession(line, 1, library.load("powerdrive"), clock=clock)])
    report = await ended(stopper, 1, clock)
    assert report.phase is Phase.FAILED
    assert "commanded by another source" in report.text


async def test_stop_of_a_dead_drive_is_retried_and_reported(start: Start, journal: Journal) -> None:
    _, line = start(DriveSpec("atv21", 1))
    stopper = Stopper(line, journal)
    stopper.stop([DriveSession(line, 9, library.load("atv21"))])
    report = await ended(stopper, 9)
    assert report.phase is Phase.FAILED
    assert len(words_written(line)) == 5


async def test_read_only_line_refuses_a_stop_with_a_reason(start: Start, journal: Journal) -> None:
    _, line = start(DriveSpec("atv21", 1), read_only=True)
    stopper = Stopper(line, journal)
    stopper.stop([DriveSession(line, 1, library.load("atv21"))])
    report = await ended(stopper, 1)
    assert report.phase is Phase.FAILED
    assert "read-only" in report.text


async def test_stop_all_stops_every_drive_and_starts_none(start: Start, journal: Journal) -> None:
    specs = [DriveSpec(family, at, run_hz=20.0) for at, family in enumerate(FAMILIES[:4], start=1)]
    simulation, line = start(*specs)
    await wait_for(lambda: all(simulation.drive(at).motor.frequency > 5 for at in range(1, 5)))
    stopper = Stopper(line, journal)
    sessions = [
        DriveSession(line, at, library.load(family))
        for at, family in enumerate(FAMILIES[:4], start=1)
    ]
    stopper.stop(sessions)
    reports = [await ended(stopper, at) for at in range(1, 5)]
    assert {report.phase for report in reports} == {Phase.STOPPED}
    broadcasts = [f.data for f in line.trace if f.direction == "out" and f.data[0] == 0]
    assert [(data[1], data[2:6].hex()) for data in broadcasts] == [(6, "fa00c000")]


async def test_stop_precedes_all_waiting_requests(start: Start, journal: Journal) -> None:
    simulation, line = start(DriveSpec("atv71", 1, run_hz=20.0))
    session = DriveSession(line, 1, library.load("atv71"))
    await Reader(session).read(["CHCF", "DOTD", "ETA"])
    crowd = [
        asyncio.create_task(line.read(1, 3201, priority=priority))
        for priority in (Priority.OPERATOR_READ, Priority.POLL) * 20
    ]
    await asyncio.sleep(0.005)
    before = len([frame for frame in line.trace if frame.direction == "out"])
    Stopper(line, journal).stop([session])
    await asyncio.gather(*crowd)
    sent = [frame.data for frame in line.trace if frame.direction == "out"]
    at = next(index for index, data in enumerate(sent) if data[1] == 6)
    assert at <= before + 1
    assert simulation.drive(1).raw("CMD") == 7


def test_report_from_another_thread_is_kept(journal: Journal) -> None:
    line, profile = FakeLine(), library.load("atv71")
    stopper = Stopper(line, journal)
    texts: list[str] = []
    kept: list[str] = []

    def report_other() -> int:
        if texts:
            kept.append(stopper.reports[2].text)
        texts.append(f"report {len(texts)}")
        other = DriveSession(line, 2, profile)
        report = partial(stopper._report, other, Phase.FAILED, texts[-1], 2.0)
        thread = threading.Thread(target=report)
        thread.start()
        thread.join()
        return 1

    class Overtaken:
        """Whenever its device is read, another thread reports on drive 2."""

        clock = DriveSession(line, 1, profile).clock
        device = property(lambda session: report_other())

    stopper._report(cast(DriveSession, Overtaken()), Phase.SENDING, STOP_WAITS, 1.0)
    assert len(kept) > 2
    assert kept == texts[:-1]


def test_command_allowed_in_no_state_is_refused_with_a_reason() -> None:
    profile = library.load("atv21")
    chart = profile.data.charts[0]
    with pytest.raises(
        OrderRefused, match=r"possible only in these states: .*Fault.* present state is Standby"
    ):
        choose(chart, "reset", {"FD01": 0x4000})
    with pytest.raises(OrderRefused, match="no command 'take control'"):
        choose(chart, "take-control", {"FD01": 0x4000})
    leroy = library.load("powerdrive").data.charts[0]
    with pytest.raises(OrderRefused, match=r"requires 6\.43 = 1"):
        choose(leroy, "forward", {"10.40": 1, "6.43": 0})


def test_path_through_the_chart_is_found() -> None:
    chart = library.load("atv31").data.charts[0]
    assert walk(chart, "disabled", "enabled") == [
        ("ready", 0x0006), ("switched-on", 0x0007), ("enabled", 0x000F),
    ]  # fmt: skip
    assert walk(chart, "enabled", "enabled") == []
    with pytest.raises(OrderRefused, match="No command leads from Fault"):
        walk(chart, "fault", "enabled")


@pytest.mark.parametrize("family", FAMILIES)
def test_no_stop_word_runs_a_motor_in_any_state(family: str) -> None:
    """No stop has the words of a run order of its chart, in none of its states."""
    profile = library.load(family)
    for chart in profile.data.charts:
        runs = {o.words[-1] for o in chart.orders if o.id in ("forward", "reverse")}
        for state in chart.states:
            raws = {chart.status: state.value}
            if chart.when:
                raws[chart.when.parameter] = chart.when.values[0]
            if not chart.orders:
                continue
            assert chart_in_force(profile, raws) is chart
            stop = choose(chart, "stop", raws)
            assert not runs & set(stop.words)


PRESSES = 400
"""More stops than reads fit between: a held key."""


async def test_held_stop_key_stops(start: Start, journal: Journal) -> None:
    simulation, line = start(DriveSpec("atv71", 1, run_hz=20.0))
    drive = simulation.drive(1)
    await wait_for(lambda: drive.motor.frequency > 5)
    stopper, session = Stopper(line, journal), DriveSession(line, 1, library.load("atv71"))
    for _ in range(PRESSES):
        # nothing is known of the drive: its words are read before one is chosen
        stopper.stop([session])
        await asyncio.sleep(0.001)
        if words_written(line):
            break
    else:
        raise AssertionError("no stop went out while the key was held")
    assert (await ended(stopper, 1)).phase is Phase.STOPPED


async def test_stop_after_a_command_is_a_separate_stop(start: Start, journal: Journal) -> None:
    """A stop begun before the drive was armed again does not count for it."""
    _, line = start(DriveSpec("atv71", 1))
    stopper, session = Stopper(line, journal), DriveSession(line, 1, library.load("atv71"))
    stopper.stop([session])
    session.arming.arm()
    before = stopper.reports[1].time
    stopper.stop([session])
    assert stopper.reports[1].time > before
    assert not session.arming.armed
    assert (await ended(stopper, 1)).phase is Phase.STOPPED
