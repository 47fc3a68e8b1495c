"""Trend: its page of time, its bands, what it reads, and what it saves."""

from __future__ import annotations

import csv
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.screens.trend.event_list import trend_events
from tui.screens.trend.page import TREND_STEPS, TrendPage
from tui.screens.trend.saving import points_of_time, svg_text
from tui.screens.trend.screen import TrendScreen
from tui.screens.trend.table import TableRow, value_table
from tui.screens.trend.traces import compacted, mark_values, value_at
from tui.screens.trend.view import samples_of_points, scale_for, trend_room
from tui.session.events import Event
from tui.session.fleet import FoundDrive
from tui.session.monitor.trend_bands import TrendBand, stored_bands
from tui.session.record.decoding import HistoryPoint
from tui.session.record.history import History
from tui.session.record.schema import EventRow
from tui.widgets.lines import Lines

from . import fakes
from .test_trend_pictures import BANDS, SCENES, WALL, Scene, panel, show

pytestmark = pytest.mark.long

NOW = WALL


def point(at: float, value: float | None, end: float | None = None) -> HistoryPoint:
    quality = "no reply" if value is None else "good"
    last = at if end is None else end
    return HistoryPoint(at, last, value, value, value, quality, reduced=end is not None)


# The page of time

MOVES = st.lists(
    st.one_of(
        st.tuples(st.just("moved"), st.integers(-90, 90)),
        st.tuples(st.just("turned"), st.integers(-3, 3)),
        st.tuples(st.just("span"), st.integers(-2, 2)),
        st.tuples(st.sampled_from(["hold", "run", "mark"]), st.just(0)),
    ),
    max_size=30,
)


@given(MOVES, st.integers(10, 190))
def test_page_has_its_cursor_and_nothing_of_the_future(
    moves: list[tuple[str, int]], width: int
) -> None:
    page, now = TrendPage(), NOW
    for name, number in moves:
        now += 0.7
        match name:
            case "moved":
                page = page.moved(number, width, now)
            case "turned":
                page = page.turned(number, now)
            case "span":
                page = page.with_span(number, now)
            case "hold":
                page = page.hold(now)
            case "run":
                page = page.run()
            case "mark":
                page = page.marked(now)
        start, span = page.begins(now), page.step.span
        assert page.step in TREND_STEPS
        assert page.ends(now) <= now
        assert start <= page.ends(now)
        if page.cursor is not None:
            assert page.held
            assert start <= page.cursor < start + span
            assert page.cursor <= page.until
        if not page.held:
            assert start <= now < start + span
        assert start % page.step.tick == pytest.approx(0, abs=1e-3) or page.held


def test_marks_are_set_at_the_cursor_then_at_the_newest_value_then_removed() -> None:
    page = TrendPage().moved(-1, 60, NOW).moved(-10, 60, NOW).marked(NOW)
    assert page.mark_a == page.cursor
    page = page.run().marked(NOW + 5)
    assert page.mark_b == NOW + 5
    page = page.marked(NOW + 6)
    assert (page.mark_a, page.mark_b) == (None, None)


# Values


def test_value_at_a_moment_is_the_last_one_and_none_in_a_gap() -> None:
    points = [point(10, 1.0), point(11, 2.0), point(12, None), point(20, 3.0)]
    assert [getattr(value_at(points, at, 3), "mean", None) for at in (9, 10, 11.9, 12, 19, 22)] == [
        None, 1.0, 2.0, None, None, 3.0,
    ]  # fmt: skip


def test_values_between_marks_include_those_at_the_marks() -> None:
    points = [point(at, float(at)) for at in range(10)]
    found = mark_values(points, 7.5, 2.5, 3)
    assert found.at_a == points[7]
    assert found.at_b == points[2]
    assert found.between is not None
    between = found.between
    assert (between.least, between.mean, between.most, between.good) == (2, 4.5, 7, 6)


def test_gap_between_marks_has_no_values() -> None:
    assert mark_values([point(0, 1.0)], 100, 200, 3).between is None


def test_samples_of_a_reduced_point_are_its_extent_and_nothing_after_the_hold() -> None:
    wide = replace_extent(point(0, 5.0, 10), 1.0, 9.0)
    found = samples_of_points([wide, point(11, 6.0), point(12, None), point(13, 7.0)], 12.5)
    assert found == [(5, 1.0), (5, 9.0), (5, 5.0), (11, 6.0), (12, None)]


def replace_extent(of: HistoryPoint, least: float, most: float) -> HistoryPoint:
    return of._replace(least=least, most=most)


