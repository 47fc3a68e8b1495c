"""Rules for the meaning of values: units, words that are read, and settings of the line."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator

from tui.drive.sentences import any_of
from tui.drive.values import raw_range, word_count

from ..profile_frame import FrameError, frame_contents
from ..reference_ways import QUANTITY_OF_KIND, reference_ways
from ..schema import Parameter, ProfileData
from ..toml_lines import TomlPath
from .charts import RUN_ORDERS

TIME_UNITS = ("s", "ms", "min")
SPEED_UNITS = ("Hz", "rpm", "%")
RAMP_UNITS = (*TIME_UNITS, "Hz/s", "rpm/s")
NO_UNIT = ("",)
QUANTITY_UNITS: dict[str, tuple[str, ...]] = {
    "output_frequency": SPEED_UNITS,
    "frequency_reference": SPEED_UNITS,
    "ramp_output": SPEED_UNITS,
    "command_frequency": (*SPEED_UNITS, "V"),
    "command_speed": SPEED_UNITS,
    "speed": SPEED_UNITS,
    "speed_reference": SPEED_UNITS,
    "high_speed": SPEED_UNITS,
    "low_speed": SPEED_UNITS,
    "max_frequency": SPEED_UNITS,
    "rated_frequency": ("Hz",),
    "rated_speed": ("rpm",),
    **{f"preset_speed_{number}": SPEED_UNITS for number in range(1, 8)},
    "acceleration": RAMP_UNITS,
    "deceleration": RAMP_UNITS,
    "acceleration_2": RAMP_UNITS,
    "deceleration_2": RAMP_UNITS,
    "motor_current": ("A", "mA", "%"),
    "rated_current": ("A", "mA", "%"),
    "thermal_current": ("A", "mA", "%"),
    "drive_current": ("A", "mA"),
    "motor_voltage": ("V", "%"),
    "rated_voltage": ("V", "%"),
    "mains_voltage": ("V", "%"),
    "dc_bus": ("V", "%"),
    "torque": ("%", "Nm"),
    "power": ("kW", "W", "hp", "%"),
    "input_power": ("kW", "W", "hp", "%"),
    "switching_frequency": ("kHz", "Hz"),
    "run_hours": ("h", "min", "s", "d"),
    "power_on_hours": ("h", "min", "s", "d"),
    "line_timeout": TIME_UNITS,
    "status_word": NO_UNIT,
    "status_word_2": NO_UNIT,
    "status_word_3": NO_UNIT,
    "extended_status_word": NO_UNIT,
    "command_word": NO_UNIT,
    "command_word_2": NO_UNIT,
    "extended_command_word": NO_UNIT,
    "alarm_word": NO_UNIT,
    "fault": NO_UNIT,
    "motor_poles": NO_UNIT,
}
"""Units that a quantity can have; a value shown raw has none."""
STATUS_QUANTITIES = frozenset(
    {None, "status_word", "status_word_2", "status_word_3", "extended_status_word", "alarm_word"}
)
PORT_BAUDS = frozenset(
    {300, 600, 1200, 1800, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200}
    | {125000, 128000, 187500, 230400, 250000, 256000, 460800, 500000, 576000, 921600, 1000000}
)
"""Baud rates of serial ports and of drives."""
_FORMAT = re.compile(r"8[NEO][12]")


def fitting_units(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield quantities in an impossible unit, and limits whose unit differs."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, parameter in enumerate(data.parameters):
        at: TomlPath = ("parameters", index)
        fits = QUANTITY_UNITS.get(parameter.quantity or "", ())
        if fits and parameter.unit and parameter.unit not in fits and not parameter.unit_by:
            allowed = ", ".join(filter(None, fits)) or "none"
            yield (
                (*at, "unit"),
                f"parameter {parameter.code}: {parameter.quantity} in {parameter.unit!r} is not"
                f" possible. Allowed: {allowed}.",
            )
        for key, code in (("min_from", parameter.min_from), ("max_from", parameter.max_from)):
            other = parameters.get(code)
            if other and other.unit != parameter.unit and parameter.unit and other.unit:
                yield (
                    (*at, key),
                    f"parameter {parameter.code}: its limit {code} is in {other.unit}, not"
                    f" {parameter.unit}.",
                )


def references_usable(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield references that cannot be written or found, or whose unit is missing or wrong."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, listed in enumerate(data.references):
        feedback = parameters.get(listed.feedback)
        if feedback is not None and feedback.access == "w":
            at: TomlPath = ("references", index, "feedback")
            yield at, f"reference: its feedback {listed.feedback} cannot be read."
        word = parameters.get(listed.parameter)
        if listed.signed and word is not None and word.type.startswith("uint"):
            yield (
                ("references", index, "signed"),
                f"reference {word.code} is signed, but {word.type} has no negative value. Use"
                f" {word.type.removeprefix('u')}.",
            )
    runs = any(order.id in RUN_ORDERS for chart in data.charts for order in chart.orders)
    for at, way, parameter in reference_ways(data):
        if at[0] == "parameters" and not runs:
            continue  # a profile that is begun
        place = (*at, "parameter" if at[0] == "references" else "code")
        if parameter.access == "r" or parameter.forbidden:
            yield place, f"reference {parameter.code} cannot be written."
        elif parameter.access == "rw-stopped":
            yield place, f"reference {parameter.code} cannot be changed while the motor turns."
        wrong = "rpm" if way.kind == "frequency" else "Hz"
        if not parameter.unit:
            yield place, f"reference {parameter.code} has no unit. Never guess a scale."
        elif parameter.unit == wrong or parameter.unit not in (*SPEED_UNITS, "V"):
            yield place, f"reference {parameter.code} is a {way.kind} in {parameter.unit!r}."
        quantity = QUANTITY_OF_KIND[way.kind]
        if parameter.quantity != quantity:
            yield (
                place,
                f"reference {parameter.code} has no quantity {quantity}. Without it, no command"
                " finds the reference.",
            )


def time_of_timeouts(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield communication timeouts without a unit of time."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    watch = data.communication_fault
    for code in (watch.timeout, *watch.other_timeouts) if watch else ():
        parameter = parameters.get(code)
        if parameter is not None and parameter.unit not in TIME_UNITS:
            key = "timeout" if watch and code == watch.timeout else "other_timeouts"
            yield (
                ("communication_fault", key),
                f"timeout {code} has the unit {parameter.unit!r}. Allowed: s, ms, min.",
            )


def words_are_words(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield status, command and fault words that are measurements, and values never readable."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, chart in enumerate(data.charts):
        at: TomlPath = ("charts", index)
        status = parameters.get(chart.status)
        if status is not None and (_measures(status) or status.quantity not in STATUS_QUANTITIES):
            what = status.quantity if status.quantity not in STATUS_QUANTITIES else "a measurement"
            yield (
                (*at, "status"),
                f"chart {chart.id}: {status.code} is {what}, not a status word.",
            )
        if chart.command and chart.status == chart.command:
            yield (
                (*at, "status"),
                f"chart {chart.id}: {chart.status} is its command word. A status word is the"
                " drive's own, or a command would be taken for its effect.",
            )
        places: list[tuple[TomlPath, str]] = [((*at, "command"), chart.command)]
        for place, order in enumerate(chart.orders):
            places.append(((*at, "orders", place), order.parameter))
        for path, code in places:
            command = parameters.get(code)
            if command is not None and _measures(command):
                text = f"{code} has a unit or a scale. A command word has none."
                yield path, f"chart {chart.id}: {text}"
    fault = parameters.get(data.faults.parameter)
    if fault is not None and _measures(fault):
        yield ("faults", "parameter"), f"faults: {fault.code} is a measurement, not a fault word."
    for place, value in enumerate(data.monitoring.values):
        shown = parameters.get(value.parameter)
        if shown is not None and shown.access == "w":
            yield ("monitoring", "values", place), f"monitoring: {shown.code} cannot be read."


def _measures(parameter: Parameter) -> bool:
    return bool(parameter.unit or parameter.scale_by) or float(parameter.scale) != 1


def keys_are_values(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield keys of `scale_by`, `unit_by` and `factory_by` that their parameter cannot hold."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    names = {row.id: row.values for row in data.enumerations}
    for index, parameter in enumerate(data.parameters):
        by = (
            ("scale_by", parameter.scale_by, parameter.scale_by and parameter.scale_by.scales),
            (
                "factory_by",
                parameter.factory_by,
                parameter.factory_by and parameter.factory_by.raws,
            ),
        )
        for key, row, keys in by:
            of = parameters.get(row.parameter) if row else None
            if of is None:
                continue
            known = {**names.get(of.enumeration, {}), **of.values}
            for raw in keys or ():
                if raw.lstrip("-").isdecimal() and raw not in known and (known or _beyond(of, raw)):
                    yield (
                        ("parameters", index, key),
                        f"parameter {parameter.code}: {key}: {of.code} has no value {raw}.",
                    )
        if (unit := parameter.unit_by) is not None:
            for raw in unit.units:
                if raw.isdecimal() and int(raw) & ~unit.mask:
                    yield (
                        ("parameters", index, "unit_by"),
                        f"parameter {parameter.code}: unit_by: {raw} does not fit the mask.",
                    )


def _beyond(parameter: Parameter, raw: str) -> bool:
    low, high = raw_range(parameter)
    return not low <= int(raw) <= high


def settings_of_the_line(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield rates and formats that no port has, and slave addresses in the wrong order."""
    link = data.link
    bauds: list[tuple[TomlPath, int]] = [(("link", "baud"), link.baud)]
    bauds += [(("link", "bauds", place), baud) for place, baud in enumerate(link.bauds)]
    for index, setting in enumerate(link.settings):
        for place, choice in enumerate(setting.choices):
            if choice.baud is not None:
                bauds.append((("link", "settings", index, "choices", place), choice.baud))
    for at, baud in bauds:
        if baud not in PORT_BAUDS:
            yield at, f"no port has {baud} baud."
    if link.bauds and link.baud not in link.bauds:
        yield ("link", "baud"), f"baud {link.baud} is not among its bauds."
    for place, form in enumerate(link.formats):
        if not _FORMAT.fullmatch(form):
            yield ("link", "formats", place), f"{form!r} is not a format such as 8E1 or 8N2."
    if link.formats and link.format not in link.formats:
        yield ("link", "format"), f"format {link.format} is not among its formats."
    slaves = data.addresses
    if slaves.first > slaves.last:
        yield ("addresses", "first"), f"first {slaves.first} is above last {slaves.last}."


