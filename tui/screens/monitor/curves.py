"""Curves of frequency and current with their axes, marks and cursor; pure functions."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Sequence
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.drive.profile.schema import Parameter, Quantity
from tui.drive.values import NOT_AVAILABLE, possible_decimals
from tui.safety import STALE_CYCLES
from tui.session.monitor.trend import (
    REFERENCE_PLACE,
    TREND_MARKS,
    TREND_QUANTITIES,
    TrendMark,
    TrendPoint,
    readout_parameter,
)
from tui.widgets.curve import (
    Curve,
    CurveScale,
    Samples,
    curve_rows,
    round_up,
    sample_at,
    scale_of,
)
from tui.widgets.drawing import short
from tui.widgets.palette import (
    BAR,
    FAINT,
    KEY,
    LINE,
    PLAIN,
    REFERENCE_STYLE,
    STALE,
    STRONG,
)

from .arrange import Arrangement
from .time_axis import (
    LABEL_CELLS,
    MARGIN_CELLS,
    MARK_SIGNS,
    ShownPage,
    axis_lines,
    mark_names,
    marks_on_page,
    points_of_page,
    ticks_of,
)
from .view import View, directed, end_of

NAMES: dict[Quantity, str] = {"output_frequency": "output", "motor_current": "current"}
READ_OUT_WHOLE = 74
"""Columns from which the values at the cursor have their whole names."""


HEADING_MARK_CELLS = 24
"""Cells of the heading for each mark that it names on a slow link: a third of them are free."""


class Band(NamedTuple):
    """One quantity with its own vertical axis."""

    quantity: Quantity
    parameter: Parameter
    place: int
    """Index of the quantity in `TrendPoint.values`."""


def bands(view: View) -> list[Band]:
    """Return the quantities with a curve; the first has the large plot."""
    found = []
    for place, quantity in enumerate(TREND_QUANTITIES):
        parameter = readout_parameter(view.profile, quantity)
        if quantity in NAMES and parameter is not None:
            found.append(Band(quantity, parameter, place))
    return found


def curve_lines(view: View, room: Arrangement) -> list[Text]:
    """Return the heading, the curves and the time axis, in exactly the rows of the part."""
    found = bands(view)
    if not found:
        nothing = Text("  No curve: no document says where output and current are.", FAINT)
        return [nothing, *[Text("")] * (room.curve - 1)]
    if all(value is None for point in view.trend for value in point.values):
        # before the first value, axes would have a scale of nothing, and delay the values
        heading = _heading(view, found[0], (), room.width)
        return [heading, *[Text("")] * (room.curve - 1)]
    columns = room.width - LABEL_CELLS - 1 - MARGIN_CELLS
    points = points_of_page(view)
    page = ShownPage(view, points, columns, marks_on_page(view, points, columns))
    # names on the axis move when the page turns: on a slow link the heading has them if it can
    in_heading = view.lean and len(set(page.marks.values())) <= room.width // HEADING_MARK_CELLS
    names = {} if in_heading else mark_names(page, on_axis=room.axis == 1)
    unnamed = {mark for mark in page.marks.values() if mark not in names}
    lines = [_heading(view, found[0], unnamed, room.width)]
    lines += _band_lines(page, found[0], room.plot)
    if room.band:
        rest = [Text("")] * (room.band + 1)
        second = found[1] if len(found) > 1 else None
        lines += [_between(second, page), *_band_lines(page, second, room.band)] if second else rest
    return [*lines, *axis_lines(page, room.axis, names)]


def samples_of(points: Sequence[TrendPoint], place: int) -> Samples:
    """Return the value at index `place` of each point, with its time."""
    return [(point.time, point.values[place]) for point in points]


def reach_of(view: View) -> float:
    """Return the longest gap, in seconds, across which two values are connected."""
    return STALE_CYCLES * view.cycle


def _band_lines(page: ShownPage, band: Band, rows: int) -> list[Text]:
    view = page.view
    values = samples_of(page.points, band.place)
    curves = [Curve(values, FAINT if view.lost else STRONG if band.place == 0 else BAR)]
    if band.quantity == "output_frequency" and _has_reference(view):
        curves.append(Curve(samples_of(page.points, REFERENCE_PLACE), REFERENCE_STYLE, held=True))
    plot = page.plot(rows, _scale(view, band, curves, rows))
    drawn = curve_rows(
        curves,
        plot,
        reach_of(view),
        ticks=tuple(column for column, _ in ticks_of(page)),
        # their signs on the axis remain: a line in each row would be sent at each turn of the page
        marks=() if view.lean else tuple(page.marks),
        cursor=None if view.cursor is None else plot.column(view.cursor),
    )
    labels = {plot.row(value): value for value in plot.scale.labels}
    present = _present(view, band)
    at = plot.row(present[0]) if present is not None else None
    lines = []
    for row, cells in enumerate(drawn):
        value = labels.get(row)
        label = "" if value is None else short(f"{value:g}", LABEL_CELLS)
        line = Text(f"{label:>{LABEL_CELLS}}", FAINT, no_wrap=True)
        line.append("┤" if label else "│", LINE)
        line.append_text(cells)
        if present is not None and row == at:
            line.append("─", LINE)
            line.append(f"{short(present[1], MARGIN_CELLS - 1):<{MARGIN_CELLS - 1}}", STRONG)
        lines.append(line)
    return lines


def _has_reference(view: View) -> bool:
    """Return True if the reference has a curve; on a slow link only its number is shown."""
    return not view.lean and readout_parameter(view.profile, "frequency_reference") is not None


def _present(view: View, band: Band) -> tuple[float, str] | None:
    """Return the latest value with its text; None if it is old, or while the cursor is open.

    On a low-bandwidth link, the readout alone has it: next to the curve it would change its row.
    """
    reading = view.reading(band.parameter.code)
    number = reading.current_number if reading is not None else None
    if reading is None or number is None or view.page is not None or view.lean:
        return None
    if band.quantity == "output_frequency":
        number = directed(view, band.parameter, number)
    if number is None:
        return None
    digits = possible_decimals(band.parameter)
    return number, f"{number:z.{digits}f}"


def _scale(view: View, band: Band, curves: Sequence[Curve], rows: int) -> CurveScale:
    """Return the scale, which is symmetric if any value is negative.

    It ends at the end of the value's bar, or at a round number above any higher value.
    """
    seen = [value for curve in curves for _, value in curve.samples if value is not None]
    lowest, highest = min(seen, default=0.0), max(seen, default=0.0)
    farthest = max(highest, -lowest)
    end = bar_end(view, band.parameter, band.place)
    if farthest > (end or 0.0):
        end = round_up(farthest)
    high = end or 1.0
    return scale_of(-high if lowest < 0 else 0.0, high, rows)


def bar_end(view: View, parameter: Parameter, place: int) -> float | None:
    """Return the end of a value's bar; if the profile has none, a round number above the trend."""
    for value in view.values:
        if value.parameter == parameter.code and (end := end_of(view, value.high)):
            return end if end > 0 else None
    reading = view.reading(parameter.code)
    seen = [(reading.current_number or 0.0) if reading is not None else 0.0]
    seen += [v for point in view.trend if (v := point.values[place]) is not None]
    farthest = max(max(seen), -min(seen))
    return round_up(farthest) if farthest > 0 else None


