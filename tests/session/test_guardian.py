"""Motors of exited programs: stopped by the owner of the line, unless taken over."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from tests.bus.peer import eventually
from tests.limits import LINE_BACK_WITHIN, LONGEST_GRACE, SILENT_CLIENT, TAKEN_OVER_WITHIN
from tests.line_events import on_event
from tui.bus.line import Line
from tui.bus.line_events import NoticeReceived, ProgramLost
from tui.bus.link import RtuTcpLink, label
from tui.bus.program import Program
from tui.drive.profile import library
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession
from tui.session.events import EventLog
from tui.session.journal import Journal
from tui.session.sharing.orphan_motors import ENDS_WITHIN, LINE_STAYS_LOST, OrphanMotorGuard
from tui.session.starts.processes import Processes
from tui.session.starts.record import StartRecord
from tui.session.starts.starts import Starts
from tui.simulator import DriveSpec, Simulation

from .fake_clock import FakeClock, let_go_until

GONE = Program("gone", "run", 900_002, "", "pts/3")
LIVING = 900_001
WATCH = Program("watch", "watch", LIVING)
PANEL = Program("panel", "panel", LIVING)


async def come(condition: Callable[[], bool]) -> None:
    await asyncio.to_thread(eventually, condition, 20.0)


class MadeUp(Processes):
    """This program, one other that lives, and no more."""

    def started(self, pid: int) -> str | None:
        return "100" if pid in (os.getpid(), LIVING) else None


class Bench:
    """Two simulated drives whose motors run, on a line that this program owns."""

    def __init__(self) -> None:
        self.simulation = Simulation([DriveSpec("atv71", 1), DriveSpec("atv312", 2)])
        self.simulation.start()
        self.line = Line(RtuTcpLink(*self.simulation.serve_rtu_tcp()))
        self.line.open(wait=5.0)
        self.line.facts.set_programs((self.line.facts.me, GONE))
        self.clock = FakeClock()
        self.starts = Starts(processes=MadeUp(), clock=self.clock)
        self.journal = Journal()
        self.events = EventLog()
        self.reported: list[tuple[int, str]] = []
        on_event(
            self.line.facts,
            NoticeReceived,
            lambda event: self.reported.append((event.device, event.text)),
        )

    def guardian(self, *, person: bool = False) -> OrphanMotorGuard:
        """The guardian of this program, which is a panel if there is a `person`."""
        if person:
            facts = self.line.facts
            facts.me = Program(facts.me.id, "panel", facts.me.pid)
            facts.set_programs((facts.me, GONE))
        sessions = {
            number: DriveSession(self.line, number, library.load(profile), clock=self.clock)
            for number, profile in ((1, "atv71"), (2, "atv312"))
        }
        return OrphanMotorGuard(
            self.line,
            self.journal,
            clock=self.clock,
            session_of=sessions.get,
            events=self.events,
            starts=self.starts,
        )

    def started(
        self,
        device: int,
        *,
        pid: int = GONE.pid,
        left_running: bool = False,
        timeout: float | None = None,
    ) -> None:
        """A program has started a motor, which runs."""
        self.simulation.drive(device).run(20.0)
        profile = "atv71" if device == 1 else "atv312"
        identity = DriveIdentity(device, "V", "R", "0201", "", profile, (profile,))
        record = self.starts.record(
            label(self.line.link), identity, profile, "forward",
            program="run", left_running=left_running, acts_after=timeout,
        )  # fmt: skip
        self.starts.begin(replace(record, pid=pid, started="100"))
        self.starts.sent(label(self.line.link), device)

    def turns(self, device: int) -> bool:
        return self.simulation.drive(device).motor.frequency > 1

    async def stopped(self, device: int) -> None:
        """Wait until the motor is at standstill, without a trip, and its record is removed."""
        drive = self.simulation.drive(device)
        await come(lambda: drive.motor.frequency == 0)
        assert drive.fault is None
        await come(lambda: device not in self.records)

    @property
    def records(self) -> list[int]:
        """The drives of which a start is on record."""
        found = []
        for file in self.files():
            with suppress(FileNotFoundError):  # taken away since it was listed
                found.append(json.loads(file.read_text())["device"])
        return found

    def files(self) -> list[Path]:
        return list(Path(os.environ["DRIVEPANEL_STATE"], "starts").glob("*.json"))

    def gone(self, program: Program = GONE) -> None:
        """A program left the line."""
        loop = self.line._engine._loop
        assert loop is not None
        loop.call_soon_threadsafe(self.line.facts.hear_gone, program)

    def says(self, text: str) -> bool:
        return any(text in item for _, item in self.reported)

    def close(self) -> None:
        self.line.close()
        self.simulation.stop()
        self.starts.close()
        self.journal.close()


@pytest.fixture
async def bench() -> AsyncIterator[Bench]:
    """Two drives whose motors other programs have started."""
    made = await asyncio.to_thread(Bench)
    yield made
    await asyncio.to_thread(made.close)


async def test_motors_of_a_killed_program_are_stopped_immediately(
    bench: Bench,
) -> None:
    bench.started(1)
    bench.started(2, pid=LIVING)
    await come(lambda: bench.turns(1) and bench.turns(2))
    bench.guardian()
    bench.gone()
    await bench.stopped(1)
    assert bench.reported[0] == (1, "run on pts/3 (pid 900002) has exited: its motor is stopped.")
    assert bench.turns(2)
    # the stop counts for all programs: their pending writes to the drive are cancelled
    assert bench.line.facts.stops.stamp(1) >= 1
    assert bench.line.facts.stops.stamp(2) == 0


async def test_motor_of_another_user_of_the_group_is_stopped(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A service of another user owns the line, and keeps polling the drive."""
    (tmp_path / "group").mkdir()
    ours = bench.starts
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "theirs"))
    bench.starts = Starts(processes=MadeUp(), clock=bench.clock)
    bench.started(1)
    theirs, bench.starts = bench.starts, ours
    await come(lambda: bench.turns(1))
    bench.guardian()
    bench.gone()
    await come(lambda: bench.simulation.drive(1).motor.frequency == 0)
    assert bench.line.facts.stops.stamp(1) >= 1
    assert theirs.close(5.0)


