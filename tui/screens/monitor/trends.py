"""The last minute of frequency and current; pure functions of a view."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from tui.drive.profile.schema import Parameter, Quantity
from tui.session.monitor.snapshot import STALE_CYCLES
from tui.widgets.drawing import cut, rule, trend
from tui.widgets.palette import FAINT, LINE

from .view import USUAL_SPAN, View, end_of


def stacked_trends(view: View, width: int, height: int) -> list[Text]:
    """Frequency above current, the last minute of each; newest at the right."""
    upper = height // 2
    return [
        *_trend(view, 0, "output_frequency", "Frequency", width, upper),
        *_trend(view, 1, "motor_current", "Current", width, height - upper),
    ]


def trend_lines(view: View, width: int, height: int) -> list[Text]:
    """Frequency and current of the last minute, side by side; newest at the right."""
    half = (width - 2) // 2
    left = _trend(view, 0, "output_frequency", "Frequency", half, height)
    right = _trend(view, 1, "motor_current", "Current", width - 2 - half, height)
    joined: list[Text] = []
    for one, other in zip(left, right, strict=True):
        line = one.copy()
        line.append("  ")
        line.append_text(other)
        joined.append(line)
    return joined


def _trend(
    view: View, index: int, quantity: Quantity, title: str, width: int, height: int
) -> list[Text]:
    parameter = view.profile.quantity(quantity)
    if parameter is None:
        nothing = Text(cut(" not known", width), FAINT)
        return [rule(title, width), nothing, *[Text(" " * width)] * (height - 2)]
    if view.low_bandwidth:
        off = Text(cut(" off: low bandwidth", width), FAINT)
        return [rule(title, width), off, *[Text(" " * width)] * (height - 2)]
    high = _trend_high(view, parameter, index)
    columns = width - 1
    step = view.span / columns
    rows = trend(_columns(view, index, columns, step), high or 1.0, columns, height - 1)
    span = f"0..{high:g} {parameter.unit}" if high else "no values yet"
    lines = [
        rule(
            title,
            width,
            span + (f", {span_text(view.span)}" if width > 30 or view.span != USUAL_SPAN else ""),
        )
    ]
    return lines + [Text.assemble(("│", LINE), row) for row in rows]


def _trend_high(view: View, parameter: Parameter, index: int) -> float | None:
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


ROUND_TOPS: Sequence[float] = (1, 2, 5, 10, 20, 50, 60, 100, 200, 500, 1000, 2000, 5000, 10000)


def _columns(view: View, index: int, count: int, step: float) -> list[float | None]:
    """The last value of each column; columns stand on whole steps, so they shift as one."""
    last = int(view.now / step)
    columns: list[float | None] = [None] * count
    for point in view.trend:
        at = count - 1 - (last - int(point.time / step))
        if 0 <= at < count and point.values[index] is not None:
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
