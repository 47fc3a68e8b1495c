"""Curves and rows of the drive list: each from its own drive, and no old value as a current one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tui.drive.profile import library
from tui.screens.connection.rows import rows_of
from tui.screens.connection.wall import columns_for, wall_line
from tui.screens.connection.wall_curves import PAGE, CurveCells, WallCurves
from tui.session.console import DriveConsole
from tui.session.fleet import FoundDrive
from tui.session.monitor.look import Look
from tui.session.monitor.trend import Trend, TrendPoint
from tui.widgets.curve import ASCII_SIGNS, BLOCKS, BRAILLE, CurveSigns
from tui.widgets.palette import ALARM, STALE

from . import fakes

WALL = fakes.StillClock().wall()
CELLS = CurveCells(24, 2)
ATV71 = library.load("atv71")


def console_with(device: int, *values: float | None, every: float = 3.0) -> DriveConsole:
    """A drive whose last values, oldest first, are some seconds apart, up to now."""
    console = fakes.console_of(None, device=device)
    first = fakes.NOW - every * (len(values) - 1)
    points = [TrendPoint(first + every * n, (v, None, None)) for n, v in enumerate(values)]
    console.monitor = fakes.StillMonitor(console.session, None, points)
    return console


def drawn(
    curves: WallCurves, *consoles: DriveConsole, cells: CurveCells = CELLS, later: float = 0.0
) -> dict[int, tuple[str, ...]]:
    found, _ = curves.draw(consoles, cells, now=fakes.NOW + later, wall=WALL + later, reach=9.0)
    return dict(found)


def test_each_drive_has_its_own_curve() -> None:
    low, high = console_with(3, *[0.0] * 15), console_with(31, *[60.0] * 15)
    both = drawn(WallCurves(), low, high)
    assert both == {**drawn(WallCurves(), low), **drawn(WallCurves(), high)}
    assert both[3][0].strip() == "" != both[3][1].strip()
    assert both[31][1].strip() == "" != both[31][0].strip()
    assert drawn(WallCurves(), high, low) == both, "in any order"


def test_another_drive_at_an_address_gets_a_curve_of_its_own() -> None:
    curves = WallCurves()
    before = drawn(curves, console_with(3, 50.0, 50.0))
    assert drawn(curves, console_with(3, 0.0, 0.0)) != before


def test_new_value_changes_only_cells_at_its_end() -> None:
    curves, console = WallCurves(), console_with(3, *[50.0, 20.0] * 6)
    before = drawn(curves, console)[3]
    point = TrendPoint(fakes.NOW + 3, (35.0, None, None))
    console.monitor._trend.join([point])
    after = drawn(curves, console, later=3.0)[3]
    changed = {
        x for old, new in zip(before, after, strict=True) for x in range(24) if old[x] != new[x]
    }
    assert changed
    assert max(changed) - min(changed) <= 2


def test_page_stands_still_between_turns() -> None:
    curves, console = WallCurves(), console_with(3, *[50.0, 20.0] * 6)
    turn = PAGE.turn - WALL % PAGE.turn
    pages = [drawn(curves, console, later=later)[3] for later in (0.0, turn - 0.1, turn + 0.1)]
    assert pages[0] == pages[1] != pages[2]


def test_curve_ends_where_the_drive_stopped_answering() -> None:
    console = console_with(3, 50.0, 50.0, None, None)
    lost = replace(console.monitor.trend[2], mark="lost")
    console.monitor._trend = Trend(ATV71, [*console.monitor.trend[:2], lost])
    rows = drawn(WallCurves(), console)[3]
    end = rows[0].index("×")
    assert not rows[0][end + 1 :].strip()


def test_scale_is_the_same_for_all_drives_and_holds_the_highest() -> None:
    consoles = console_with(1, 20.0, 20.0), console_with(2, 90.0, 90.0)
    _, high = WallCurves().draw(consoles, CELLS, now=fakes.NOW, wall=WALL, reach=9.0)
    assert high == 120.0
    _, high = WallCurves().draw(consoles[:1], CELLS, now=fakes.NOW, wall=WALL, reach=9.0)
    assert high == 60.0


@pytest.mark.parametrize("signs", [BRAILLE, BLOCKS, ASCII_SIGNS])
def test_curve_uses_the_signs_of_the_terminal(signs: CurveSigns) -> None:
    cells = CurveCells(24, 1, signs)
    text = drawn(WallCurves(), console_with(3, 0.0, 30.0, 60.0), cells=cells)[3][0]
    assert text.strip()
    assert set(text) <= {" ", *cells.signs.glyphs}


def fleet_of(look: Look) -> fakes.StillFleet:
    return fakes.StillFleet(
        FoundDrive(replace(fakes.ATV71, device=3), fakes.console_of(None, device=3)),
        line_watch=fakes.FakeLineWatch(looks={3: look}),
    )


def test_values_of_a_silent_drive_are_old_and_have_their_age() -> None:
    before = fakes.look_of(fakes.RUNNING, age=47.0)
    lost = Look(None, "No answer.", fakes.NOW - 1, None, {}, before, "silent")
    row = rows_of(fleet_of(lost), fakes.NOW, connected=True)[3]
    assert (row.old, row.age, row.words) == (True, 47.0, "NO ANSWER")
    assert row.message == ("for 47 s", "was FORWARD")
    for width, two_rows in ((119, True), (119, False), (79, True), (79, False), (36, False)):
        text = wall_line(row, columns_for(width, two_rows=two_rows))
        assert "47 s" in text.plain
        styles = {str(text.plain[s.start : s.end]).strip(): s.style for s in text.spans}
        assert styles["50.0"] == STALE
        assert ALARM in styles.values()


def test_values_of_a_drive_that_has_just_become_silent_are_old_too() -> None:
    before = fakes.look_of(fakes.RUNNING, age=5.0)
    lost = Look(None, "No answer.", fakes.NOW - 1, None, {}, before, "silent")
    row = rows_of(fleet_of(lost), fakes.NOW, connected=True)[3]
    assert (row.old, row.age, row.reference) == (True, 5.0, "")


def test_row_has_the_curve_of_its_drive() -> None:
    looks = {device: fakes.look_of(fakes.RUNNING) for device in (3, 31)}
    drives = [
        FoundDrive(replace(fakes.ATV71, device=d), fakes.console_of(None, device=d)) for d in looks
    ]
    fleet = fakes.StillFleet(*drives, line_watch=fakes.FakeLineWatch(looks=looks))
    curves = {31: ("high",), 3: ("low",)}
    rows = rows_of(fleet, fakes.NOW, connected=True, curves=curves)
    assert {device: row.curve for device, row in rows.items()} == curves


def test_values_older_than_three_checks_are_old() -> None:
    for age, old in ((8.0, False), (10.0, True)):
        row = rows_of(fleet_of(fakes.look_of(fakes.RUNNING, age=age)), fakes.NOW, connected=True)[3]
        assert (row.old, row.age is not None) == (old, old)
        assert ("10 s old" in row.message[0]) is old


def test_row_of_a_tripped_drive_has_the_time_since_the_trip() -> None:
    fleet = fleet_of(fakes.look_of(fakes.FAULT))
    fleet.line_watch.tripped_at = WALL - 200  # type: ignore[attr-defined]
    fleet.alarms.take(fleet.line_watch.states, fleet.line_watch.onsets.by_device)
    row = rows_of(fleet, fakes.NOW, connected=True, wall=WALL)[3]
    assert (row.words, row.brief) == ("FAULT ObF", "3 min")
    text = wall_line(row, columns_for(79)).plain
    assert "3 min · overbraking" in text


def test_checks_of_the_line_watch_are_points_of_the_trend() -> None:
    trend = Trend(ATV71)
    look = fakes.look_of(fakes.RUNNING, age=3.0)
    assert trend.add(look).values == (50.0, 8.4, 50.0)
    lost = Look(None, "No answer.", fakes.NOW, None, {}, look, "silent")
    assert (trend.add(lost).values, trend.points[-1].mark) == ((None,) * 3, "lost")