def _between(band: Band, page: ShownPage) -> Text:
    """Return the line above the second band, with its unit and name."""
    unit = short(band.parameter.unit or "raw", LABEL_CELLS - 1)
    text = Text(f" {unit:<{LABEL_CELLS - 1}}", FAINT, no_wrap=True).append("├─ ", LINE)
    text.append_text(_sample("⠒⠒", BAR, page.view)).append(f" {NAMES[band.quantity]} ", FAINT)
    return text.append("─" * max(0, page.columns + LABEL_CELLS + 1 - text.cell_len), LINE)


def _heading(view: View, band: Band, marks: Collection[TrendMark], width: int) -> Text:
    """Return the names of curves and of `marks`; while the cursor is open, the values there."""
    if view.cursor is not None:
        return _read_out(view, view.cursor, width)
    unit = band.parameter.unit or "raw"
    right = Text.assemble(("<", KEY), (f" {span_text(view.step.span)} ", FAINT), (">", KEY))
    right.append("  =", KEY).append(" read ", FAINT)
    shown = sorted(marks, key=TREND_MARKS.index)
    signs = sum(len(MARK_SIGNS[mark][2]) + 4 for mark in shown)
    left = Text(f" {short(unit, LABEL_CELLS - 1):<{LABEL_CELLS - 1}} ", FAINT, no_wrap=True)
    left.append_text(_sample("⠒⠒", STRONG, view)).append(f" {NAMES[band.quantity]}", FAINT)
    if band.quantity == "output_frequency" and _has_reference(view):
        left.append("  ").append_text(_sample("⠂⠂", REFERENCE_STYLE, view))
        is_tight = left.cell_len + len(" reference") + signs + right.cell_len > width
        left.append(" ref" if is_tight else " reference", FAINT)
    for mark in shown:
        sign, style, name = MARK_SIGNS[mark]
        if left.cell_len + len(name) + 4 + right.cell_len > width:
            break
        left.append("  ").append(sign, style).append(f" {name}", FAINT)
    left.append(" " * max(1, width - left.cell_len - right.cell_len))
    return left.append_text(right)


