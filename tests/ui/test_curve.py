"""The curve: every sample in its cell, gaps left open, few cells changed, the cursor's reading."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.style import Style
from rich.text import Text

from tui.bus.api import DeviceCounters, LineCounters
from tui.bus.model import LastMinute
from tui.drive.profile import library
from tui.screens.monitor.arrange import arrange
from tui.screens.monitor.assembly import monitor_parts, watched_words
from tui.screens.monitor.curves import clock_text, curve_lines
from tui.screens.monitor.time_axis import MARK_SIGNS
from tui.screens.monitor.time_cursor import TimeCursor
from tui.screens.monitor.view import View
from tui.session.command.stop_report import Phase, StopReport
from tui.session.monitor.trend import TREND_MARKS, TrendMark, TrendPoint
from tui.widgets.curve import (
    ASCII_SIGNS,
    BLOCKS,
    BRAILLE,
    PAGE_STEPS,
    Curve,
    CurveScale,
    CurveSigns,
    PageStep,
    Plot,
    curve_rows,
    page_start,
    round_up,
    sample_at,
    scale_of,
)
from tui.widgets.palette import CURSOR

from . import fakes
from .test_places import view_of

PEN, OTHER = Style(color="#ffffff"), Style(color="#7fb0dc")
FILLED = {chr(0x2800 + code): code for code in range(1, 256)}
BRAILLE_DOTS = {
    1: (0, 3),
    2: (0, 2),
    4: (0, 1),
    8: (1, 3),
    16: (1, 2),
    32: (1, 1),
    64: (0, 0),
    128: (1, 0),
}
"""Column and height from below of each dot of a cell, as Unicode numbers them."""


def lit_dots(rows: list[Text]) -> set[tuple[int, int]]:
    """Dots of braille that are shown, as columns and heights from below."""
    found = set()
    for y, row in enumerate(reversed(rows)):
        for x, character in enumerate(row.plain):
            for dot, (across, up) in BRAILLE_DOTS.items():
                if FILLED.get(character, 0) & dot:
                    found.add((2 * x + across, 4 * y + up))
    return found


def plot_of(columns: int = 30, rows: int = 6, signs: CurveSigns = BRAILLE) -> Plot:
    return Plot(100.0, 60.0, CurveScale(0.0, 60.0, (0.0, 60.0)), columns, rows, signs)


@given(
    st.floats(0, 59.9),
    st.floats(0, 60),
    st.integers(4, 80),
    st.integers(2, 20),
)
def test_sample_lights_the_dot_of_its_time_and_value(
    after: float, value: float, columns: int, rows: int
) -> None:
    plot = plot_of(columns, rows)
    (dot,) = lit_dots(curve_rows([Curve([(100.0 + after, value)], PEN)], plot, 1.5))
    assert dot[0] == int((100.0 + after - 100.0) * 2 * columns / 60)
    assert abs(dot[1] - value / 60 * (4 * rows - 1)) <= 0.5 + 1e-9


@pytest.mark.parametrize("signs", [BRAILLE, BLOCKS, ASCII_SIGNS])
def test_each_kind_of_terminal_shows_the_ends_of_a_ramp(signs: CurveSigns) -> None:
    ramp = [(100.0 + second, float(second)) for second in range(60)]
    rows = [row.plain for row in curve_rows([Curve(ramp, PEN)], plot_of(signs=signs), 1.5)]
    assert [len(row) for row in rows] == [30] * 6
    empty = {" ", signs.grid}
    assert rows[0][-1] not in empty
    assert rows[-1][0] not in empty
    assert set(rows[0][:20]) | set(rows[-1][12:]) <= empty
    assert all(set(row) - empty for row in rows)
    if signs is ASCII_SIGNS:
        assert all(row.isascii() for row in rows)


def test_characters_of_a_plot_without_braille() -> None:
    level = [(100.0 + second, 60.0 if second < 30 else 0.0) for second in range(60)]
    plain = Plot(100.0, 60.0, CurveScale(0, 60), 6, 2, ASCII_SIGNS)
    for signs, shown in ((ASCII_SIGNS, ['"""|  ', "   |__"]), (BLOCKS, ["▀▀▀▄  ", "   █▄▄"])):
        plot = replace(plain, signs=signs)
        assert [row.plain for row in curve_rows([Curve(level, PEN)], plot, 1.5)] == shown


