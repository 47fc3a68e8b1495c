"""Time axis of Trend with its events, marks and clock times; pure functions."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from itertools import groupby
from operator import itemgetter

from rich.text import Text

from tui.widgets.curve import CurveScale
from tui.widgets.palette import CURSOR, FAINT, KEY, LINE

from .contents import AXIS_CELLS, LATEST_CELLS, TrendRoom, TrendView, mark_places, trend_plot
from .event_list import sign_of


def tick_columns(view: TrendView, room: TrendRoom) -> list[tuple[int, float]]:
    """Return the columns of the ticks, with their times."""
    step, plot = view.page.step, trend_plot(view, room, CurveScale(0, 1))
    first = math.ceil(view.start / step.tick - 1e-6) * step.tick
    found = []
    for number in range(round(step.span / step.tick) + 1):
        at = first + number * step.tick
        # a thousandth of a column later, so that rounding errors move no tick
        column = plot.column(at + step.span / room.columns / 1000)
        if column is not None:
            found.append((column, at))
    return found


def trend_axis(view: TrendView, room: TrendRoom) -> list[Text]:
    """Return the time axis with its events and marks, and the clock times."""
    plot = trend_plot(view, room, CurveScale(0, 1))
    until = plot.column(view.page.ends(view.now))
    reached: int = room.columns if until is None else until
    ticks = tick_columns(view, room)
    cells = [("─" if column <= reached else " ", FAINT) for column in range(room.columns)]
    for column, _ in ticks:
        cells[column] = ("┬" if column <= reached else "╷", FAINT)
    names = _clock_times(view, ticks, room.columns)
    if not room.clock:
        cells = [
            (names[column], FAINT) if names[column] != " " else cell
            for column, cell in enumerate(cells)
        ]
    for event in reversed(view.events):
        at = plot.column(event.wall)
        if at is not None and event.wall <= view.page.ends(view.now):
            cells[at] = sign_of(event, view.plain)
    for column, (sign, style) in mark_places(view, room).items():
        cells[column] = sign, style + CURSOR if sign not in "AB" else style
    axis = Text(" " * (AXIS_CELLS - 1), no_wrap=True).append("└", LINE)
    for style, run in groupby(cells, key=itemgetter(1)):
        axis.append("".join(sign for sign, _ in run), style)
    if not room.clock:
        return [axis]
    return [axis, Text(" " * AXIS_CELLS, no_wrap=True).append(names, FAINT)]


def kept_line(view: TrendView, width: int) -> Text:
    """Return the whole record as a bar, with the page in it and the events."""
    if view.oldest is None:
        return Text("  Nothing is recorded of these drives.", FAINT, no_wrap=True)
    begin, end = view.oldest, max(view.now, view.oldest + 1)
    kept = end - begin
    length = f"{kept / 3600:.0f} h" if kept >= 7200 else f"{kept / 60:.0f} min"
    length = length if kept >= 120 else f"{kept:.0f} s"
    first = time.strftime("%m-%d %H:%M", time.localtime(begin))
    line = Text(f"  kept {length}  {first} ", FAINT, no_wrap=True)
    last = time.strftime(" %H:%M", time.localtime(end))
    count = max(1, width - line.cell_len - len(last) - 2)

    def cell(moment: float) -> int:
        return max(0, min(count - 1, int((moment - begin) / (end - begin) * count)))

    cells = [("-" if view.plain else "─", LINE)] * count
    for event in reversed(view.events):
        if begin <= event.wall <= end:
            cells[cell(event.wall)] = sign_of(event, view.plain)
    page = cell(view.start), cell(min(end, view.start + view.page.step.span))
    shown = "=" if view.plain else "━"
    for at in range(page[0], page[1] + 1):
        sign, style = cells[at]
        cells[at] = (shown, CURSOR + KEY) if style is LINE else (sign, style + CURSOR)
    line.append("|" if view.plain else "▕", LINE)
    for style, run in groupby(cells, key=itemgetter(1)):
        line.append("".join(sign for sign, _ in run), style)
    return line.append("|" if view.plain else "▏", LINE).append(last, FAINT)


def _clock_times(view: TrendView, ticks: Sequence[tuple[int, float]], columns: int) -> str:
    """Return the clock times, centered on their ticks; times that overlap are omitted."""
    cells = [" "] * (columns + LATEST_CELLS)
    end = 0
    for column, wall in ticks:
        shown = "%H:%M" if view.page.step.tick >= 60 else "%H:%M:%S"
        text = time.strftime(shown, time.localtime(wall))
        at = column - len(text) // 2
        if at < end or at + len(text) > len(cells):
            continue
        cells[at : at + len(text)] = text
        end = at + len(text) + 1
    return "".join(cells)
