"""Time axis below the curves: page of time, clock times, marks of events and their names."""

from __future__ import annotations

import math
import time
from bisect import bisect_left
from collections.abc import Mapping, Sequence, Set
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.drive.sentences import all_of
from tui.session.monitor.trend import TREND_MARKS, TrendMark, TrendPoint
from tui.widgets.curve import CurveScale, Plot
from tui.widgets.drawing import short
from tui.widgets.palette import (
    ALARM,
    ATTENTION,
    CURSOR,
    FAINT,
    FAULT,
    KEY,
    LINE,
    PLAIN,
    REFERENCE_STYLE,
    RUNNING,
    STRONG,
)

from .view import View

LABEL_CELLS = 5
MARGIN_CELLS = 7
"""Cells at the right of a curve for the latest value."""
MARK_SIGNS: dict[TrendMark, tuple[str, Style, str]] = {
    "lost": ("×", ALARM, "no answer"),
    "trip": ("■", FAULT, "trip"),
    "stop": ("▼", STRONG, "stop"),
    "start": ("▶", RUNNING, "start"),
    "reset": ("↑", STRONG, "reset"),
    "write": ("●", ATTENTION, "write"),
    "reference": ("◆", REFERENCE_STYLE, "reference"),
}
"""Sign, style and name of each mark."""
THIS_PANEL = "this panel"
MOST_NAMED_CODES = 3
"""Most settings of one write that are named."""


class ShownPage(NamedTuple):
    """Displayed page of time, with the data that its parts share."""

    view: View
    points: Sequence[TrendPoint]
    """Points of the page, and one beyond each edge."""
    columns: int
    marks: dict[int, TrendMark]

    def plot(self, rows: int, scale: CurveScale) -> Plot:
        """Return a plot of the page with `rows` rows and a vertical scale."""
        return plot_of(self.view, self.columns, rows, scale)


def plot_of(view: View, columns: int, rows: int, scale: CurveScale) -> Plot:
    return Plot(view.page_start, view.step.span, scale, columns, rows, view.signs)


def points_of_page(view: View) -> Sequence[TrendPoint]:
    """Return the points of the page, and one beyond each edge."""
    start = view.page_start
    first = bisect_left(view.trend, start, key=_time)
    end = bisect_left(view.trend, start + view.step.span, key=_time)
    return view.trend[max(0, first - 1) : end + 1]


def _time(point: TrendPoint) -> float:
    return point.time


def marks_on_page(view: View, points: Sequence[TrendPoint], columns: int) -> dict[int, TrendMark]:
    """Return the most urgent mark of each column of the page."""
    plot = plot_of(view, columns, 1, CurveScale(0, 1))
    found: dict[int, TrendMark] = {}
    for point in points:
        mark = point.mark and next((item for item in TREND_MARKS if item == point.mark), None)
        if not mark or (column := plot.column(point.time)) is None:
            continue
        before = found.get(column)
        if before is None or TREND_MARKS.index(mark) < TREND_MARKS.index(before):
            found[column] = mark
    return found


def ticks_of(page: ShownPage) -> list[tuple[int, float]]:
    """Return the columns of the ticks, with their time of day in seconds since 1970."""
    view, plot = page.view, page.plot(1, CurveScale(0, 1))
    tick = view.step.tick
    first = math.ceil((plot.start + view.apart) / tick - 1e-6) * tick
    found = []
    for number in range(round(view.step.span / tick) + 1):
        wall = first + number * tick
        # a thousandth of a column later, so that rounding errors move no tick
        column = plot.column(wall - view.apart + view.step.span / page.columns / 1000)
        if column is not None:
            found.append((column, wall))
    return found


class MarkName(NamedTuple):
    """Name of a mark on the time axis, next to one of its signs, with its first column."""

    column: int
    text: str


def mark_names(page: ShownPage, *, on_axis: bool) -> dict[TrendMark, MarkName]:
    """Return the name of each mark, at the first of its signs that has room for it.

    A name never covers a sign, nor a clock time that is `on_axis` with the marks.
    """
    times = clock_times(page, page.marks.keys()) if on_axis else " " * (page.columns + MARGIN_CELLS)
    taken = [cell != " " for cell in times]
    for column in page.marks:
        taken[column] = True
    found: dict[TrendMark, MarkName] = {}
    for column, mark in sorted(page.marks.items()):
        text = f" {MARK_SIGNS[mark][2]} "
        for at in (column + 1, column - len(text)):
            end = at + len(text)
            if mark in found or at < 0 or end > len(taken) or any(taken[at:end]):
                continue
            found[mark] = MarkName(at, text)
            taken[at:end] = [True] * len(text)
    return found