def _sample(dots: str, style: Style, view: View) -> Text:
    """Return two cells of a curve for the legend, in the signs of this terminal."""
    if view.plain:
        dots = "--" if dots == "⠒⠒" else "= "
    elif not view.braille:
        dots = "▄▄" if dots == "⠒⠒" else "▄ "
    return Text(dots, style)


def _read_out(view: View, moment: float, width: int) -> Text:
    """Return the values at the moment of the cursor, with the time at which they were read."""
    text, is_narrow = Text(no_wrap=True), width < READ_OUT_WHOLE
    between, cells, last = (" ", 6, "ref") if is_narrow else ("   ", 7, "reference")
    found, points = None, points_of_page(view)
    for place, quantity in enumerate(TREND_QUANTITIES):
        parameter = readout_parameter(view.profile, quantity)
        if parameter is None:
            continue
        item = sample_at(samples_of(points, place), moment, reach_of(view))
        found = found or item
        text.append(f"{between}{NAMES.get(quantity, last)} ", FAINT)
        value = None if item is None else item[1]
        if value is None:
            text.append(f"{NOT_AVAILABLE:>{cells}}", FAINT)
        else:
            text.append(f"{value:>z{cells}.{possible_decimals(parameter)}f}", STRONG)
        text.append(f" {parameter.unit or 'raw'}", FAINT)
    at = found[0] if found is not None else moment
    head = Text(f" {clock_text(at + view.apart)}", PLAIN if found is not None else STALE)
    line = head.append_text(text)
    line.no_wrap = True
    close = Text.assemble(("Esc", KEY), (" close ", FAINT))
    for keys in (Text.assemble(("← →", KEY), (" move ", FAINT)).append_text(close), close):
        if line.cell_len + keys.cell_len < width:
            line.append(" " * (width - line.cell_len - keys.cell_len))
            return line.append_text(keys)
    return line


def clock_text(wall: float) -> str:
    """Return the local time of day, truncated to tenths; `wall` is in seconds since 1970."""
    tenths = math.floor(wall * 10 + 1e-6)
    return f"{time.strftime('%H:%M:%S', time.localtime(tenths // 10))}.{tenths % 10}"


def span_text(seconds: float) -> str:
    """Return a span in seconds, or in minutes from 120 s on."""
    return f"{seconds:g} s" if seconds < 120 else f"{seconds / 60:g} min"