async def test_motor_left_running_on_purpose_is_not_stopped(bench: Bench) -> None:
    bench.started(1, left_running=True)
    bench.guardian()
    bench.gone()
    await asyncio.sleep(0.1)
    bench.clock.advance(20)
    await asyncio.sleep(0.3)
    assert bench.reported == []
    assert bench.line.facts.stops.stamp(1) == 0


async def test_program_that_exited_normally_leaves_no_motor_to_stop(bench: Bench) -> None:
    bench.guardian()
    bench.gone()
    await asyncio.sleep(0.3)
    assert bench.reported == []


async def test_ending_process_is_awaited(bench: Bench) -> None:
    """Its socket closes before its number is free: its start would be a living program's."""
    bench.started(1)
    living = {"100"}
    bench.starts.processes.started = lambda pid: (  # type: ignore[method-assign]
        "100" if living or pid in (os.getpid(), LIVING) else None
    )
    bench.guardian()
    bench.gone()
    await asyncio.sleep(0.2)
    assert bench.reported == []
    living.clear()
    await bench.stopped(1)


@pytest.mark.parametrize(
    ("timeout", "grace"), [(None, TAKEN_OVER_WITHIN), (4.0, 4.0), (300.0, LONGEST_GRACE)]
)
async def test_person_has_the_drive_timeout_to_take_a_motor_over(
    bench: Bench, timeout: float | None, grace: float
) -> None:
    bench.started(1, timeout=timeout)
    await come(lambda: bench.turns(1))
    bench.guardian(person=True)
    bench.gone()
    await come(lambda: bench.says(f"stopped in {grace:g} s, unless you take it over (a, then T)"))
    bench.clock.advance(grace - 0.5)
    await asyncio.sleep(0.2)
    assert bench.line.facts.stops.stamp(1) == 0
    bench.clock.advance(1.0)
    await bench.stopped(1)


async def test_motor_taken_over_is_not_stopped(bench: Bench) -> None:
    bench.started(1)
    bench.guardian(person=True)
    bench.gone()
    await come(lambda: bench.says("unless you take it over (a, then T)"))
    (found,) = bench.starts.all_found(label(bench.line.link))
    assert isinstance(found, StartRecord)
    taken = bench.starts.taken_over(found, label(bench.line.link), program="panel")
    await asyncio.to_thread(bench.starts.begin, taken)
    await come(lambda: bench.says("was taken over"))
    bench.clock.advance(20)
    await asyncio.sleep(0.2)
    assert bench.line.facts.stops.stamp(1) == 0


@pytest.mark.parametrize(("other", "waits"), [(PANEL, True), (WATCH, False)])
async def test_recorder_waits_for_an_attached_panel_only(
    bench: Bench, other: Program, waits: bool
) -> None:
    facts = bench.line.facts
    facts.set_programs((facts.me, other, GONE))
    bench.started(1)
    bench.guardian()
    bench.gone()
    await come(lambda: bench.says("has exited"))
    assert bench.says("unless you take it over") is waits


# A living program: frozen, or detached from the line

FROZEN = Program("frozen", "run", LIVING)


async def frozen(bench: Bench, *, person: bool = True, **started: bool) -> None:
    """A program that runs a motor sends no heartbeat, and was disconnected."""
    bench.started(1, pid=LIVING, timeout=10.0, **started)
    await come(lambda: bench.turns(1))
    bench.guardian(person=person)
    bench.gone(FROZEN)
    await asyncio.sleep(0.2)
    assert bench.reported == []  # it may be just ending
    bench.clock.advance(ENDS_WITHIN + 0.1)


