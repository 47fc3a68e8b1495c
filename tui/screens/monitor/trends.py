"""The trends of frequency and current with their axes; pure functions of a view."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from rich.style import Style
from rich.text import Text

from tui.drive.profile.schema import Parameter, Quantity
from tui.safety import STALE_CYCLES
from tui.widgets.drawing import cut, short
from tui.widgets.palette import BAR, BAR_REST, FAINT, KEY, LINE
from tui.widgets.trend import WANTED, trend_rows

from .view import View, end_of

LABEL_CELLS = 5
LEGEND_CELLS = 14
TREND_PLACES: dict[Quantity, int] = {"output_frequency": 0, "motor_current": 1}
WANTED_PLACE = 2
"""Row in which a point of the trend has the reference."""
TREND_NAMES: dict[Quantity, str] = {"output_frequency": "output", "motor_current": "current"}
ROUND_TOPS: Sequence[float] = (1, 2, 5, 10, 20, 50, 60, 100, 200, 500, 1000, 2000, 5000, 10000)


def trend_lines(view: View, width: int, height: int) -> list[Text]:
    """The frequency; where the terminal is wide, the current beside it."""
    if height <= 1:
        return [Text("")] * height
    if view.low_bandwidth:
        off = Text("  No trend at low bandwidth.", FAINT)
        return [off, *[Text("")] * (height - 1)]
    if width < 110:
        return one_trend(view, "output_frequency", width, height)
    half = width // 2
    pairs = zip(
        one_trend(view, "output_frequency", half, height),
        one_trend(view, "motor_current", width - half, height),
        strict=True,
    )
    return [left.append_text(right) for left, right in pairs]


def one_trend(view: View, quantity: Quantity, width: int, height: int) -> list[Text]:
    """Rows and the axis of time, each of exactly so many cells."""
    parameter = view.profile.quantity(quantity)
    if parameter is None:
        message = f"  No trend: no manual confirms where the {TREND_NAMES[quantity]} is."
        nothing = Text(cut(message, width), FAINT)
        return [nothing, *[Text(" " * width, no_wrap=True) for _ in range(height - 1)]]
    columns = width - LABEL_CELLS - 1 - LEGEND_CELLS - 1
    step = view.span / columns
    points = trend_columns(view, TREND_PLACES[quantity], columns, step)
    wanted: list[float | None] = [None] * columns
    if quantity == "output_frequency":
        wanted = trend_columns(view, WANTED_PLACE, columns, step)
    signed = any(value is not None and value < 0 for value in (*points, *wanted))
    high = _top(view, parameter, TREND_PLACES[quantity])
    style = BAR_REST if view.lost else BAR
    rows = _drawn(tuple(points), tuple(wanted), high or 1.0, height - 1, signed, style)
    legend = _legend(view, quantity, parameter)
    lines = []
    for at, row in enumerate(rows):
        line = Text(_label(at, height - 1, high, signed=signed), FAINT, no_wrap=True)
        line.append("┤" if line.plain.strip() else "│", LINE)
        line.append_text(row)
        line.append(" ")
        line.append_text(legend[at] if at < len(legend) else Text(" " * LEGEND_CELLS))
        lines.append(line)
    return [*lines, _axis(view, columns)]


@lru_cache(maxsize=8)
def _drawn(
    points: Sequence[float | None],
    wanted: Sequence[float | None],
    high: float,
    height: int,
    signed: bool,
    style: Style,
) -> list[Text]:
    """The rows; they shift by a column now and then only, and callers copy them."""
    return trend_rows(points, wanted, high, height, signed=signed, style=style)


def _label(row: int, rows: int, high: float | None, *, signed: bool) -> str:
    """The number of a row at the axis: the upper end, zero, the lower end."""
    half = rows // 2
    number = {0: high, rows - 1: 0.0}
    if signed:
        number = {0: high, half - 1: 0.0 if half > 1 else high, 2 * half - 1: -(high or 0)}
    shown = number.get(row)
    if shown is None:
        return " " * LABEL_CELLS
    text = f"{shown:.0f}" if abs(shown) >= 1000 else f"{shown:g}"
    return f"{short(text, LABEL_CELLS):>{LABEL_CELLS}}"


def _legend(view: View, quantity: Quantity, parameter: Parameter) -> list[Text]:
    """Return the plotted quantities, and the keys that change the window."""
    lines = []
    if quantity == "output_frequency":
        lines.append(Text.assemble(("━", WANTED), (" reference", FAINT)))
    lines.append(Text.assemble(("█", BAR), (f" {TREND_NAMES[quantity]} {parameter.unit}", FAINT)))
    keys = Text.assemble(("< >", KEY), (f" {span_text(view.span)}", FAINT))
    lines.append(keys if quantity == "output_frequency" else Text(""))
    for line in lines:
        line.truncate(LEGEND_CELLS)
        line.append(" " * (LEGEND_CELLS - line.cell_len))
    return lines


def _axis(view: View, columns: int) -> Text:
    """The axis of time."""
    text = Text(" " * (LABEL_CELLS + 1), no_wrap=True)
    first = f"-{span_text(view.span)}"
    text.append(f"{first}{'now':>{columns - len(first)}}", FAINT)
    return text.append(" " * (LEGEND_CELLS + 1))


def _top(view: View, parameter: Parameter, index: int) -> float | None:
    """The top of a trend: the end of the value's bar, else a round number above the highest.

    None while neither is known.
    """
    for value in view.values:
        if value.parameter == parameter.code and (end := end_of(view, value.high)):
            return end
    seen = [abs(v) for p in view.trend if (v := p.values[index]) is not None]
    if not seen:
        return None
    return next((top for top in ROUND_TOPS if top >= max(seen)), max(seen))


def span_text(seconds: float) -> str:
    """A window of the trend as a person reads it."""
    return f"{seconds:g} s" if seconds < 120 else f"{seconds / 60:g} min"


def trend_columns(view: View, index: int, count: int, step: float) -> list[float | None]:
    """The last value of each column; columns are at whole steps, so they shift as one."""
    last = int(view.now / step)
    columns: list[float | None] = [None] * count
    for point in view.trend:
        at = count - 1 - (last - int(point.time / step))
        if 0 <= at < count and index < len(point.values) and point.values[index] is not None:
            columns[at] = point.values[index]
    return _bridged(columns, step, view)


def _bridged(columns: list[float | None], step: float, view: View) -> list[float | None]:
    """Columns narrower than a cycle take the value before them, as far as three cycles."""
    reach = max(1, round(STALE_CYCLES * view.period / step))
    filled = list(columns)
    for at, value in enumerate(columns):
        if value is None:
            before = [v for v in columns[max(0, at - reach) : at] if v is not None]
            filled[at] = before[-1] if before else None
    return filled