def test_gap_of_a_failed_read_or_a_pause_stays_open() -> None:
    plot = plot_of()
    failed = [(110.0, 30.0), (111.0, None), (112.0, 30.0)]
    assert len(lit_dots(curve_rows([Curve(failed, PEN)], plot, 5.0))) == 2
    paused = [(110.0, 30.0), (120.0, 30.0)]
    assert len(lit_dots(curve_rows([Curve(paused, PEN)], plot, 9.9))) == 2
    joined = lit_dots(curve_rows([Curve(paused, PEN)], plot, 10.0))
    assert joined == {(x, 12) for x in range(10, 21)}


@given(st.lists(st.floats(0, 60), min_size=2, max_size=40))
def test_curve_has_no_hole_while_values_arrive(values: list[float]) -> None:
    """Each column of dots between the first and the last has one that touches its neighbor."""
    samples = [(100.0 + 1.5 * at, value) for at, value in enumerate(values)]
    dots = lit_dots(curve_rows([Curve(samples, PEN)], plot_of(), 1.5))
    columns = {x: sorted(y for at, y in dots if at == x) for x, _ in dots}
    assert sorted(columns) == list(range(min(columns), max(columns) + 1))
    for x, heights in columns.items():
        assert heights == list(range(heights[0], heights[-1] + 1))
        before = columns.get(x - 1)
        if before is not None:
            assert heights[0] - before[-1] <= 1
            assert before[0] - heights[-1] <= 1


def test_reference_holds_until_its_next_value_and_the_output_is_over_it() -> None:
    plot = plot_of()
    reference = Curve([(100.0, 0.0), (110.0, 60.0), (119.0, 60.0)], OTHER, held=True)
    dots = lit_dots(curve_rows([reference], plot, 20.0))
    assert {y for x, y in dots if x < 10} == {0}
    assert {x for x, y in dots if y == 0 and x < 10} == {0, 2, 4, 6, 8}, "dotted"
    assert {y for x, y in dots if x > 10} == {23}
    assert {y for x, y in dots if x == 10} <= set(range(24))
    output = Curve([(102.0, 0.0)], PEN)
    row = curve_rows([output, reference], plot, 20.0)[-1]
    styles = {row.plain[s.start : s.end]: s.style for s in row.spans if s.start <= 1 < s.end}
    assert list(styles.values()) == [PEN]


def changed_cells(before: list[Text], after: list[Text]) -> int:
    """Cells that look different."""
    found = 0
    for old, new in zip(before, after, strict=True):
        size = max(len(old.plain), len(new.plain))
        for at in range(size):
            looks = [
                (text.plain[at : at + 1], [s.style for s in text.spans if s.start <= at < s.end])
                for text in (old, new)
            ]
            found += looks[0] != looks[1]
    return found


ATV71 = library.load("atv71")


def running_view(now: float, seconds: float = 120.0, period: float = 0.5) -> View:
    """A motor whose frequency and current never rest, watched for some time up to now."""
    points = tuple(
        TrendPoint(at, (30 + 20 * math.sin(at / 7), 4 + math.sin(at), 50.0))
        for at in (now - seconds + period * n for n in range(int(seconds / period) + 1))
    )
    view = view_of(ATV71, fakes.RUNNING)
    assert view.snapshot is not None
    return replace(
        view, trend=points, now=now, snapshot=replace(view.snapshot, readings={}, time=now)
    )


