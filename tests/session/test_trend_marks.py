"""Events that a trend marks, from the states and references of one cycle after the other."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import pytest

from tests.ui import fakes
from tui.drive.profile import library
from tui.session.monitor.snapshot import Snapshot
from tui.session.monitor.trend import TREND_MARKS, Trend, TrendMarker, TrendPoint, readout_parameter

ATV71 = library.load("atv71")
READY, RUNNING, FAULT = (
    fakes.snapshot_of(ATV71, raws) for raws in (fakes.READY, fakes.RUNNING, fakes.FAULT)
)
LOST = replace(READY, error="Device 2 did not answer.")


def marks(*snapshots: Snapshot) -> list[str]:
    """The mark of each cycle, with a reference that never changes."""
    marker = TrendMarker()
    return [marker.mark(snapshot, 50.0, 0) for snapshot in snapshots]


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
    ],
)
def test_each_event_is_marked_once(snapshots: list[Snapshot], expected: list[str]) -> None:
    assert marks(*snapshots) == expected


@pytest.mark.parametrize(
    ("references", "expected"),
    [
        ([30.0, 30.0, 40.0, 40.0], ["", "", "reference", ""]),
        ([30.0, 30.0, 30.4, 30.4], ["", "", "", ""]),
        ([30.0, 30.5, 31.2, 32.0, 31.1], [""] * 5),
        ([30.0, None, 40.0], ["", "", ""]),
        ([30.0, 30.0, -30.0], ["", "", "reference"]),
    ],
)
def test_only_a_step_of_a_steady_reference_is_marked(
    references: list[float | None], expected: list[str]
) -> None:
    marker = TrendMarker()
    assert [marker.mark(RUNNING, reference, 0) for reference in references] == expected


def test_edit_is_marked_and_a_trip_matters_more() -> None:
    marker = TrendMarker()
    found = [
        marker.mark(snapshot, 50.0, edits)
        for snapshot, edits in ((RUNNING, 0), (RUNNING, 2), (RUNNING, 2), (FAULT, 3), (FAULT, 3))
    ]
    assert found == ["", "write", "", "trip", ""]


def test_edit_during_a_lost_cycle_is_marked_afterwards() -> None:
    marker = TrendMarker()
    cycles = ((RUNNING, 0), (LOST, 1), (RUNNING, 1), (RUNNING, 1))
    found = [marker.mark(snapshot, 50.0, edits) for snapshot, edits in cycles]
    assert found == ["", "lost", "write", ""]


def test_mark_is_kept_with_its_point_and_for_the_next_program() -> None:
    trend = Trend(ATV71)
    trend.add(READY)
    point = trend.add(replace(RUNNING, time=READY.time + 1))
    assert point.mark == "start"
    assert trend.points[-1] == point
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
