"""Other values of the monitoring set, in columns; pure functions of a view."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from rich.text import Text

from tui.drive.profile.profile import Profile, is_verified, mark_of
from tui.drive.profile.schema import MonitoringValue, Parameter, Quantity
from tui.drive.values import NOT_AVAILABLE, is_enumeration
from tui.session.monitor.trend import readout_parameter
from tui.session.shown import Quality
from tui.widgets.drawing import fitted_names, short
from tui.widgets.gauge import gauge
from tui.widgets.palette import FAINT, STALE, STRONG, age_text

from .readouts import readout_quantities
from .view import View, end_of

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
SHORT_LABELS: dict[Quantity, str] = {
    "ramp_output": "Ramped",
    "motor_voltage": "Motor",
    "mains_voltage": "Mains",
    "input_power": "Input",
    "drive_thermal": "Drive th",
    "motor_thermal": "Motor th",
    "motor_load": "Load",
    "drive_load": "Drive ld",
    "run_hours": "Run time",
    "power_on_hours": "On time",
}
"""Labels for narrow columns."""
IN_READOUTS: frozenset[Quantity] = frozenset(
    {"output_frequency", "frequency_reference", "motor_current"}
)
UNIT_CELLS, NUMBER_CELLS, SHORT_NUMBER_CELLS = 3, 7, 6
SHORT_FROM = 22
"""Least cells of a column for full labels and numbers."""
VALUE_CELLS = 24
"""Cells of a value that has a bar after it."""
VALUE_CELLS_MOST = 30
BAR_CELLS, END_CELLS = 8, 4


@lru_cache(maxsize=16)
def other_values(profile: Profile, *, wide: bool = False) -> Sequence[MonitoringValue]:
    """Return the values of the monitoring set without a readout, in the profile's order."""
    found = (readout_parameter(profile, q) for q in readout_quantities(profile, wide=wide))
    shown = {parameter.code for parameter in found if parameter is not None}
    values = profile.data.monitoring.values
    return tuple(v for v in values if v.parameter not in shown and _is_other(profile, v))


def _is_other(profile: Profile, value: MonitoringValue) -> bool:
    parameter = profile[value.parameter]
    if parameter.quantity in IN_READOUTS:
        return False
    if parameter.quantity in LABELS:
        return True
    if parameter.bits or is_enumeration(parameter) or parameter.quantity is not None:
        return False
    return parameter.code != profile.data.faults.parameter and bool(
        parameter.unit or not is_verified(parameter)
    )


def motor_lines(
    view: View, width: int, rows: int, columns: int, *, wide: bool = False
) -> list[Text]:
    """Return the values column by column, as many as fit. Tab shows the others."""
    values = other_values(view.profile, wide=wide)[: rows * columns]
    cells = (width - 1) // columns
    barred = any(value.high for value in values)
    labels = value_labels(view.profile, values, cells, barred)
    lines = [Text(" ", no_wrap=True) for _ in range(rows)]
    for at, (value, label) in enumerate(zip(values, labels, strict=True)):
        place = _value(view, value, label, cells, barred)
        lines[at % rows].append_text(place).append(" " * (cells - place.cell_len))
    return lines


def value_cells(cells: int, barred: bool) -> int:
    """Return the cells for name, number and unit in a column of `cells` cells."""
    with_bar = VALUE_CELLS + 2 + BAR_CELLS + END_CELLS
    return VALUE_CELLS if barred and cells >= with_bar else min(cells - 2, VALUE_CELLS_MOST)


def value_labels(
    profile: Profile, values: Sequence[MonitoringValue], cells: int, barred: bool
) -> list[str]:
    """Return distinct names of values with their marks, padded to fit a column of `cells` cells."""
    numbers = SHORT_NUMBER_CELLS if cells < SHORT_FROM else NUMBER_CELLS
    room = value_cells(cells, barred) - numbers - UNIT_CELLS - 1
    parameters = [profile[value.parameter] for value in values]
    marks = [f" {mark_of(profile, parameter)}".rstrip() for parameter in parameters]
    names = [_label(parameter, is_short=cells < SHORT_FROM) for parameter in parameters]
    fitted = fitted_names(tuple(names), max(1, room - max(map(len, marks), default=0)))
    return [f"{fitted[name]}{mark}".ljust(room) for name, mark in zip(names, marks, strict=True)]


def _value(view: View, value: MonitoringValue, label: str, cells: int, barred: bool) -> Text:
    """Return name, number and unit of a value, followed by a bar if there is room."""
    parameter = view.profile[value.parameter]
    columns = value_cells(cells, barred)
    numbers = SHORT_NUMBER_CELLS if cells < SHORT_FROM else NUMBER_CELLS
    text = Text(label, FAINT, no_wrap=True)
    reading = view.reading(value.parameter)
    if reading is None or reading.raw is None:
        text.append(f"{NOT_AVAILABLE:>{numbers}}", FAINT)
        return text.append(f" {short(parameter.unit or 'raw', UNIT_CELLS):<{UNIT_CELLS}}", FAINT)
    number, unit = reading.drawn(
        view.now,
        current=lambda held: ((held.text, STRONG), (held.unit or "raw", FAINT)),
        old=lambda held, age: ((held.text, FAINT), (age_text(age), STALE)),
        missing=((NOT_AVAILABLE, FAINT), (age_text(reading.age(view.now)), STALE)),
    )
    text.append(f"{short(number[0], numbers):>{numbers}}", number[1])
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


def _label(parameter: Parameter, *, is_short: bool) -> str:
    """Return the label of a quantity; any other value has the name of its parameter."""
    if parameter.quantity is None:
        return parameter.name
    full = LABELS.get(parameter.quantity, parameter.name)
    return SHORT_LABELS.get(parameter.quantity, full) if is_short else full