def writable_settings(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield settings that the profile proposes although they cannot be written."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    places: list[tuple[TomlPath, str]] = [
        (("memory", key), order.parameter)
        for key, order in (
            ("enter", data.memory.enter),
            ("save", data.memory.save),
            ("factory", data.memory.factory),
        )
        if order is not None
    ]
    for index, source in enumerate(data.control_sources):
        for place, setting in enumerate(source.settings):
            places.append((("control_sources", index, "settings", place), setting.parameter))
    for at, code in places:
        parameter = parameters.get(code)
        if parameter is not None and (parameter.access == "r" or parameter.forbidden):
            yield at, f"{code} cannot be written."
    for key, order in (("save", data.memory.save), ("factory", data.memory.factory)):
        word = parameters.get(order.parameter) if order is not None else None
        if order is None or word is None:
            continue
        if order.bit and word.access == "w":
            text = f"{word.code} cannot be read (access w), so its other bits cannot be kept."
            yield ("memory", key, "bit"), f"{text} Delete bit."
        shown = parameters.get(order.done.parameter) if order.done is not None else None
        if shown is not None and shown.access == "w":
            yield ("memory", key, "done"), f"{shown.code} cannot be read (access w)."


def readable_pairs(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield parameters of several words of which a read holds fewer."""
    most = {function.code: function.max_read for function in data.functions}
    for index, parameter in enumerate(data.parameters):
        words, limit = word_count(parameter), most.get(parameter.function)
        if words > (limit or words) or (words > 2 and data.reading.single_words_only):
            yield (
                ("parameters", index, "type"),
                f"parameter {parameter.code}: {parameter.type} is {words} words, but function"
                f" {parameter.function} reads {limit or 1} (max_read).",
            )


def monitored_bars(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield bars that end below their beginning."""
    for place, value in enumerate(data.monitoring.values):
        try:
            inverted = float(value.low) >= float(value.high)
        except ValueError:  # an end is a parameter, or absent
            continue
        if inverted:
            yield (
                ("monitoring", "values", place),
                f"monitoring: {value.parameter}: low {value.low} is not below high {value.high}.",
            )


def profile_frames(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield example frames without a valid exchange or without a meaning."""
    for index, frame in enumerate(data.frames):
        at: TomlPath = ("frames", index)
        try:
            frame_contents(frame)
        except FrameError as error:
            yield at, f"frame: {error}"
        if not frame.means:
            yield at, "frame: `means` is empty. Name each value, such as 2103H = 50.00 Hz."


def meanings_of_frames(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield meanings of example frames that no value of the frame can have."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, frame in enumerate(data.frames):
        try:
            contents = frame_contents(frame)
        except FrameError:
            continue  # reported by profile_frames
        known = [source.id for source in data.sources]
        if frame.source.partition(" ")[0].rstrip(",;:") not in known:
            yield (
                ("frames", index, "source"),
                f"frame: source {frame.source!r} does not begin with the id of a source. Known:"
                f" {', '.join(known) or 'none, add a table [[sources]]'}.",
            )
        last = contents.address + len(contents.words) - 1
        for place, text in enumerate(frame.means):
            at: TomlPath = ("frames", index, "means", place)
            code, _, value = text.partition(" = ")
            parameter = parameters.get(code)
            if not value.strip():
                yield at, f"frame: {text!r} is not written as CODE = value, such as FREQ = 50.0 Hz."
            elif parameter is None:
                near = difflib.get_close_matches(code.upper(), parameters, n=3, cutoff=0.6)
                text = f"frame: there is no parameter {code!r}."
                yield at, f"{text} Did you mean {any_of(near)}?" if near else text
            elif (
                parameter.function != contents.space
                or not contents.address <= parameter.address <= last
            ):
                yield at, f"frame: {code} is not in its registers: {contents.address} to {last}."
            elif fault := _unit_fault(parameter, value):
                yield at, f"frame: {text!r}: {fault}"


def _unit_fault(parameter: Parameter, value: str) -> str:
    """Return why a number has a wrong unit; empty for texts, words, and units by a setting."""
    number = re.fullmatch(r"-?[0-9]+(?:\.[0-9]+)?(.*)", value)
    named = parameter.values or parameter.enumeration or parameter.unit_by
    if named or parameter.type == "ascii" or value.startswith("16#"):
        return ""
    if parameter.unit:
        right = number is not None and number[1] in (f" {parameter.unit}", " raw")
        unit = parameter.unit
        return "" if right else f"{parameter.code} is a number in {unit}, such as 50.0 {unit}."
    wrong = number is not None and number[1] not in ("", " raw")
    return f"{parameter.code} has no unit." if wrong else ""


MEANING_RULES = (
    profile_frames,
    fitting_units,
    references_usable,
    time_of_timeouts,
    words_are_words,
    keys_are_values,
    settings_of_the_line,
    writable_settings,
    readable_pairs,
    monitored_bars,
)
