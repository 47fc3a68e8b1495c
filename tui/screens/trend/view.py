"""Trend as lines: bands of curves over one time axis, a table of values, events; pure functions."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from itertools import groupby
from operator import itemgetter

from rich.text import Text

from tui.drive.values import Value
from tui.session.record.decoding import HistoryPoint
from tui.widgets.curve import (
    Curve,
    CurveScale,
    Samples,
    curve_rows,
    round_up,
)
from tui.widgets.drawing import short
from tui.widgets.palette import (
    ALARM_BLOCK,
    ATTENTION,
    FAINT,
    KEY,
    LINE,
    REFERENCE_STYLE,
    STALE,
    STRONG,
    age_text,
)

from .axis import kept_line, tick_columns, trend_axis
from .contents import (
    AXIS_CELLS,
    LATEST_CELLS,
    BandView,
    TrendRoom,
    TrendView,
    clock_of,
    mark_places,
    trend_plot,
)
from .event_list import event_line, events_lines
from .table import point_text, value_table

EVENTS_FROM, EVENTS_CELLS = 110, 31
"""Least width of a terminal with events at the right, and their cells."""
LEAST_EVENT_ROWS = 3
"""Least rows of the events below the curves, with their heading."""
KEYS_FROM = 24
"""Rows at the right from which the keys are listed below the events."""
TREND_KEYS = (
    ("Tab", "Tab", "to the events"),
    ("← →", "Left Rt", "cursor"),
    ("M", "M", "mark A, then B"),
    ("< >", "< >", "10 s to 24 h"),
    ("h", "h", "hold, let run"),
    ("PgUp Dn", "PgUp Dn", "earlier, later"),
    ("Home", "Home", "oldest"),
    ("End", "End", "now"),
    ("↑ ↓", "Up Down", "band"),
    ("Enter", "Enter", "choose its value"),
    ("^s", "^s", "save CSV and SVG"),
)
"""Keys, as they are named in ASCII too, and what they do."""
LEAST_BAND_ROWS = 2
"""Rows of a curve, before anything else is left out."""
REFERENCE_CELLS = 24
"""Cells that the name of a reference needs in a heading."""
NO_BANDS = "No band. Press Enter to choose a parameter."


def trend_room(width: int, height: int, bands: int, *, events: bool) -> TrendRoom:
    """Return the rows of the parts; the curves shrink first, then parts are left out."""
    bands = max(1, bands)
    side = width >= EVENTS_FROM
    columns = width - AXIS_CELLS - LATEST_CELLS - (EVENTS_CELLS if side else 0)
    heads = bands + 1
    rest = {"table": bands + 1, "clock": 1, "marks": 1, "line": 0 if side else 1}
    if side:
        rest["kept"] = 1
    if events and not side:
        least = max(LEAST_EVENT_ROWS, min(bands + 3, height - heads - bands))
        rest = {"events": least, "clock": 1}
    for part in ("", "kept", "line", "marks", "clock", "table"):
        rest.pop(part, None)
        rows = (height - heads - sum(rest.values())) // bands
        if rows >= LEAST_BAND_ROWS:
            break
    spare = height - heads - sum(rest.values()) - rows * bands
    listed = rest.get("events", 0)
    for part in ("clock", "marks", "line", "kept"):
        if spare > 0 and part not in rest and not listed and not (part == "line" and side):
            rest[part] = 1
            spare -= 1
    return TrendRoom(
        columns, max(1, rows), "clock" in rest, "table" in rest, "marks" in rest,
        bool(rest.get("line")), "kept" in rest, listed + spare if listed else 0, side,
    )  # fmt: skip


def trend_rows(view: TrendView, width: int, height: int) -> list[Text]:
    """Return the lines of the screen, at most `height`."""
    if not view.bands:
        return [Text(f"  {NO_BANDS}", FAINT)]
    room = trend_room(width, height, len(view.bands), events=view.event is not None)
    lines = []
    for number, band in enumerate(view.bands):
        lines.append(_heading(view, band, number, room))
        lines += _band_rows(view, band, room)
    lines += trend_axis(view, room)
    if room.kept:
        lines.append(kept_line(view, AXIS_CELLS + room.columns + LATEST_CELLS))
    if room.side:
        lines = _with_side(view, lines, room)
    if room.table:
        lines += value_table([band.row for band in view.bands], width, present=not view.lean)
    if room.marks:
        lines.append(_marks_line(view))
    if room.events:
        lines += events_lines(view.events, view.event, room.events, width, view.now, view.plain)
    elif room.line:
        lines.append(event_line(view.events, view.page.cursor, width, view.now, view.plain))
    return lines[:height]


def _with_side(view: TrendView, lines: list[Text], room: TrendRoom) -> list[Text]:
    """Return the lines with the events at their right."""
    keys = key_lines(view.plain) if len(lines) >= KEYS_FROM else []
    rows = len(lines) - len(keys)
    events = events_lines(view.events, view.event, rows, EVENTS_CELLS - 2, view.now, view.plain)
    events += keys
    width = AXIS_CELLS + room.columns + LATEST_CELLS
    found = []
    for place, line in enumerate(lines):
        whole = line.copy()
        whole.append(" " * max(0, width - whole.cell_len))
        whole.append("│ ", LINE)
        if place < len(events):
            whole.append_text(events[place])
        found.append(whole)
    return found


def key_lines(plain: bool) -> list[Text]:
    """Return the list of keys, after an empty line."""
    found = [Text("")]
    for drawn, in_ascii, text in TREND_KEYS:
        line = Text(no_wrap=True).append(f"{in_ascii if plain else drawn:<8}", KEY)
        found.append(line.append(text, FAINT))
    return found


def samples_of_points(points: Sequence[HistoryPoint], until: float) -> Samples:
    """Return the samples of a curve: of a reduced point its extent, then its mean."""
    samples: list[tuple[float, float | None]] = []
    for point in points:
        if point.time > until:
            break
        if point.least is None or not point.reduced:
            samples.append((point.time, point.mean))
            continue
        middle = (point.time + point.end) / 2
        mean = point.most if point.mean is None else point.mean
        samples += [(middle, point.least), (middle, point.most), (middle, mean)]
    return samples


def scale_for(
    points: Sequence[HistoryPoint],
    before: tuple[float, float] | None,
    present: float | None = None,
) -> tuple[float, float]:
    """Return the ends of an axis that includes all points, and `before`, so that it rarely changes.

    It begins at 0, or is symmetric; if all values are far from 0, it is around them.
    """
    least = min((point.least for point in points if point.least is not None), default=None)
    most = max((point.most for point in points if point.most is not None), default=None)
    if present is not None:
        least = present if least is None else min(least, present)
        most = present if most is None else max(most, present)
    if least is None or most is None:
        return before or (0.0, 1.0)
    if before is not None and before[0] <= least and most <= before[1]:
        return before
    if least > 0 and most - least < least / 2 and least > 1:
        step = round_up(max(most - least, most / 50) / 2)
        low = math.floor(least / step - 0.2) * step
        return low, max(low + 2 * step, math.ceil(most / step + 0.2) * step)
    high = round_up(max(most, -least))
    return (-high if least < 0 else 0.0), high


def _labels(low: float, high: float, rows: int) -> tuple[float, ...]:
    """Return the values with a label: the ends, and the middle if there is a row for it."""
    return (low, (low + high) / 2, high) if rows >= 3 else (low, high)


def _band_rows(view: TrendView, band: BandView, room: TrendRoom) -> list[Text]:
    low, high = band.scale
    plot = trend_plot(view, room, CurveScale(low, high, _labels(low, high, room.rows)))
    end = view.page.ends(view.now)
    samples = samples_of_points(band.points, end)
    curves = [Curve(samples, FAINT if band.trouble else STRONG)]
    if band.reference:
        reference = [(point.time, point.mean) for point in band.reference_points]
        held = [sample for sample in reference if sample[0] <= end]
        curves.append(Curve(held, REFERENCE_STYLE, held=True))
    cursor = None if view.page.cursor is None else plot.column(view.page.cursor)
    drawn = curve_rows(
        curves,
        plot,
        band.reach,
        ticks=tuple(column for column, _ in tick_columns(view, room)),
        cursor=cursor,
    )
    labels = {plot.row(value): value for value in plot.scale.labels}
    marks = [place for place, (sign, _) in mark_places(view, room).items() if sign in "AB"]
    present = _present(view, band)
    at = None if present is None else plot.row(present[0])
    lines = []
    for row, cells in enumerate(drawn):
        value = labels.get(row)
        label = "" if value is None else short(f"{value:g}", AXIS_CELLS - 1)
        line = Text(f"{label:>{AXIS_CELLS - 1}}", FAINT, no_wrap=True)
        line.append("┤" if label else "│", LINE)
        line.append_text(_with_marks(cells, marks, view.signs.mark))
        if present is not None and row == at:
            line.append("─", LINE)
            line.append_text(present[1])
        lines.append(line)
    return lines


def _with_marks(cells: Text, marks: Sequence[int], sign: str) -> Text:
    """Return a row with dashed lines at the columns of marks, under the curve."""
    for column in marks:
        if cells.plain[column : column + 1] in (" ", "·", "┆"):
            before, after = cells[:column], cells[column + 1 :]
            cells = Text(no_wrap=True)
            cells.append_text(before).append(sign, ATTENTION).append_text(after)
    return cells


def _present(view: TrendView, band: BandView) -> tuple[float, Text] | None:
    """Return the latest value with its text; an old one with its age; None without any."""
    reading, points = band.reading, band.points
    if reading is None or band.trouble:
        return None
    last = next((point.mean for point in reversed(points) if point.mean is not None), None)
    number = reading.current_number
    room = LATEST_CELLS - 1

    def current(held: Value) -> Text | None:
        shown = f"{number:z.{band.digits}f}" if number is not None else held.text
        return Text(short(shown, room), STRONG)

    def old(_: Value, age: float) -> Text | None:
        return Text(short(f"{age_text(age)} old", room), STALE)

    text = reading.drawn(view.moment, current=current, old=old, missing=None)
    place = number if number is not None else last
    return None if text is None or place is None else (place, text)


def _heading(view: TrendView, band: BandView, number: int, room: TrendRoom) -> Text:
    """Return the line above a band: its name and unit, marks, and the time on the first one."""
    width = AXIS_CELLS + room.columns + LATEST_CELLS
    is_selected = number == view.selected and view.event is None
    right = _time_text(view) if not number else Text()
    line = Text(" " * (AXIS_CELLS - 1), no_wrap=True)
    line.append("┌─" if not number else "├─", LINE)
    line.append(">" if is_selected and view.plain else "▸" if is_selected else " ", KEY)
    line.append(band.name, STRONG)
    rest = width - line.cell_len - right.cell_len - 4
    unit = f" {band.unit}" if band.unit else ""
    if not room.table and view.page.cursor is not None and band.row.cursor is not None:
        line.append(f" {point_text(band.row.cursor, band.row)}{unit}", STRONG)
    elif rest > 8 and band.title:
        line.append(
            f" {short(band.title, max(4, rest - len(unit) - len(band.trouble) - 2))}{unit}", FAINT
        )
    if band.trouble:
        line.append(f" {short(band.trouble, max(8, rest - 4))}", STALE)
    elif band.note and line.cell_len + len(band.note) + 4 < width - right.cell_len:
        line.append(f" {band.note}", FAINT)
    if band.reference and line.cell_len + REFERENCE_CELLS < width - right.cell_len:
        line.append("  ").append_text(Text(view.signs.dots, REFERENCE_STYLE))
        line.append(f" {band.reference} reference", FAINT)
    line.append(" ")
    begun = line.cell_len - AXIS_CELLS
    cells = [("─", LINE)] * max(0, width - line.cell_len - right.cell_len - 1)
    for column, place in mark_places(view, room).items():
        if 0 <= column - begun < len(cells):
            cells[column - begun] = place
    for style, run in groupby(cells, key=itemgetter(1)):
        line.append("".join(sign for sign, _ in run), style)
    line.append(" ")
    return line.append_text(right)


def _time_text(view: TrendView) -> Text:
    text = Text(no_wrap=True)
    if view.page.held:
        text.append(" HELD ", ALARM_BLOCK).append(" ")
    span = view.page.step.span
    shown = (
        f"{span:g} s"
        if span < 120
        else f"{span / 60:g} min"
        if span < 3600
        else f"{span / 3600:g} h"
    )
    return text.append("<", KEY).append(f" {shown} ", STRONG).append("> ", KEY)


def _marks_line(view: TrendView) -> Text:
    """Return the times of the marks, of the cursor, and between the marks."""
    page, text = view.page, Text(no_wrap=True)
    day = time.localtime(view.now).tm_yday != time.localtime(view.start).tm_yday
    for name, moment in (("A", page.mark_a), ("B", page.mark_b)):
        if moment is not None:
            text.append(f"  {name}", ATTENTION).append(f" {clock_of(moment, day=day)}", FAINT)
    if page.mark_a is not None and page.mark_b is not None:
        text.append("  B-A ", FAINT).append(f"{page.mark_b - page.mark_a:.2f} s", STRONG)
    if page.cursor is not None:
        sign = "*" if view.plain else "◆"
        text.append(f"  {sign}", STRONG).append(f" {clock_of(page.cursor, day=day)}", FAINT)
    if view.selected == len(view.bands):
        return Text("  New band: press Enter to choose its parameter.", KEY)
    if not text:
        return Text("  Press Left for the cursor, M for mark A.", FAINT)
    return text