@given(
    st.lists(st.floats(-1e4, 1e4, width=32), min_size=1, max_size=6),
    st.lists(st.floats(-1e4, 1e4, width=32), max_size=6),
)
def test_axis_includes_all_values_and_changes_only_if_it_must(
    first: list[float], more: list[float]
) -> None:
    before = scale_for([point(at, value) for at, value in enumerate(first)], None)
    assert before[0] <= min(first)
    assert max(first) <= before[1]
    assert before[0] < before[1]
    after = scale_for([point(at, value) for at, value in enumerate(first + more)], before)
    if all(before[0] <= value <= before[1] for value in more):
        assert after == before


@given(st.floats(0.3, 3), st.integers(1, 20))
def test_compacted_points_keep_the_extent_and_the_gaps(apart: float, length: int) -> None:
    count = 400
    points = [point(at * apart, float(at % 7)) for at in range(count)]
    del points[100 : 100 + 5 * length]
    found = compacted(points, 0, count * apart)
    values = [item for item in found if item.mean is not None]
    assert min(item.least or 0 for item in values) == 0
    assert max(item.most or 0 for item in values) == 6
    assert sum(item.good for item in values) == len(points)
    gap = (99 * apart, (100 + 5 * length) * apart)
    assert not [item for item in values if gap[0] + apart < item.time < gap[1] - apart]
    assert any(item.mean is None and gap[0] <= item.time <= gap[1] for item in found)


@given(st.integers(60, 220), st.integers(12, 70), st.integers(0, 4), st.booleans())
def test_parts_fit_the_terminal(width: int, height: int, bands: int, events: bool) -> None:
    room = trend_room(width, height, bands, events=events)
    count = max(1, bands)
    rows = (
        count * (room.rows + 1) + 1 + room.clock + room.marks + room.line + room.events + room.kept
    )
    rows += (count + 1) * room.table
    assert room.rows >= 1
    assert room.columns > 10
    assert rows <= height


# The screen

Shown = Callable[..., AbstractAsyncContextManager[tuple[Any, TrendScreen, Any]]]


@pytest.fixture
def trend(monkeypatch: pytest.MonkeyPatch) -> Shown:
    @asynccontextmanager
    async def shown(scene: Scene = SCENES["live"], *more: int) -> Any:
        app, screen = panel(scene, monkeypatch)
        for device in more:
            console = fakes.console_of(None, device=device, clock=fakes.StillClock())
            app.fleet.hold(FoundDrive(replace(fakes.ATV71, device=device), console))
        async with app.run_test(size=(80, 24)) as pilot:
            await show(app, screen, scene, pilot)
            yield app, screen, pilot

    return shown


def also_read(app: Any, device: int) -> set[str]:
    """The codes that the monitor of a drive reads for Trend."""
    console = app.fleet.console(device)
    return {code for codes in console.monitor._also for code in codes}


async def test_bands_are_read_while_the_screen_is_open_and_nothing_else(trend: Shown) -> None:
    scene = Scene(bands=[TrendBand(2, "RFR"), TrendBand(2, "ULN"), TrendBand(3, "LCR")])
    async with trend(scene, 3, 4) as (app, _, pilot):
        assert also_read(app, 2) == {"RFR", "FRH", "ULN"}
        assert also_read(app, 3) == {"LCR"}
        assert also_read(app, 4) == set()
        await pilot.press("escape")
        await pilot.pause()
        assert (also_read(app, 2), also_read(app, 3)) == (set(), set())


async def test_chosen_parameter_is_the_band_and_is_remembered(trend: Shown) -> None:
    async with trend() as (app, screen, pilot):
        await pilot.press("down", "enter", *"uln", "enter")
        await pilot.pause()
        assert [trace.band.code for trace in screen.traces] == ["RFR", "ULN", "OTR"]
        assert stored_bands(screen._line_key) == [trace.band for trace in screen.traces]
        assert also_read(app, 2) == {"RFR", "FRH", "ULN", "OTR"}


async def test_band_is_added_below_the_last_one_and_removed_by_none(trend: Shown) -> None:
    async with trend() as (_, screen, pilot):
        await pilot.press("down", "down", "down", "enter", *"uln", "enter")
        await pilot.pause()
        assert [trace.band.code for trace in screen.traces] == ["RFR", "LCR", "OTR", "ULN"]
        await pilot.press("up", "enter", "enter")
        await pilot.pause()
        assert [trace.band.code for trace in screen.traces] == ["RFR", "LCR", "ULN"]


