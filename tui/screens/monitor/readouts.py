"""The two large readouts, output frequency and motor current, each with a bar; pure functions."""

from __future__ import annotations

from decimal import Decimal

from rich.style import Style
from rich.text import Text

from tui.drive.profile.profile import mark_of
from tui.drive.profile.schema import Parameter, Quantity
from tui.drive.values import NOT_AVAILABLE, Value, decimals_of
from tui.session.shown import Quality, Shown
from tui.widgets.drawing import cut, short
from tui.widgets.gauge import gauge
from tui.widgets.palette import BAR, BAR_REST, FAINT, STALE, STRONG, age_text
from tui.widgets.readout import ROWS, big, dashes, readout_cells

from .view import View, bar_number, directed, end_of, readout_parameter

READOUT_SHARE = 0.55
"""Share of the width that the frequency has, for its sign."""
READOUT_MOST = 104
END_CELLS = 7
"""Cells behind a bar for the number at its end."""
TITLES: dict[Quantity, str] = {"output_frequency": "Output", "motor_current": "Current"}


def readout_lines(view: View, width: int) -> list[Text]:
    """Both side by side: a heading, three rows of digits, a bar."""
    width = min(width, READOUT_MOST)
    margin = 2 if width >= 54 else 1
    left = round((width - margin) * READOUT_SHARE)
    rows = [Text(" " * margin, no_wrap=True) for _ in range(ROWS + 2)]
    for quantity, cells in zip(TITLES, (left, width - margin - left), strict=True):
        for row, part in zip(rows, _readout(view, quantity, cells), strict=True):
            row.append_text(part)
    return rows


def plain_lines(view: View, width: int) -> list[Text]:
    """The same two as plain lines, where there is no room for large ones."""
    lines = []
    for quantity, title in TITLES.items():
        parameter = readout_parameter(view.profile, quantity)
        text, unit, style = _shown(view, quantity, parameter)
        line = Text(f" {title:<8}", FAINT, no_wrap=True)
        line.append(f"{text:>8}", style)
        line.append(f" {unit}", FAINT)
        lines.append(line)
    for line in lines:
        line.truncate(width)
    return lines


def _readout(view: View, quantity: Quantity, cells: int) -> list[Text]:
    """One of them, each row of exactly so many cells."""
    parameter = readout_parameter(view.profile, quantity)
    text, unit, style = _shown(view, quantity, parameter)
    unit = short(unit, 4)
    field = min(_field(parameter, quantity), cells - len(unit) - 2)
    drawn = dashes(field) if text == NOT_AVAILABLE else big(text, field, plain=view.plain)
    rows = [_heading(view, quantity, parameter, field + 1 + len(unit))]
    for number, part in enumerate(drawn):
        row = Text(no_wrap=True).append(part, style)
        if number == ROWS - 1:
            row.append(f" {unit}", FAINT)
        rows.append(row)
    rows.append(_bar(view, quantity, parameter, cells - END_CELLS))
    for row in rows:
        row.truncate(cells)
        row.append(" " * (cells - row.cell_len))
    return rows


def _shown(view: View, quantity: Quantity, parameter: Parameter | None) -> tuple[str, str, Style]:
    """Text, unit and style of the value."""
    reading = view.reading(parameter.code) if parameter else None
    none = (NOT_AVAILABLE, parameter.unit if parameter else "", FAINT)
    if parameter is None or reading is None:
        return none

    def signed(value: Value) -> str:
        number = directed(view, parameter, bar_number(value))
        backward = quantity == "output_frequency" and number is not None and number < 0
        return f"-{value.text}" if backward and not value.text.startswith("-") else value.text

    return reading.drawn(
        view.now,
        current=lambda value: (signed(value), value.unit or "raw", STRONG),
        old=lambda value, age: (signed(value), value.unit or "raw", FAINT),  # the heading has it
        missing=none,
    )


def _field(parameter: Parameter | None, quantity: Quantity) -> int:
    """The width of the digits: the same for every value of a parameter."""
    if parameter is None or not parameter.unit:
        return readout_cells(0, signed=quantity == "output_frequency", whole=5)
    follows = parameter.scale_by
    scales = [parameter.scale, *(follows.scales.values() if follows is not None else ())]
    decimals = max(decimals_of(Decimal(scale)) for scale in scales)
    return readout_cells(decimals, signed=quantity == "output_frequency")


def _heading(view: View, quantity: Quantity, parameter: Parameter | None, cells: int) -> Text:
    """The name; behind it the reference, or the age of a value that is not the present."""
    title = TITLES[quantity]
    if parameter is not None and (mark := mark_of(view.profile, parameter)):
        title += f" {mark}"
    text = Text(title, FAINT, no_wrap=True)
    reading = view.reading(parameter.code) if parameter else None
    right, style = "", FAINT
    if reading is not None and reading.quality is not Quality.GOOD and reading.raw is not None:
        right, style = f"{age_text(reading.age(view.now))} old", STALE
    elif quantity == "output_frequency" and (wanted := _reference(view)) is not None:
        right = wanted.drawn(
            view.now,
            current=lambda value: f"ref {value.text:>5}",
            old=lambda value, age: "",
            missing="",
        )
    if right and len(title) + len(right) < cells:
        text.append(" " * (cells - len(title) - len(right)))
        text.append(right, style)
    return text


def _reference(view: View) -> Shown | None:
    """The reference, where it is known now."""
    parameter = view.profile.quantity("frequency_reference")
    reading = view.reading(parameter.code) if parameter else None
    return reading if reading is not None and reading.current_number is not None else None


def _bar(view: View, quantity: Quantity, parameter: Parameter | None, cells: int) -> Text:
    """The value between its limits, the reference as a mark, the high end as a number."""
    value = next((v for v in view.values if parameter and v.parameter == parameter.code), None)
    high = end_of(view, value.high) if value else None
    if parameter is None or value is None or high is None or high <= 0 or cells < 6:
        return Text("")
    reading = view.reading(parameter.code)
    fresh = reading is not None and reading.quality is Quality.GOOD
    number: float | None = None
    if reading is not None:
        number = reading.drawn(
            view.now, current=bar_number, old=lambda value, age: bar_number(value), missing=None
        )
    mark = None
    if quantity == "output_frequency":
        number = directed(view, parameter, number)
        wanted, reference = view.profile.quantity("frequency_reference"), _reference(view)
        mark = directed(view, wanted, reference.current_number) if fresh and reference else None
    reverse = (number or 0) < 0 or (mark or 0) < 0
    low = -high if reverse else end_of(view, value.low) or 0.0
    drawn = gauge(number, low, high, cells, mark, BAR if fresh else BAR_REST)
    return drawn.append(cut(f" {'±' if reverse else ''}{high:g}", END_CELLS), FAINT)