@pytest.mark.parametrize(
    ("size", "most"),
    [
        ((80, 24), 6),
        ((120, 40), 9),
        pytest.param((200, 60), 14, marks=pytest.mark.sweep),
    ],
)
def test_new_sample_changes_few_cells_until_the_page_turns(
    size: tuple[int, int], most: int
) -> None:
    room = arrange(*size, 9)
    start, turns = 1000.0, 0
    before = curve_lines(running_view(start), room)
    for cycle in range(1, 61):
        view = running_view(start + cycle / 2)
        after = curve_lines(view, room)
        changed = changed_cells(before, after)
        if changed > most:
            turns += 1
            assert (view.now + view.apart) % view.step.turn < 0.5 + 1e-6, "only a turn changes more"
        before = after
    assert turns in (1, 2), "30 s have one or two turns of 20 s"


def test_same_values_change_no_cell() -> None:
    room, view = arrange(120, 40, 9), running_view(1010.0)
    later = replace(view, now=1010.2)
    assert changed_cells(curve_lines(view, room), curve_lines(later, room)) == 0


@given(st.floats(1e9, 2e9), st.sampled_from(PAGE_STEPS))
def test_now_is_on_the_page_with_most_of_its_time_before_it(now: float, step: PageStep) -> None:
    start = page_start(now, step)
    assert start <= now < start + step.span
    assert now - start >= step.span - step.turn - 1e-3
    assert start % step.turn == pytest.approx((start // step.turn) * 0 + (-step.span) % step.turn)


def test_old_values_are_not_shown_as_the_present_one() -> None:
    room = arrange(80, 24, 9)
    fresh = "\n".join(line.plain for line in curve_lines(view_of(ATV71, fakes.RUNNING), room))
    assert "─50.0" in fresh
    for view in (
        view_of(ATV71, fakes.RUNNING, age=20.0),
        replace(view_of(ATV71, fakes.RUNNING), page=fakes.NOW - 60, cursor=fakes.NOW - 10),
    ):
        assert "─50.0" not in "\n".join(line.plain for line in curve_lines(view, room))


def marked_at(view: View, marks: Mapping[float, str]) -> View:
    """The view with marks at some times; its clock is that of the axis."""
    points = tuple(replace(p, mark=marks.get(p.time, "")) for p in view.trend)
    return replace(view, trend=points, apart=0.0)


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
def test_marks_are_at_their_time_and_explained_only_if_they_occur(size: tuple[int, int]) -> None:
    room, base = arrange(*size, 9), running_view(1000.0)
    assert room.plot >= (9 if size == (80, 24) else 16)
    columns = size[0] - 6 - 7
    for mark in TREND_MARKS:
        sign, _, name = MARK_SIGNS[mark]
        nothing = "\n".join(line.plain for line in curve_lines(marked_at(base, {}), room))
        assert sign not in nothing
        heading, *_, axis, _ = (
            line.plain for line in curve_lines(marked_at(base, {970.0: mark}), room)
        )
        assert axis.index(f"{sign} {name} ") == 6 + int(
            (970.0 - page_start(1000.0, base.step)) / 60 * columns
        )
        assert name not in heading.replace("reference", "", 1), "explained once"


@given(
    st.dictionaries(st.integers(0, 90), st.sampled_from(TREND_MARKS), min_size=1, max_size=12),
    st.sampled_from([(60, 16), (80, 24), (120, 40)]),
)
def test_name_of_a_mark_is_beside_its_own_sign_and_covers_no_other(
    marks: dict[int, TrendMark], size: tuple[int, int]
) -> None:
    room = arrange(*size, 9)
    view = marked_at(running_view(1000.0), {1000.0 - at / 2: mark for at, mark in marks.items()})
    axis = curve_lines(view, room)[-room.axis].plain
    start, columns = page_start(1000.0, view.step), size[0] - 6 - 7
    signs: dict[int, str] = {}
    for at, mark in sorted(marks.items(), key=lambda item: -TREND_MARKS.index(item[1])):
        column = math.floor((1000.0 - at / 2 - start) / 60 * columns)
        if column >= 0:
            signs[6 + column] = MARK_SIGNS[mark][0]
    assert {at: axis[at] for at in signs} == signs
    for mark in TREND_MARKS:
        sign, _, name = MARK_SIGNS[mark]
        if (at := axis.find(f" {name} ")) >= 0:
            assert sign in (axis[at - 1], axis[at + len(name) + 2])


def test_mark_without_room_below_is_explained_above() -> None:
    marks = {1000.0 - at: mark for at, mark in enumerate(TREND_MARKS)}
    heading, *_, axis, _ = curve_lines(marked_at(running_view(1000.0), marks), arrange(120, 40, 9))
    for mark in TREND_MARKS:
        sign, _, name = MARK_SIGNS[mark]
        below = f"{sign} {name} " in axis.plain or f" {name} {sign}" in axis.plain
        assert below != (f"{sign} {name}" in heading.plain)
    assert " trip " in heading.plain


def test_name_of_a_mark_hides_no_clock_time() -> None:
    room = arrange(60, 16, 9)
    assert room.axis == 1
    for before in range(5, 36, 3):
        bare = running_view(1000.0)
        view = marked_at(bare, {1000.0 - before: "write"})
        heading, *_, axis = (line.plain for line in curve_lines(view, room))
        at = axis.index("●")
        times = curve_lines(marked_at(bare, {}), room)[-1].plain
        for time in re.finditer(r"[\d:]+", times):
            if at not in range(*time.span()):
                assert time[0][-2:] in axis
        assert "write" in heading + axis
        view = marked_at(bare, {1000.0 - before: "write", 1000.0 - 2: "start"})
        heading, *_, axis = (line.plain for line in curve_lines(view, room))
        assert "write" in heading + axis
        assert "start" in heading + axis


@pytest.mark.parametrize("size", [(60, 16), (80, 24), (120, 40)])
@pytest.mark.parametrize("raws", [fakes.RUNNING, fakes.REVERSE], ids=["forward", "reverse"])
def test_values_at_the_cursor_are_whole(raws: dict[str, int], size: tuple[int, int]) -> None:
    values = (-599.0, 120.4, -599.0) if raws is fakes.REVERSE else (50.0, 8.4, 50.0)
    view = replace(view_of(ATV71, raws), trend=(TrendPoint(fakes.NOW, values),))
    view = replace(view, page=page_start(fakes.NOW, view.step), cursor=fakes.NOW)
    heading = curve_lines(view, arrange(*size, 9))[0]
    assert heading.cell_len <= size[0]
    assert [word for value in values if (word := f"{value:.1f}") not in heading.plain] == []


def test_extremes_keep_their_distance_from_their_names() -> None:
    points = tuple(TrendPoint(fakes.NOW - at, (-25.0 * at, 8.4, -50.0)) for at in (0, 1))
    view = replace(view_of(ATV71, fakes.REVERSE), trend=points)
    rows = monitor_parts(view, arrange(80, 24, 9), watched_words(ATV71))["readouts"]
    text = "\n".join(row.plain for row in rows)
    assert "min -25.0" in text
    assert "max   0.0" in text


@pytest.mark.parametrize("size", [(60, 16), (80, 24), (120, 40)])
def test_cursor_on_a_mark_names_the_program_that_caused_it(size: tuple[int, int]) -> None:
    room, base = arrange(*size, 9), replace(running_view(1000.0), apart=0.0, me="panel (pid 1)")
    settings = tuple(f"S{number}" for number in range(4))
    for at, mark, by, codes, cause in (
        (950.0, "write", ("run (pid 7)",), ("ACC", "DEC"), "write of ACC, DEC by run (pid 7)"),
        (970.0, "write", ("panel (pid 1)",), settings, "write of 4 settings by this panel"),
        (999.5, "start", ("run (pid 7)",), (), "start after a command of run (pid 7)"),
        (960.0, "stop", ("a", "panel (pid 1)"), (), "stop after a command of a and this panel"),
    ):
        point = TrendPoint(at, (1.0, 1.0, 1.0), mark, by, codes)
        trend = sorted((*base.trend, point), key=lambda item: item.time)
        view = replace(base, trend=tuple(trend), page=page_start(at, base.step), cursor=at)
        rows = curve_lines(view, room)
        assert f" {cause} " in rows[-1].plain
        assert rows[-1].cell_len <= size[0]
        other = curve_lines(replace(view, cursor=at - 5.0), room)[-1].plain
        assert by[0] not in other


def test_low_bandwidth_refresh_at_rest_changes_only_the_curve() -> None:
    """Counts of answers, seconds of the extremes and the end of the axis would always change."""
    room, base = arrange(80, 24, 9, lean=True), view_of(ATV71, fakes.RUNNING)
    rows = []
    for good in (100, 180):
        point = TrendPoint(fakes.NOW - 3 + good / 100, (50.0, 8.4, 50.0))
        counts = DeviceCounters(minute=LastMinute(good=good))
        view = replace(base, counters=LineCounters(devices={base.device: counts}), lean=True)
        view = replace(view, trend=(TrendPoint(fakes.NOW - 10, (50.0, 8.4, 50.0)), point))
        rows.append(monitor_parts(view, room, watched_words(ATV71)))
    assert {place for place in rows[0] if rows[0][place] != rows[1][place]} == {"curve"}
    assert "100 % in 60 s" in rows[0]["state"][-1].plain
    early, late = (replace(running_view(now, 30.0), lean=True) for now in (1001.0, 1003.0))
    assert curve_lines(early, room)[-2:] == curve_lines(late, room)[-2:]


def test_axis_grows_with_the_curve_and_to_now_without_new_values() -> None:
    """Otherwise each of them would be sent with a color and places of its own."""
    room, view = arrange(80, 24, 9), running_view(1000.0, 30.0)
    ends = {
        late: curve_lines(replace(view, now=1000.0 + late), room)[-2].plain.rstrip()
        for late in (0.0, 0.4, 2.0)
    }
    assert ends[0.0] == ends[0.4]
    assert ends[2.0].count("─") == ends[0.0].count("─") + 2


def test_low_bandwidth_link_gets_no_grid() -> None:
    room, view = arrange(80, 24, 9), running_view(1000.0, 30.0)
    slow = replace(view, lean=True)
    dots = [sum(line.plain.count("·") for line in curve_lines(v, room)) for v in (view, slow)]
    assert dots[0] > 50
    assert dots[1] == 0


def test_low_bandwidth_link_gets_marks_on_the_axis_only_and_no_reference() -> None:
    """Lines, names and a second curve would be sent again when the page turns."""
    room, base = arrange(80, 24, 9, lean=True), running_view(1000.0, 30.0)
    trend = (*base.trend[:-1], replace(base.trend[-1], mark="trip"))
    usual, slow = (
        curve_lines(replace(base, trend=trend, lean=lean), room) for lean in (False, True)
    )
    assert sum("┆" in row.plain for row in usual) == room.plot - 2
    assert not any("┆" in row.plain for row in slow)
    assert "■ trip" in usual[-2].plain
    assert "■ trip" not in slow[-2].plain
    assert "■" in slow[-2].plain
    assert "■ trip" in slow[0].plain
    assert "reference" in usual[0].plain
    assert "reference" not in slow[0].plain


def test_heading_of_a_low_bandwidth_link_has_room_for_the_names_of_few_marks() -> None:
    for width in (60, 80, 120):
        room, base = arrange(width, 24, 9, lean=True), running_view(1000.0, 30.0)
        for count in range(1, width // 24 + 1):
            marks = dict(zip(range(0, 60, 8), TREND_MARKS[-count:], strict=False))
            points = [replace(p, mark=marks.get(n, "")) for n, p in enumerate(base.trend)]
            rows = curve_lines(replace(base, trend=tuple(points), lean=True), room)
            text = "\n".join(row.plain for row in rows)
            assert [name for name in marks.values() if MARK_SIGNS[name][2] not in text] == []


def test_state_is_drawn_alone_before_the_first_values() -> None:
    """On a slow link, frames of nothing would delay them."""
    room, base = arrange(80, 24, 9), view_of(ATV71, fakes.RUNNING)
    waiting = replace(base, snapshot=None)
    drawn = {
        place: [row.plain.strip() for row in rows if row.plain.strip()]
        for place, rows in monitor_parts(waiting, room, watched_words(ATV71)).items()
    }
    assert drawn.pop("state") == ["waiting for values"]
    assert not any(drawn.values())
    stopped = replace(waiting, stop=StopReport(1, Phase.FAILED, "no answer.", 0.0, 0.0))
    rows = monitor_parts(stopped, room, watched_words(ATV71))["state"]
    assert any("no answer" in row.plain for row in rows)


def test_no_axis_is_drawn_before_the_first_value() -> None:
    """Its scale would be of nothing, and on a slow link it would delay the values."""
    room, view = arrange(80, 24, 9), running_view(1000.0, 30.0)
    nothing = tuple(replace(point, values=(None, None, None)) for point in view.trend)
    for trend in ((), nothing):
        heading, *rest = curve_lines(replace(view, trend=trend), room)
        assert "output" in heading.plain
        assert len(rest) == room.curve - 1
        assert not any(rest)


def test_mark_without_a_known_cause_claims_none() -> None:
    view = marked_at(running_view(1000.0), {970.0: "start"})
    room = arrange(80, 24, 9)
    at_mark = curve_lines(replace(view, page=view.page_start, cursor=970.0), room)[-1].plain
    assert at_mark == curve_lines(view, room)[-1].plain


def test_most_urgent_of_several_marks_in_a_cell_is_shown() -> None:
    marks = {990.0: "reference", 990.5: "trip", 995.0: "unknown to us"}
    axis = curve_lines(marked_at(running_view(1000.0), marks), arrange(60, 16, 9))[-1].plain
    assert "■" in axis
    assert "◆" not in axis


def test_clock_times_are_below_their_ticks() -> None:
    view = replace(view_of(ATV71, fakes.RUNNING), apart=fakes.StillClock().wall_of(0.0))
    *_, axis, times = curve_lines(view, arrange(80, 24, 9))
    text = clock_text(view.now + view.apart)
    # the page ends at the next full 20 s; a tick every 10 s
    seconds = int(text[6:8])
    last = (seconds // 10) * 10
    assert f"{text[:6]}{last:02}" in times.plain
    ticks = [at for at, sign in enumerate(axis.plain) if sign in "┬╷"]
    assert {b - a for a, b in pairwise(ticks)} <= {11, 12}
    middle = times.plain.index(f"{text[:6]}{last:02}") + 4
    assert middle in ticks


@given(st.lists(st.floats(0, 100), min_size=1, max_size=30), st.floats(0, 110), st.floats(0.1, 20))
def test_cursor_reads_the_last_sample_before_it(
    times: list[float], moment: float, reach: float
) -> None:
    samples = [(time, float(at)) for at, time in enumerate(sorted(times))]
    expected = None
    for time, value in samples:
        if time <= moment and moment - time <= reach:
            expected = (time, value)
    assert sample_at(samples, moment, reach) == expected


def test_cursor_shows_values_of_its_moment_and_none_in_a_gap() -> None:
    points = tuple(
        TrendPoint(940.0 + at, (float(at), at / 10, 50.0) if at < 30 or at > 40 else (None,) * 3)
        for at in range(60)
    )
    view = replace(view_of(ATV71, fakes.RUNNING), trend=points, period=1.0, apart=0.0)
    view = replace(view, page=940.0, cursor=950.4)
    assert view.snapshot is not None
    view = replace(view, snapshot=replace(view.snapshot, rate=1.0))
    heading = curve_lines(view, arrange(120, 40, 9))[0].plain.split()
    assert heading[0].endswith(":50.0")
    assert heading[1:9] == ["output", "10.0", "Hz", "current", "1.0", "A", "reference", "50.0"]
    gap = curve_lines(replace(view, cursor=975.0), arrange(120, 40, 9))[0].plain.split()
    assert gap[1:9] == ["output", "-----", "Hz", "current", "-----", "A", "reference", "-----"]


@pytest.mark.parametrize(("after", "text"), [(2.9, "29.0"), (3.1, "-----")])
def test_value_at_the_cursor_is_at_most_three_cycles_old(after: float, text: str) -> None:
    points = tuple(TrendPoint(940.0 + at, (float(at), 1.0, 50.0)) for at in range(30))
    view = replace(view_of(ATV71, fakes.RUNNING), trend=points, period=1.0, apart=0.0)
    view = replace(view, page=940.0, cursor=969.0 + after)
    assert view.snapshot is not None
    view = replace(view, snapshot=replace(view.snapshot, rate=1.0))
    heading = curve_lines(view, arrange(120, 40, 9))[0].plain.split()
    assert heading[1:3] == ["output", text]


def test_cell_under_the_cursor_is_marked_in_every_row() -> None:
    rows = curve_rows([Curve([(130.0, 30.0)], PEN)], plot_of(), 1.5, cursor=15)
    for row in rows:
        (style,) = [s.style for s in row.spans if s.start <= 15 < s.end]
        assert isinstance(style, Style)
        assert style.bgcolor == CURSOR.bgcolor


def test_cursor_moves_by_a_column_turns_the_page_and_stays_within_the_samples() -> None:
    cursor = TimeCursor().opened(1000.0, 0.0)
    assert cursor.page == page_start(1000.0, PAGE_STEPS[2])
    left = cursor.moved(-1, 60, 500.0, 1000.0)
    assert left.moment is not None
    assert math.floor(left.moment) == 999
    assert left.page == cursor.page
    far = left.moved(-100, 60, 500.0, 1000.0)
    assert far.moment is not None
    assert far.page is not None
    assert math.floor(far.moment) == 899
    assert far.page <= far.moment < far.page + 60
    assert far.moved(-9999, 60, 500.0, 1000.0).moment == 500.0
    assert far.moved(9999, 60, 500.0, 1000.0).moment == 1000.0
    assert cursor.closed() == TimeCursor()
    assert cursor.with_span(1) == TimeCursor(PAGE_STEPS[3])
    assert TimeCursor().with_span(-9).step.span == 10
    assert TimeCursor().with_span(9).step.span == 600


@given(st.floats(1e-3, 1e5))
def test_axis_ends_at_a_round_number(value: float) -> None:
    top = round_up(value)
    assert value <= top * (1 + 1e-6)
    assert top <= 1.34 * value


@pytest.mark.parametrize(
    ("low", "high", "rows", "labels"),
    [
        (0, 60, 9, (0, 15, 30, 45, 60)),
        (0, 60, 16, (0, 15, 30, 45, 60)),
        (-60, 60, 9, (-60, -30, 0, 30, 60)),
        (0, 12, 5, (0, 6, 12)),
        (0, 50, 3, (0, 50)),
    ],
)
def test_labels_of_an_axis_are_round(
    low: float, high: float, rows: int, labels: tuple[float, ...]
) -> None:
    assert scale_of(low, high, rows).labels == labels