async def test_band_of_another_drive_is_chosen_by_its_address(trend: Shown) -> None:
    async with trend(SCENES["live"], 3) as (app, screen, pilot):
        await pilot.press("colon", "3", "enter")
        await pilot.pause()
        await pilot.press(*"uln", "enter")
        await pilot.pause()
        assert screen.traces[0].band == TrendBand(3, "ULN")
        assert app.chosen.device == 2  # the stop key keeps its target
        assert also_read(app, 3) == {"ULN"}


async def test_event_is_shown_by_enter_with_the_cursor_at_its_time(trend: Shown) -> None:
    async with trend() as (_, screen, pilot):
        await pilot.press("tab", "down", "down", "enter")
        await pilot.pause()
        assert screen.page.cursor == pytest.approx(WALL - 300)
        await pilot.press("escape")
        assert not screen.page.held


async def test_held_curves_do_not_change_and_run_again(trend: Shown) -> None:
    async with trend() as (_, screen, pilot):
        await pilot.press("h")
        assert screen.page.held
        await pilot.press("h")
        assert not screen.page.held


async def test_page_and_marks_are_saved_as_csv_and_svg(trend: Shown, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    def read(_: object, traces: Any, since: float, until: float) -> list[History]:
        found = [point(since + 1, 1.5), point(since + 2, None), point(since + 3, 2.5, since + 13)]
        return [History([item for item in found if item.end <= until]) for _ in traces]

    monkeypatch.setattr("tui.screens.trend.saving.read_traces", read)
    async with trend() as (app, _, pilot):
        await pilot.press("ctrl+s")
        await pilot.pause()
        app.screen.query_one("#answer").value = str(tmp_path / "saved.csv")
        await pilot.press("enter")
        await app.workers.wait_for_complete()
    with (tmp_path / "saved.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["code"] for row in rows[:3]] == [band.code for band in BANDS]
    assert [(row["value"], row["quality"], row["reduced"]) for row in rows[::3]] == [
        ("1.5", "good", "0"), ("", "no reply", "0"), ("2.5", "good", "1"),
    ]  # fmt: skip
    assert rows[0]["utc"].endswith("Z")
    drawing = ElementTree.parse(tmp_path / "saved.svg").getroot()
    assert len(drawing.findall("{*}polyline")) == 6  # a gap parts each of the three curves


def trace_of(points: list[HistoryPoint]) -> Any:
    return SimpleNamespace(band=BANDS[0], entry=None, unit="A", live=None, points=points)


def test_drawing_has_no_line_over_a_time_without_replies() -> None:
    points = [point(at, 1.0) for at in (0, 1, 2, 50, 51)]
    assert svg_text([trace_of(points)], [points], 0, 60).count("<polyline") == 2


def test_saved_values_are_those_of_the_chosen_time() -> None:
    points = [point(at, 1.0) for at in range(10)]
    found = points_of_time(trace_of(points), History(points), 3, 6)
    assert [item.time for item in found] == [3, 4, 5, 6]


def test_table_has_difference_and_slope_from_mark_a_to_mark_b() -> None:
    row = TableRow(
        name="LCR", unit="A", digits=1, now="", at_cursor=False, at_mark=True, cursor=None,
        at_a=None, marks=mark_values([point(0, 3.9), point(18, 3.0)], 0, 18, 30), seconds=18.0,
    )  # fmt: skip
    text = value_table([row], 80, present=False)[1].plain
    assert text.split() == ["LCR", "A", "3.9", "3.0", "-0.9", "-0.050", "3.0", "3.5", "3.9"]


async def test_old_value_has_no_number_at_the_right(trend: Shown) -> None:
    for scene, expected in (("live", "50.0"), ("old", "14s old"), ("failed", "not read: Device 2")):
        async with trend(SCENES[scene]) as (_, screen, _pilot):
            lines = [line.plain for line in screen.query_one("#trend", Lines).lines]
            assert any(expected in line for line in lines)
            assert ("50.0" in lines[1]) is (scene == "live")


def test_events_of_the_panel_itself_are_not_among_those_of_the_drives() -> None:
    recorded = [
        EventRow(1_000_000, 0, None, "line", "lost"),
        EventRow(2_000_000, 0, 3, "stop", "x"),
    ]
    present = [
        Event(4.0, None, "alarm", "The journal cannot be written."),
        Event(5.0, None, "done", "Saved 1 value."),
        Event(6.0, 2, "done", "Run forward"),
        Event(7.0, None, "stop", "Stop all: Space"),
    ]
    found = trend_events(recorded, present, frozenset({2}))
    assert [event.wall for event in found] == [7.0, 6.0, 1.0]
