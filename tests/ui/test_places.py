"""Nothing on the Monitor screen moves when values change, whatever the drive and its values."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.text import Text

from tui.bus.line import Frame
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.values import type_range
from tui.screens.frames.screen import frame_line
from tui.screens.keys.table import CONNECTION, EVERYWHERE, MONITOR, keys_line, of_screen
from tui.screens.monitor.commands import order_keys
from tui.screens.monitor.motor import motor_lines
from tui.screens.monitor.state import (
    header,
    history_lines,
    line_lines,
    message_lines,
    panel_lines,
    state_lines,
)
from tui.screens.monitor.trends import stacked_trends, trend_lines
from tui.screens.monitor.view import View
from tui.screens.monitor.words import bit_lines, word_pages
from tui.session.monitor.trend import TrendPoint
from tui.session.reading import Quality
from tui.widgets.drawing import aligned, bar, key_line, trend
from tui.widgets.palette import STOP_KEY

from . import fakes

PROFILES = [listing.id for listing in library.listings()]
WIDTHS = st.sampled_from([47, 48, 85])


def view_of(profile: Profile, raws: dict[str, int], age: float = 0.1) -> View:
    snapshot = fakes.snapshot_of(profile, raws, age=age)
    line = fakes.StillLine()
    return View(
        profile=profile,
        identity=fakes.ATV71,
        device=2,
        line_label="serial:/dev/ttyUSB0,19200,8E1",
        snapshot=snapshot,
        line=line.state,
        counters=line.counters,
        load=0.5,
        trend=tuple(TrendPoint(fakes.NOW - i, (i * 1.0, None)) for i in range(60, 0, -1)),
        period=0.5,
        now=fakes.NOW,
        clock="14:02:11",
    )


@st.composite
def any_raws(draw: st.DrawFn, profile: Profile) -> dict[str, int]:
    """Raw values for all that Monitor shows, each anywhere in its type."""
    codes = {value.parameter for value in profile.data.monitoring.values}
    codes |= {value.high for value in profile.data.monitoring.values if profile.get(value.high)}
    codes |= set(profile.data.faults.history)
    for code in list(codes):
        scale = profile[code].scale_by
        codes |= {scale.parameter} if scale else set()
    return {
        code: draw(st.integers(*type_range(profile[code])))
        for code in sorted(codes)
        if draw(st.integers(0, 9))
    }


def all_lines(view: View, width: int) -> dict[str, list[Text]]:
    words = [p for v in view.values if (p := view.profile[v.parameter]).bits]
    pages = word_pages(words, 12)
    return {
        "header": header(view, width),
        "state": state_lines(view, width),
        "motor": motor_lines(view, width, 30),
        "messages": message_lines(view, width),
        "status": panel_lines(view, width),
        "history": history_lines(view, width, 10),
        "line": line_lines(view, width, 10),
        "trend": trend_lines(view, width, 6),
        "stacked": stacked_trends(view, width, 12),
        "words": [line for page in pages for line in bit_lines(view, page, width)],
    }


@pytest.mark.parametrize("profile_id", PROFILES)
@settings(max_examples=40)
@given(data=st.data())
def test_every_part_keeps_its_size_and_its_width(profile_id: str, data: st.DataObject) -> None:
    profile = library.load(profile_id)
    width = data.draw(WIDTHS)
    first = all_lines(view_of(profile, data.draw(any_raws(profile))), width)
    second = all_lines(view_of(profile, data.draw(any_raws(profile)), age=20.0), width)
    for part, lines in first.items():
        assert len(lines) == len(second[part]), part
        for line in (*lines, *second[part]):
            assert line.cell_len <= width, (part, line.plain)


@pytest.mark.parametrize("profile_id", PROFILES)
@settings(max_examples=40)
@given(data=st.data())
def test_numbers_end_and_units_begin_at_one_place(profile_id: str, data: st.DataObject) -> None:
    """Spans of a measurement: its name, its number, its unit."""
    profile = library.load(profile_id)
    rows = [motor_lines(view_of(profile, data.draw(any_raws(profile))), 48, 30) for _ in range(2)]
    places = {(line.spans[0].end, line.spans[1].end) for lines in rows for line in measured(lines)}
    assert len({number for _, number in places}) <= 1
    assert len({name for name, _ in places}) <= 1


def measured(lines: list[Text]) -> list[Text]:
    """The lines that show a value, by the spans that they are made of: name, number, unit."""
    return [line for line in lines[1:] if len(line.spans) >= 3]


@given(st.decimals(-(10**6), 10**6, places=2), st.integers(0, 2))
def test_decimal_points_are_below_each_other(number: object, places: int) -> None:
    text = f"{number:.{places}f}"
    shown = aligned(text, 8, 2)
    assert len(shown) == 11
    assert shown.strip() == text
    assert (shown.index(".") == 8) if places else shown.endswith("   ")


@given(
    st.floats(-1e4, 1e4),
    st.floats(-200, 0),
    st.floats(1, 200),
    st.integers(4, 60),
    st.none() | st.floats(-1e4, 1e4),
)
def test_a_bar_has_its_width_whatever_its_value(
    value: float, low: float, high: float, width: int, mark: float | None
) -> None:
    drawn = bar(value, low, high, width, mark)
    assert drawn.cell_len == width
    assert drawn.plain.count("│") == (mark is not None)


@given(
    st.lists(st.none() | st.floats(-500, 500), max_size=100),
    st.integers(1, 80),
    st.integers(1, 12),
)
def test_a_trend_has_its_size_whatever_its_values(
    points: list[float | None], width: int, height: int
) -> None:
    rows = trend(points, 60.0, width, height)
    assert [row.cell_len for row in rows] == [width] * height


def keys_shown(screen: str, width: int, stops: str = "STOP") -> Text:
    """The line of keys of a screen, as it draws it; `stops` says whom the stop key stops."""
    keys = keys_line(screen, width, stops)
    profile = library.load("atv71")
    return (
        order_keys(view_of(profile, fakes.RUNNING), keys) if screen == MONITOR else key_line(keys)
    )


@pytest.mark.parametrize("screen", EVERYWHERE)
@given(width=st.integers(30, 200))
def test_the_stop_comes_first_in_red_and_is_never_cut_off(screen: str, width: int) -> None:
    line = keys_shown(screen, width)
    assert line.cell_len <= width
    assert line.plain.startswith(" Space STOP  ")
    assert "? help" in line.plain
    red = [line.plain[s.start : s.end] for s in line.spans if s.style == STOP_KEY]
    assert red == ["Space", " STOP"]


@pytest.mark.parametrize("screen", EVERYWHERE)
def test_no_key_is_dropped_at_80_columns(screen: str) -> None:
    whom = "ALL" if screen == CONNECTION else "99"
    line = keys_shown(screen, 80, f"STOP {whom}").plain
    assert line.startswith(f" Space STOP {whom}  ")
    labels = [action for action in of_screen(screen) if action.label][1:]
    wanted = [f" {action.shown} {action.label}" for action in labels]
    assert [words for words in wanted if words not in line] == []


@given(
    data=st.binary(max_size=300),
    note=st.sampled_from(["", "exception 2", "checksum wrong"]),
    width=st.integers(60, 200),
)
def test_a_frame_fits_its_line_and_keeps_its_note(data: bytes, note: str, width: int) -> None:
    line = frame_line(Frame(0.0, "in", data, note), 3.0, width)
    assert line.cell_len <= width
    assert line.plain.endswith(note)
    assert ("…" in line.plain) == (data.hex(" ").upper() not in line.plain)


def test_a_value_older_than_three_cycles_is_dimmed_with_its_age() -> None:
    profile = library.load("atv71")
    view = view_of(profile, fakes.RUNNING, age=7.0)
    reading = view.reading("RFR")
    assert reading is not None
    assert reading.quality is Quality.STALE
    row = next(line for line in motor_lines(view, 48, 30) if "Output" in line.plain)
    assert "7s" in row.plain
    assert "Hz" not in row.plain
