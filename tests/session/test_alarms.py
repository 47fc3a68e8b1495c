"""Faults of a line: first-out, reported once, acknowledged, reset, and kept in the journal."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tui.drive.profile import library
from tui.drive.profile.schema import FaultCode
from tui.session.drive_state import DriveState, drive_state
from tui.session.events import EventLog
from tui.session.monitor.alarms import FaultOnset, FaultOnsets, LineAlarms, PresentFault

RUNS = replace(drive_state(library.load("atv71"), {}), kind="running")
OBF = FaultCode(raw=18, code="ObF", name="Overbraking")
OLF = FaultCode(raw=17, code="OLF", name="Motor overload")


def tripped(fault: FaultCode | None) -> DriveState:
    return replace(RUNS, kind="fault", fault=fault)


class Bench:
    def __init__(self) -> None:
        self.now = 0.0
        self.log = EventLog(lambda: self.now)
        self.kept: list[tuple[int, str, str]] = []
        self.alarms = LineAlarms(self.log, self.keep)
        self.onsets = FaultOnsets()

    def take(self, states: dict[int, DriveState]) -> bool:
        """The states as the line's loop notes them, then a look."""
        for device, state in states.items():
            self.onsets.note(device, state, self.now)
        return self.alarms.take(states, self.onsets.by_device)

    def keep(self, fault: PresentFault, what: str) -> None:
        self.kept.append((fault.device, fault.code, what))

    @property
    def output(self) -> list[str]:
        return [f"{event.device} {event.kind}: {event.text}" for event in self.log.events]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_first_fault_stays_first_and_each_is_new_once(bench: Bench) -> None:
    assert not bench.take({1: RUNS, 3: RUNS, 17: RUNS})
    assert bench.take({1: RUNS, 3: RUNS, 17: tripped(OLF)})
    assert not bench.take({1: RUNS, 3: RUNS, 17: tripped(OLF)})
    bench.now = 60.0
    assert bench.take({1: RUNS, 3: tripped(OBF), 17: tripped(OLF)})
    assert [fault.device for fault in bench.alarms.active] == [17, 3]
    assert bench.output[0] == "17 fault: Tripped on OLF Motor overload."
    assert bench.output[1].startswith(
        "3 fault: Tripped on ObF Overbraking. Drive 17 tripped first, at "
    )
    assert bench.kept == [(17, "OLF", "tripped"), (3, "ObF", "tripped")]


def test_acknowledging_applies_to_one_drive(bench: Bench) -> None:
    bench.take({3: tripped(OBF), 17: tripped(OLF)})
    bench.alarms.acknowledge(3)
    assert bench.alarms.unseen
    bench.alarms.acknowledge(17)
    assert not bench.alarms.unseen
    assert len(bench.alarms.active) == 2


def test_same_fault_after_a_reset_is_new(bench: Bench) -> None:
    bench.take({3: tripped(OBF)})
    bench.alarms.acknowledge(3)
    assert not bench.take({3: RUNS})
    assert bench.alarms.active == ()
    assert bench.output[-1] == "3 done: ObF Overbraking is reset."
    assert bench.take({3: tripped(OBF)})
    assert bench.alarms.unseen


def test_drive_in_an_unknown_state_keeps_its_fault(bench: Bench) -> None:
    bench.take({3: tripped(OBF)})
    assert not bench.take({3: replace(RUNS, kind="unknown")})
    assert [fault.code for fault in bench.alarms.active] == ["ObF"]
    bench.take({})
    assert bench.alarms.active == ()


def test_fault_code_read_later_is_reported_without_a_second_bell(bench: Bench) -> None:
    assert bench.take({3: tripped(None)})
    assert not bench.take({3: tripped(OBF)})
    assert [fault.code for fault in bench.alarms.active] == ["ObF"]
    assert bench.output[-1] == "3 fault: The fault is ObF Overbraking."


def test_different_fault_of_the_same_drive_is_new(bench: Bench) -> None:
    bench.take({3: tripped(OBF)})
    assert bench.take({3: tripped(OLF)})


def test_fault_present_at_the_first_read_is_not_a_trip(bench: Bench) -> None:
    bench.now = 30.0
    assert bench.take({3: tripped(OBF)})
    assert bench.kept == [(3, "ObF", "seen")]
    assert bench.output == ["3 fault: Already tripped on ObF Overbraking when first seen."]
    (fault,) = bench.alarms.active
    assert not fault.tripped
    assert fault.when.startswith("seen since ")
    bench.take({3: RUNS})
    bench.now = 60.0
    bench.take({3: tripped(OBF)})
    (fault,) = bench.alarms.active
    assert (fault.tripped, fault.wall) == (True, 60.0)
    assert fault.when.startswith("tripped ")


def test_trip_noted_before_the_read_keeps_its_time(bench: Bench) -> None:
    bench.take({3: RUNS})
    bench.now = 60.0
    bench.onsets.note(3, tripped(None), bench.now)
    bench.now = 60.4
    bench.onsets.note(3, tripped(OBF), bench.now)
    bench.now = 61.0
    bench.take({3: tripped(OBF)})
    assert bench.alarms.active[0].wall == 60.0
    assert bench.log.events[-1].wall == 60.0


def test_fault_not_noted_yet_waits_for_the_next_read(bench: Bench) -> None:
    bench.take({3: RUNS})
    assert not bench.alarms.take({3: tripped(OBF)}, bench.onsets.by_device)
    assert not bench.alarms.active
    assert bench.take({3: tripped(OBF)})
    assert bench.alarms.active[0].tripped


def test_same_trip_of_a_returning_drive_is_recorded_once(bench: Bench) -> None:
    bench.take({3: RUNS})
    bench.take({3: tripped(OBF)})
    bench.take({})
    bench.now = 90.0
    assert not bench.take({3: tripped(OBF)})
    assert [fault.wall for fault in bench.alarms.active] == [0.0]
    assert bench.kept == [(3, "ObF", "tripped")]


def test_onset_of_a_fault_has_its_time_its_code_and_if_the_trip_was_seen() -> None:
    onsets = FaultOnsets()
    unknown = replace(RUNS, kind="unknown")
    onsets.note(1, unknown, 1.0)
    onsets.note(1, tripped(OBF), 2.0)
    assert onsets.by_device == {1: FaultOnset(2.0, False, "ObF")}, "it was never seen without"
    onsets.note(1, unknown, 3.0)
    onsets.note(2, RUNS, 3.0)
    onsets.note(2, tripped(None), 4.0)
    assert onsets.by_device[1].wall == 2.0
    onsets.note(2, tripped(OLF), 5.0)
    onsets.note(2, tripped(None), 6.0)
    assert onsets.by_device[2] == FaultOnset(4.0, True, "OLF")
    onsets.note(2, tripped(OBF), 7.0)
    assert onsets.by_device[2] == FaultOnset(7.0, True, "ObF")
    onsets.note(2, RUNS, 8.0)
    assert set(onsets.by_device) == {1}


def test_older_state_that_is_read_after_one_of_a_record_changes_no_onset() -> None:
    """After a seek, the checks of a replay begin before its time."""
    onsets = FaultOnsets()
    onsets.recall(1, RUNS, 1.0)
    onsets.recall(1, tripped(OBF), 2.0)
    onsets.recall(1, tripped(OBF), 9.0)
    onsets.note(1, RUNS, 5.0)
    onsets.note(1, tripped(OBF), 6.0)
    assert onsets.by_device == {1: FaultOnset(2.0, True, "ObF")}
    onsets.note(1, RUNS, 10.0)
    assert onsets.by_device == {}
