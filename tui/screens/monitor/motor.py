"""The other values of the monitoring set, in columns; pure functions of a view."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from rich.text import Text

from tui.drive.profile.profile import Profile, is_verified, mark_of
from tui.drive.profile.schema import MonitoringValue, Quantity
from tui.drive.values import NOT_AVAILABLE, is_enumeration
from tui.session.shown import Quality
from tui.widgets.drawing import short
from tui.widgets.gauge import gauge
from tui.widgets.palette import FAINT, STALE, STRONG, age_text

from .view import View, end_of, readout_parameter

LABELS: dict[Quantity, str] = {
    "ramp_output": "After ramp",
    "speed": "Speed",
    "motor_voltage": "Motor voltage",
    "mains_voltage": "Mains",
    "dc_bus": "DC bus",
    "torque": "Torque",
    "power": "Power",
    "input_power": "Input power",
    "drive_thermal": "Drive thermal",
    "motor_thermal": "Motor thermal",
    "motor_load": "Motor load",
    "drive_load": "Drive load",
    "energy": "Energy",
    "run_hours": "Run time",
    "power_on_hours": "Power-on time",
}
IN_READOUTS: frozenset[Quantity] = frozenset(
    {"output_frequency", "frequency_reference", "motor_current"}
)
UNIT_CELLS, NUMBER_CELLS = 3, 7
VALUE_CELLS = 24
"""Cells of a value beside its bar."""
VALUE_CELLS_MOST = 30
BAR_CELLS, END_CELLS = 8, 4
NO_ROOM = "on 3"
"""Hint at what does not fit."""


@lru_cache(maxsize=8)
def other_values(profile: Profile) -> Sequence[MonitoringValue]:
    """The values beside the readouts, in the profile's order."""
    return tuple(value for value in profile.data.monitoring.values if _is_other(profile, value))


def _is_other(profile: Profile, value: MonitoringValue) -> bool:
    parameter = profile[value.parameter]
    shown = (readout_parameter(profile, "output_frequency"),
             readout_parameter(profile, "motor_current"))  # fmt: skip
    if parameter in shown or parameter.quantity in IN_READOUTS:
        return False
    if parameter.quantity in LABELS:
        return True
    if parameter.bits or is_enumeration(parameter) or parameter.quantity is not None:
        return False
    return parameter.code != profile.data.faults.parameter and bool(
        parameter.unit or not is_verified(parameter)
    )


def motor_lines(view: View, width: int, rows: int, columns: int) -> list[Text]:
    """The values column by column; what does not fit is counted, with where it is read."""
    values = other_values(view.profile)
    room = rows * columns
    hidden = len(values) - room + 1 if len(values) > room else 0
    cells = (width - 2) // columns
    barred = any(value.high for value in values)
    places = [_value(view, value, cells, barred) for value in values[: room - bool(hidden)]]
    if hidden and room:
        places.append(Text(short(f"{hidden} more values {NO_ROOM}", cells - 1), FAINT))
    lines = [Text("  ", no_wrap=True) for _ in range(rows)]
    for at, place in enumerate(places):
        line = lines[at % rows]
        line.append_text(place)
        line.append(" " * (cells - place.cell_len))
    return lines


def value_cells(cells: int, barred: bool) -> int:
    """Return the width of a column with name, number and unit in cells."""
    with_bar = VALUE_CELLS + 2 + BAR_CELLS + END_CELLS
    return VALUE_CELLS if barred and cells >= with_bar else min(cells - 2, VALUE_CELLS_MOST)


def _value(view: View, value: MonitoringValue, cells: int, barred: bool) -> Text:
    """Its name, its number to the right, its unit; behind it a bar where there is room."""
    parameter = view.profile[value.parameter]
    columns = value_cells(cells, barred)
    mark = f" {mark_of(view.profile, parameter)}".rstrip()
    name = LABELS.get(parameter.quantity) if parameter.quantity else None
    room = columns - NUMBER_CELLS - UNIT_CELLS - 1
    label = short(name or parameter.name, room - len(mark)) + mark
    text = Text(f"{label:<{room}}", FAINT, no_wrap=True)
    reading = view.reading(value.parameter)
    if reading is None or reading.raw is None:
        text.append(f"{NOT_AVAILABLE:>{NUMBER_CELLS}}", FAINT)
        return text.append(f" {short(parameter.unit or 'raw', UNIT_CELLS):<{UNIT_CELLS}}", FAINT)
    number, unit = reading.drawn(
        view.now,
        current=lambda held: ((held.text, STRONG), (held.unit or "raw", FAINT)),
        old=lambda held, age: ((held.text, FAINT), (age_text(age), STALE)),
        missing=((NOT_AVAILABLE, FAINT), (age_text(reading.age(view.now)), STALE)),
    )
    text.append(f"{short(number[0], NUMBER_CELLS):>{NUMBER_CELLS}}", number[1])
    text.append(f" {short(unit[0], UNIT_CELLS):<{UNIT_CELLS}}", unit[1])
    high = end_of(view, value.high)
    if (
        cells >= columns + 2 + BAR_CELLS + END_CELLS
        and high is not None
        and reading.quality is Quality.GOOD
    ):
        low = end_of(view, value.low) or 0.0
        text.append("  ")
        text.append_text(gauge(reading.current_number, low, high, BAR_CELLS))
        text.append(short(f"{high:g}", END_CELLS), FAINT)
    return text
