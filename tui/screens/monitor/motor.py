"""The values of the monitoring set as numbers and bars; pure functions of a view."""

from __future__ import annotations

from rich.text import Text

from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import MonitoringValue, Parameter, Quantity
from tui.drive.values import NOT_AVAILABLE, is_enumeration
from tui.session.reading import Quality, Reading
from tui.widgets.drawing import aligned, bar, cut, rule
from tui.widgets.drive_signs import age_text
from tui.widgets.palette import FAINT, LINE, STALE, STRONG

from .view import View, end_of

LABELS: dict[Quantity, str] = {
    "output_frequency": "Output",
    "frequency_reference": "Reference",
    "ramp_output": "After ramp",
    "speed": "Speed",
    "motor_current": "Current",
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
LABEL_WIDTH = 14
WHOLE, DECIMALS, UNIT_WIDTH = 6, 2, 5
VALUE_COLUMNS = WHOLE + DECIMALS + 1


def motor_lines(view: View, width: int, height: int) -> list[Text]:
    """The values of the monitoring set as numbers and bars, in the profile's order."""
    lines = [rule("Motor", width, "ends of the bars are the drive's" if width > 60 else "")]
    shown = [v for v in view.values if _is_measurement(view.profile, v)]
    barred = any(value.high for value in shown)
    label = LABEL_WIDTH if barred else max(LABEL_WIDTH, width - VALUE_COLUMNS - UNIT_WIDTH - 3)
    lines += [_measurement(view, value, width, min(label, 40)) for value in shown]
    if len(lines) > (height := max(1, height)):
        hidden = len(lines) - height + 1
        lines[height - 1 :] = [Text(f" {hidden} more values in a taller terminal", FAINT)]
    return lines


def _is_measurement(profile: Profile, value: MonitoringValue) -> bool:
    parameter = profile[value.parameter]
    if parameter.quantity in LABELS:
        return True
    if parameter.bits or is_enumeration(parameter) or parameter.quantity is not None:
        return False
    return parameter.code != profile.data.faults.parameter and bool(
        parameter.unit or not is_verified(parameter)
    )


def _measurement(view: View, value: MonitoringValue, width: int, label_width: int) -> Text:
    parameter = view.profile[value.parameter]
    reading = view.reading(value.parameter)
    text = Text(no_wrap=True)
    mark = "" if is_verified(parameter) else " ?"
    label = LABELS.get(parameter.quantity) if parameter.quantity else None
    name = label or f"{parameter.code} {parameter.name}"
    short = cut(name, min(len(name), label_width - len(mark)))
    text.append(f" {short + mark:<{label_width}}", FAINT)
    _append_value(text, parameter, reading, view.now)
    rest = width - text.cell_len - 1
    if rest >= 8:
        text.append(" ")
        text.append_text(_bar(view, value, parameter, reading, rest))
    return text


def _append_value(text: Text, parameter: Parameter, reading: Reading | None, now: float) -> None:
    if reading is None or reading.raw is None:
        text.append(f"{NOT_AVAILABLE:>{VALUE_COLUMNS}}", FAINT)
        text.append(f" {cut(parameter.unit or 'raw', UNIT_WIDTH)}", FAINT)
        return
    shown, unit = reading.text, reading.unit or "raw"
    if reading.physical is not None:
        shown, unit = reading.physical.text, reading.physical.unit
    if reading.quality is Quality.GOOD:
        text.append(aligned(shown, WHOLE, DECIMALS), STRONG)
        text.append(f" {cut(unit, UNIT_WIDTH)}", FAINT)
    else:
        text.append(aligned(shown, WHOLE, DECIMALS), STALE)
        text.append(f" {cut(age_text(reading.age(now)), UNIT_WIDTH)}", STALE)


def _bar(
    view: View,
    value: MonitoringValue,
    parameter: Parameter,
    reading: Reading | None,
    width: int,
) -> Text:
    high = end_of(view, value.high)
    low = end_of(view, value.low) or 0.0
    if high is None or high <= low:
        return Text("")
    fresh = reading is not None and reading.quality is Quality.GOOD
    number = reading.number if reading is not None and fresh else None
    mark = None
    if parameter.quantity == "output_frequency":
        reference = view.profile.quantity("frequency_reference")
        target = view.reading(reference.code) if reference else None
        if target and target.quality is Quality.GOOD and target.number is not None:
            mark = abs(target.number)
        number = abs(number) if number is not None else None
    ends = f" {high:g}"
    drawn = bar(number, low, high, max(4, width - 6), mark)
    drawn.append(cut(ends, 6), LINE)
    return drawn