async def test_motor_of_a_frozen_program_is_stopped_without_a_panel(
    bench: Bench,
) -> None:
    await frozen(bench, person=False)
    drive = bench.simulation.drive(1)
    await come(lambda: drive.motor.frequency == 0)
    assert drive.fault is None
    assert (
        bench.reported[0][1] == "run (pid 900001) is no longer on the line: its motor is stopped."
    )


async def test_person_has_the_drive_timeout_to_take_over_from_a_frozen_program(
    bench: Bench,
) -> None:
    await frozen(bench)
    let_go = bench.clock.monotonic() - ENDS_WITHIN - 0.1
    await come(lambda: bench.says("unless you take it over (a, then T): run (pid 900001) is no"))
    assert bench.says("is no longer on the line. If it comes back, the motor keeps running.")
    bench.clock.advance(3.0)
    await asyncio.sleep(0.2)
    assert bench.line.facts.stops.stamp(1) == 0
    bench.clock.advance(max(0.0, let_go + 10.1 - SILENT_CLIENT - bench.clock.monotonic()))
    await come(lambda: bench.line.facts.stops.stamp(1) > 0)
    # it was silent for a part of that time before it was disconnected
    assert bench.clock.monotonic() - let_go < 10.0
    drive = bench.simulation.drive(1)
    await come(lambda: drive.motor.frequency == 0)
    assert drive.fault is None
    assert "run (pid 900001) is no longer on the line" in bench.line.facts.stops.by[1]


async def test_motor_of_a_program_that_recovers_in_time_runs(bench: Bench) -> None:
    await frozen(bench)
    await come(lambda: bench.says("If it comes back"))
    bench.line.facts.set_programs((bench.line.facts.me, FROZEN))
    await come(lambda: bench.says("run (pid 900001) is back: its motor keeps running."))
    bench.clock.advance(20)
    await asyncio.sleep(0.2)
    assert bench.line.facts.stops.stamp(1) == 0


async def test_program_disconnected_briefly_is_not_reported(bench: Bench) -> None:
    bench.started(1, pid=LIVING)
    bench.guardian()
    bench.gone(FROZEN)
    await asyncio.sleep(0.1)
    bench.line.facts.set_programs((bench.line.facts.me, FROZEN))
    bench.clock.advance(20)
    await asyncio.sleep(0.3)
    assert bench.reported == []
    assert bench.line.facts.stops.stamp(1) == 0


async def test_motor_of_a_frozen_program_may_be_taken_over(bench: Bench) -> None:
    await frozen(bench)
    await come(lambda: bench.says("If it comes back"))
    # as an attached panel finds it
    (found,) = bench.starts.all_found(label(bench.line.link), {FROZEN.process})
    assert bench.starts.all_found(label(bench.line.link)) == []
    taken = bench.starts.taken_over(found, label(bench.line.link), program="panel")
    await asyncio.to_thread(bench.starts.begin, taken)
    await come(lambda: bench.says("was taken over"))
    bench.clock.advance(20)
    await asyncio.sleep(0.2)
    assert bench.line.facts.stops.stamp(1) == 0


async def test_motor_a_frozen_program_leaves_running_is_not_stopped(bench: Bench) -> None:
    await frozen(bench, left_running=True)
    bench.clock.advance(20)
    await asyncio.sleep(0.3)
    assert bench.reported == []
    assert bench.line.facts.stops.stamp(1) == 0


# Trouble


async def test_drive_without_a_profile_is_reported(bench: Bench) -> None:
    bench.started(1)
    guardian = bench.guardian()
    guardian._session_of = lambda _: None
    (path,) = bench.files()
    path.write_text(path.read_text().replace('"profile": "atv71"', '"profile": "gone99"'))
    bench.gone()
    await come(lambda: bench.says("Stop it at the machine"))


async def test_closed_line_stops_no_motor(bench: Bench) -> None:
    bench.started(1)
    bench.guardian()
    await asyncio.to_thread(bench.line.close)
    bench.line.facts.events.emit(ProgramLost(GONE))
    assert bench.reported == []


async def test_closed_guard_stops_no_motor(bench: Bench) -> None:
    bench.started(1)
    bench.guardian().close()
    bench.gone()
    await asyncio.sleep(0.3)
    assert bench.reported == []


async def test_unstable_line_is_abandoned_like_a_lost_one(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The port number is reused, or a gateway hangs up: connected for a moment."""
    bench.started(1)
    guardian = bench.guardian()
    bench.simulation.stop()
    looks = {0: 0}

    def is_connected(_: OrphanMotorGuard) -> bool:
        stops = bench.line.facts.stops.stamp(1)
        looks[stops] = looks.get(stops, 0) + 1
        return looks[stops] == 8

    monkeypatch.setattr(OrphanMotorGuard, "_is_connected", is_connected)
    bench.gone()
    await come(lambda: guardian.busy)
    await let_go_until(bench.clock, lambda: not guardian.busy, step=LINE_BACK_WITHIN / 20)
    assert len(looks) > 2, "it was connected in the meantime"
    assert bench.says(LINE_STAYS_LOST)
    assert bench.records == [1]