def axis_lines(page: ShownPage, rows: int, names: Mapping[TrendMark, MarkName]) -> list[Text]:
    """Return the time axis up to its end with its marks, and the clock times below or on it.

    On a low-bandwidth link the axis is complete: its end would move with each refresh.
    """
    view, columns, plot = page.view, page.columns, page.plot(1, CurveScale(0, 1))
    ticks = ticks_of(page)
    end_time = axis_end(view)
    reached = plot.column(end_time) if end_time < plot.end and not view.lean else columns
    reached = -1 if reached is None else reached
    cells = [("─" if column <= reached else " ", FAINT) for column in range(columns)]
    end = max((name.column + len(name.text) for name in names.values()), default=0)
    cells += [(" ", FAINT)] * (end - columns)
    for column, _ in ticks:
        cells[column] = ("┬", FAINT) if column <= reached else ("╷", LINE)
    times = clock_times(page, page.marks.keys() if rows == 1 else set())
    if rows == 1:
        cells = [
            (times[column], FAINT) if times[column] != " " else cell
            for column, cell in enumerate(cells)
        ]
    for name in names.values():
        for column, character in enumerate(name.text, name.column):
            cells[column] = (character, FAINT)
    for column, mark in page.marks.items():
        cells[column] = MARK_SIGNS[mark][:2]
    if (at := _cursor_column(page)) is not None:
        cells[at] = (cells[at][0] if cells[at][0] != " " else "┴", KEY + CURSOR)
    axis = Text(" " * LABEL_CELLS, no_wrap=True).append("└", LINE)
    for style, run in groupby(cells, key=itemgetter(1)):
        axis.append("".join(character for character, _ in run), style)
    if rows == 1:
        return [_with_cause(page, axis)]
    below = Text(" " * (LABEL_CELLS + 1), no_wrap=True).append(times, FAINT)
    return [axis, _with_cause(page, below)]


def axis_end(view: View) -> float:
    """Return the time up to which the axis is drawn: of the newest value, or now if that is old.

    So the axis and the curve grow in one output.
    """
    newest = view.trend[-1].time if view.trend else -math.inf
    return newest if view.now - newest < AXIS_BEHIND else view.now


def _with_cause(page: ShownPage, line: Text) -> Text:
    """Return the line with the cause of the mark under the cursor, if it is known."""
    at = _cursor_column(page)
    text = _cause(page, at) if at is not None and at in page.marks else ""
    if not text or at is None:
        return line
    width = LABEL_CELLS + 1 + page.columns + MARGIN_CELLS
    text = f" {short(text, width - 2)} "
    start = max(0, min(LABEL_CELLS + at, width - len(text)))
    line.append(" " * (width - line.cell_len))
    return Text.assemble(line[:start], (text, PLAIN), line[start + len(text) :], no_wrap=True)


def _cursor_column(page: ShownPage) -> int | None:
    view = page.view
    return None if view.cursor is None else page.plot(1, CurveScale(0, 1)).column(view.cursor)


def _cause(page: ShownPage, column: int) -> str:
    """Return the name of the mark in a column, and the programs that may have caused it."""
    mark, plot = page.marks[column], page.plot(1, CurveScale(0, 1))
    found = (p for p in page.points if p.mark == mark and plot.column(p.time) == column)
    point = next(found)
    programs = [THIS_PANEL if by == page.view.me else by for by in point.by]
    if not programs:
        return ""
    by, name = all_of(programs), MARK_SIGNS[mark][2]
    if mark != "write":
        return f"{name} after a command of {by}"
    codes = point.codes
    settings = f"{len(codes)} settings" if len(codes) > MOST_NAMED_CODES else ", ".join(codes)
    return f"{name} of {settings} by {by}"


AXIS_BEHIND = 0.5
"""Seconds that the axis may end before now."""
FULL_CELLS = 10
"""Least columns between two ticks for clock times in full."""


def clock_times(page: ShownPage, covered: Set[int]) -> str:
    """Return the row of clock times, centered on their ticks.

    Times that overlap are omitted, and those in a `covered` column.
    """
    columns, step = page.columns, page.view.step
    cells = [" "] * (columns + MARGIN_CELLS)
    apart = columns * step.tick / step.span
    end = 0
    whole = False
    for column, wall in ticks_of(page):
        clock = time.localtime(wall)
        text = time.strftime("%H:%M:%S", clock)
        if step.tick >= 60:
            text = text[:5]
        elif apart < FULL_CELLS and (whole or column + 4 < 8) and clock.tm_sec:
            text = text[5:]
        at = column - len(text) // 2
        if at < end or at + len(text) > len(cells):
            continue
        if not covered.isdisjoint(range(at, at + len(text))):
            continue
        whole = whole or len(text) == 8
        cells[at : at + len(text)] = text
        end = at + len(text) + 1
    return "".join(cells)
