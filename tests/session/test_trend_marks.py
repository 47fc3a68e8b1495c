"""Events that a trend marks, from the states and references of one cycle after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock

import msgspec
import pytest

from tests.ui import fakes
from tui.bus.line_events import DeviceWritten
from tui.bus.program import Program
from tui.drive.profile import library
from tui.session.monitor import trend as trends
from tui.session.monitor.snapshot import Snapshot
from tui.session.monitor.trend import (
    COMMAND_REACH,
    MOST_NOTED,
    NOTED_EVERY,
    TREND_MARKS,
    Trend,
    TrendMarker,
    TrendNotes,
    TrendPoint,
    readout_parameter,
)

ATV71 = library.load("atv71")
READY, RUNNING, FAULT = (
    fakes.snapshot_of(ATV71, raws) for raws in (fakes.READY, fakes.RUNNING, fakes.FAULT)
)
UNKNOWN = fakes.snapshot_of(ATV71, {})
LOST = replace(READY, error="Device 2 did not answer.")


def marks(*snapshots: Snapshot) -> list[str]:
    """The mark of each cycle, with a reference that never changes."""
    marker = TrendMarker()
    return [marker.mark(snapshot, 50.0).mark for snapshot in snapshots]


@pytest.mark.parametrize(
    ("snapshots", "expected"),
    [
        ([READY, READY, RUNNING, RUNNING], ["", "", "start", ""]),
        ([RUNNING, READY, RUNNING], ["", "stop", "start"]),
        ([RUNNING, FAULT, FAULT, READY], ["", "trip", "", "reset"]),
        ([FAULT, RUNNING], ["", "start"]),
        ([RUNNING, LOST, LOST, READY], ["", "lost", "", ""]),
        ([LOST, RUNNING, LOST], ["", "", "lost"]),
        ([RUNNING, LOST, FAULT, FAULT], ["", "lost", "trip", ""]),
        ([FAULT, LOST, FAULT], ["", "lost", ""]),
        ([LOST, FAULT], ["", ""]),
        ([READY, UNKNOWN, RUNNING], ["", "", ""]),
        ([RUNNING, UNKNOWN, READY], ["", "", ""]),
    ],
)
def test_each_event_is_marked_once(snapshots: list[Snapshot], expected: list[str]) -> None:
    assert marks(*snapshots) == expected


@pytest.mark.parametrize(
    ("references", "expected"),
    [
        ([30.0, 30.0, 40.0, 40.0], ["", "", "reference", ""]),
        ([30.0, 30.0, 30.4, 30.4], ["", "", "", ""]),
        ([30.0, 30.0, 30.5], ["", "", "reference"]),
        ([30.0, 30.5, 31.2, 32.0, 31.1], [""] * 5),
        ([30.0, None, 40.0], ["", "", ""]),
        ([30.0, 30.0, -30.0], ["", "", "reference"]),
    ],
)
def test_only_a_step_of_a_steady_reference_is_marked(
    references: list[float | None], expected: list[str]
) -> None:
    marker = TrendMarker()
    assert [marker.mark(RUNNING, reference).mark for reference in references] == expected


def written(address: int, *values: int, by: str = "run", time: float = 100.0) -> DeviceWritten:
    return DeviceWritten(2, address, values, Program(by, by, 7), time)


ACC, CMD, LFR = (ATV71[code].address for code in ("ACC", "CMD", "LFR"))


def points(*steps: tuple[Snapshot, Sequence[DeviceWritten]]) -> list[TrendPoint]:
    """The points of cycles 0.5 s apart, each with the writes before it."""
    trend = Trend(ATV71)
    found = []
    for number, (snapshot, writes) in enumerate(steps):
        for write in writes:
            trend.note_write(write)
        found.append(trend.add(replace(snapshot, time=100.0 + number / 2)))
    return found


def test_write_of_any_program_is_marked_with_its_program_and_a_trip_matters_more() -> None:
    both = [written(ACC, 30), written(ACC + 1, 40, by="panel"), written(65000, 1, by="panel")]
    found = points((RUNNING, []), (RUNNING, both), (RUNNING, []), (FAULT, both), (FAULT, []))
    assert [point.mark for point in found] == ["", "write", "", "trip", ""]
    assert found[1].by == ("run (pid 7)", "panel (pid 7)")
    assert found[1].codes == ("ACC", "DEC", "register 65000")
    assert found[3].by == ()
    assert found[3].codes == ("ObF Overbraking",)


def test_write_during_a_lost_cycle_is_marked_afterwards() -> None:
    found = points((RUNNING, []), (LOST, [written(ACC, 30)]), (RUNNING, []), (RUNNING, []))
    assert [point.mark for point in found] == ["", "lost", "write", ""]
    assert found[2].codes == ("ACC",)


def test_trip_has_its_fault_even_if_the_code_is_read_a_cycle_later() -> None:
    late = replace(FAULT, state=replace(FAULT.state, fault=None))
    trend = Trend(ATV71)
    for number, cycle in enumerate((RUNNING, late, FAULT, READY)):
        trend.add(replace(cycle, time=100.0 + number))
    assert [(point.mark, point.codes) for point in trend.points[1:]] == [
        ("trip", ("ObF Overbraking",)), ("", ()), ("reset", ()),
    ]  # fmt: skip
    unread = Trend(ATV71)
    for number, cycle in enumerate((RUNNING, late, READY)):
        unread.add(replace(cycle, time=100.0 + number))
    assert unread.points[1].codes == ()


def test_start_names_the_program_of_a_command_shortly_before_it() -> None:
    found = points((READY, []), (RUNNING, [written(CMD, 15)]))
    assert (found[1].mark, found[1].by, found[1].codes) == ("start", ("run (pid 7)",), ())
    late = points((READY, []), (RUNNING, [written(CMD, 15, time=100.5 - COMMAND_REACH - 0.1)]))
    assert (late[1].mark, late[1].by) == ("start", ())
    assert points((READY, []), (READY, [written(CMD, 15), written(LFR, 300)]))[1].mark == ""


def test_event_names_the_last_programs_that_commanded_and_no_setting() -> None:
    writes = [written(CMD, 15, by=by) for by in ("one", "two", "three", "two")]
    found = points((RUNNING, []), (READY, [*writes, written(ACC, 30, by="four")]))
    assert (found[1].mark, found[1].by) == ("stop", ("three (pid 7)", "two (pid 7)"))
    assert found[1].codes == ()


def test_mark_is_kept_with_its_point_and_for_the_next_program() -> None:
    trend = Trend(ATV71)
    trend.add(READY)
    point = trend.add(replace(RUNNING, time=READY.time + 1))
    assert point.mark == "start"
    assert trend.points[-1] == point
    point = replace(point, by=("run",), codes=("ACC",))
    sent = msgspec.msgpack.encode([point])
    assert msgspec.msgpack.decode(sent, type=list[TrendPoint]) == [point]
    before = msgspec.msgpack.encode([{"time": 1.0, "values": (1.0, None, 2.0)}])
    assert msgspec.msgpack.decode(before, type=list[TrendPoint])[0].mark == ""
    assert {"start", "lost"} < set(TREND_MARKS)


@pytest.mark.parametrize("family", ["powerdrive", "proxidrive", "varmeca"])
def test_family_without_a_confirmed_frequency_keeps_its_raw_values(family: str) -> None:
    profile = library.load(family)
    assert profile.quantity("output_frequency") is None
    output = readout_parameter(profile, "output_frequency")
    current = readout_parameter(profile, "motor_current")
    assert output is not None
    assert current is not None
    raws = {"10.40": 3, output.code: 4512, current.code: 118}
    assert Trend(profile).add(fakes.snapshot_of(profile, raws)).values == (4512, 118, None)


@pytest.mark.parametrize(
    ("quantity", "directed"),
    [("output_frequency", True), ("frequency_reference", True), ("motor_current", False)],
)
def test_frequency_in_a_trend_has_the_sign_of_its_direction_and_a_current_none(
    quantity: str, directed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    signed: list[object] = []

    def with_direction(*those: object) -> float:
        signed.append(those)
        return -30.0

    monkeypatch.setattr(trends, "with_direction", with_direction)
    parameter = SimpleNamespace(quantity=quantity)
    reading = SimpleNamespace(number=30.0, parameter=parameter)
    state = cast(Any, object())
    assert trends.trend_value(cast(Any, reading), state) == (-30.0 if directed else 30.0)
    assert signed == [(parameter, 30.0, state)] * directed
    reading.number = None
    assert trends.trend_value(cast(Any, reading), state) is None


def test_trend_keeps_the_points_of_ten_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trends, "trend_values", lambda *_: (1.0, None, None))
    trend = Trend(library.load("atv71"))
    for time in (0.0, 100.0, 600.0):
        trend.add(replace(READY, time=time))
    assert [point.time for point in trend.points] == [0.0, 100.0, 600.0]
    trend.add(replace(READY, time=600.5))
    assert [point.time for point in trend.points] == [100.0, 600.0, 600.5]
    trend.join([TrendPoint(0.25, ()), TrendPoint(0.5, ()), TrendPoint(600.0, ())])
    assert [point.time for point in trend.points] == [0.5, 100.0, 600.0, 600.5]
    assert trend.points[2].values == (1.0, None, None), "its own point counts"


@pytest.mark.parametrize(("before", "by"), [(COMMAND_REACH, ("run",)), (COMMAND_REACH + 0.5, ())])
def test_command_of_two_seconds_before_may_be_the_cause_of_a_start(
    before: float, by: tuple[str, ...]
) -> None:
    marker = TrendMarker()
    marker.commands.append(trends.TrendWrite(100.0, "run"))
    marker.mark(replace(READY, time=99.0), 50.0)
    found = marker.mark(replace(RUNNING, time=100.0 + before), 50.0)
    assert (found.mark, found.by) == ("start", by)


def test_command_without_a_reference_does_not_change_the_reference() -> None:
    marker = TrendMarker()
    marker.commands.append(trends.TrendWrite(100.0, "run", reference=False))
    marker.commands.append(trends.TrendWrite(100.0, "panel"))
    for time, reference in ((99.0, 50.0), (99.5, 50.0)):
        marker.mark(replace(RUNNING, time=time), reference)
    found = marker.mark(replace(RUNNING, time=100.5), 40.0)
    assert (found.mark, found.by) == ("reference", ("panel",))


def test_trend_is_noted_every_two_seconds_or_hundred_points() -> None:
    facts, trend = Mock(), Mock(kind="trend atv71")
    notes = TrendNotes(facts, 2, trend)
    for _ in range(2):
        notes.ask()
        notes.end()
    facts.notes.ask.assert_called_once_with(2, "trend atv71")
    assert facts.events.subscribe.call_count == 2

    def noted(*times: float) -> list[int]:
        facts.notes.leave.reset_mock()
        for time in times:
            notes.add(TrendPoint(time, (1.0, None, 2.0)))
        left = [each.args[0] for each in facts.notes.leave.call_args_list]
        assert {(note.device, note.kind) for note in left} <= {(2, "trend atv71")}
        return [len(msgspec.msgpack.decode(note.data)) for note in left]

    assert noted(0.0, 1.0, NOTED_EVERY) == [3]
    assert noted(10.0, 9.0 + NOTED_EVERY) == []
    assert noted(10.0 + NOTED_EVERY) == [3]
    assert noted(*[20.0] * (MOST_NOTED - 1)) == []
    assert noted(20.0) == [MOST_NOTED]
