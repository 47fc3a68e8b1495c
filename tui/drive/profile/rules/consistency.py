"""Rules for facts of a profile that contradict each other in different tables."""

from __future__ import annotations

from collections.abc import Iterator

from tui.drive.values import type_range

from ..schema import Chart, Parameter, ProfileData, StatusBit
from ..toml_lines import TomlPath
from .meanings import QUANTITY_UNITS, SPEED_UNITS

MEASURED_QUANTITIES = frozenset(
    {"output_frequency", "speed", "motor_current", "torque", "power", "motor_voltage", "dc_bus"}
    | {"mains_voltage", "ramp_output", "run_hours", "power_on_hours", "drive_thermal"}
)
"""Quantities that only the drive itself can set."""
SHORTEST_PREFIX = 3


def full_names(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield empty names, a family that replaces itself, and prefixes that fit any drive."""
    for index, parameter in enumerate(data.parameters):
        for key in ("name", "number"):
            if not getattr(parameter, key).strip():
                yield ("parameters", index, key), f"parameter {parameter.code}: {key} is empty."
    for index, before in enumerate(data.predecessors):
        if before.profile == data.profile.id:
            yield ("predecessors", index, "profile"), f"{before.profile} does not replace itself."
    known = data.identification
    for place, prefix in enumerate(known.reference_prefixes if known else ()):
        if len(prefix.strip()) < SHORTEST_PREFIX:
            yield (
                ("identification", "reference_prefixes", place),
                f"prefix {prefix!r} would fit drives of other families. Use at least"
                f" {SHORTEST_PREFIX} characters.",
            )


def possible_values(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield names of values that a word cannot hold, and faults beyond their word."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, parameter in enumerate(data.parameters):
        at: TomlPath = ("parameters", index)
        low, high = type_range(parameter)
        for raw in parameter.values:
            if raw.lstrip("-").isdecimal() and not low <= int(raw) <= high:
                yield (
                    (*at, "values"),
                    f"parameter {parameter.code}: it cannot hold the value {raw}: {low} to {high}.",
                )
    word = parameters.get(data.faults.parameter)
    for place, fault in enumerate(data.faults.codes if word is not None else ()):
        assert word is not None
        low, high = type_range(word)
        if not low <= fault.raw <= high:
            yield (
                ("faults", "codes", place),
                f"fault {fault.raw}: {word.code} cannot hold it: {low} to {high}.",
            )
    for index, parameter in enumerate(data.parameters):
        if parameter.quantity == "fault" and word is not None and parameter is not word:
            yield (
                ("parameters", index, "quantity"),
                f"parameter {parameter.code}: it has the quantity fault, but the fault word is"
                f" {word.code}.",
            )


def conditions_possible(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield bits and values of the status words that can never appear, and edges without a bit."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, chart in enumerate(data.charts):
        at: TomlPath = ("charts", index)
        marks: tuple[tuple[str, StatusBit | None], ...] = (
            ("reached", chart.reached), ("alarm", chart.alarm), ("local", chart.local),
        )  # fmt: skip
        bits = [(key, mark.parameter, mark.bit) for key, mark in marks if mark is not None]
        if chart.direction is not None:
            bits.append(("direction", chart.direction.parameter, chart.direction.bit))
        for key, code, bit in bits:
            word = parameters.get(code)
            if (
                word is not None
                and type_range(word)[1].bit_length() + (type_range(word)[0] < 0) <= bit
            ):
                yield (*at, key), f"chart {chart.id}: {key}: {code} has no bit {bit}."
            elif word is not None and (fault := _named_otherwise(chart, key, word, bit)):
                yield (*at, key), f"chart {chart.id}: {key}: {fault}"
        for place, step in enumerate(chart.transitions):
            if step.edge_bit is not None and not (step.command or 0) >> step.edge_bit & 1:
                yield (
                    (*at, "transitions", place),
                    f"chart {chart.id}: edge_bit {step.edge_bit} is not in its command.",
                )
        for place, lock in enumerate(chart.interlocks):
            word = parameters.get(lock.parameter)
            values = {value for value in lock.values if not value & ~lock.mask}
            if word is not None and word.values and lock.mask == 0xFFFF:
                values &= {int(raw) for raw in word.values if raw.lstrip("-").isdecimal()}
            if word is not None and not values:
                yield (
                    (*at, "interlocks", place),
                    f"chart {chart.id}: {lock.parameter} never has a value that the interlock"
                    " allows. The motor could never run.",
                )


_NAMED_BY = {"local": "local", "direction": "reverse"}
"""Word by which the texts of a bit show that the mark with this key holds."""


def _named_otherwise(chart: Chart, key: str, word: Parameter, bit: int) -> str:
    """Return how the texts of a bit contradict its mark; empty if they do not."""
    named = next((row for row in word.bits if row.bit == bit), None)
    if named is None or key not in _NAMED_BY:
        return ""
    off, on = (_NAMED_BY[key] in text.casefold() for text in (named.off, named.on))
    mark = chart.local.value if key == "local" and chart.local else 1
    if key == "direction" and chart.direction is not None:
        mark = chart.direction.reverse
    if off == on or on == bool(mark):
        return ""
    text, field = (named.on if on else named.off), "value" if key == "local" else "reverse"
    return f"{word.code} bit {bit} is {text!r} at {int(on)}, so {field} must be {int(on)}."


def settings_of_words(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield commands and references that wear the EEPROM, and measurements that can be written."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    words = {order.parameter or chart.command for chart in data.charts for order in chart.orders}
    words |= {way.parameter for way in data.references}
    for index, parameter in enumerate(data.parameters):
        at: TomlPath = ("parameters", index)
        if parameter.code in words and parameter.storage == "eeprom":
            yield (
                (*at, "storage"),
                f"parameter {parameter.code}: each command or reference would be written to"
                " EEPROM. Use the address in RAM.",
            )
        if parameter.quantity in MEASURED_QUANTITIES and parameter.access != "r":
            yield (
                (*at, "access"),
                f"parameter {parameter.code}: {parameter.quantity} is measured by the drive:"
                " access must be r.",
            )
        for key, limit in (("min_of", parameter.min_of), ("max_of", parameter.max_of)):
            other = parameters.get(limit.parameter) if limit is not None else None
            if limit and other and not limit.raws and other.unit != parameter.unit:
                yield (
                    (*at, key),
                    f"parameter {parameter.code}: its limit {other.code} is in"
                    f" {other.unit or 'no unit'}, not {parameter.unit or 'no unit'}.",
                )
    fault = parameters.get(data.faults.parameter)
    if fault is not None and fault.access == "w":
        yield ("faults", "parameter"), f"faults: {fault.code} cannot be read."


def is_kept(parameter: Parameter) -> bool:
    """Return True if a word is written as a setting, and not as a command."""
    return parameter.access != "w" and parameter.storage != "ram" and parameter.holds != "command"


def saving_words(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield memory commands that would command the motor, change a value, or do two things."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    commands = {chart.command for chart in data.charts if chart.command}
    enter, save, factory = data.memory.enter, data.memory.save, data.memory.factory
    for key, order in (("enter", enter), ("save", save), ("factory", factory)):
        word = parameters.get(order.parameter) if order is not None else None
        if word is None:
            continue
        if word.code in commands:
            yield ("memory", key), f"memory: {word.code} is the command word of the motor."
        elif word.unit:
            yield ("memory", key), f"memory: {word.code} is a value in {word.unit}, not a command."
    if enter and (word := parameters.get(enter.parameter)) and is_kept(word):
        yield (
            ("memory", "enter"),
            f"memory: {word.code} is a setting. The word after each setting is never one: give it"
            ' the access w, or storage = "ram".',
        )
    if enter and factory and (enter.parameter, enter.raw) == (factory.parameter, factory.raw):
        text = "memory: the word after each setting would return all to the factory values."
        yield ("memory", "enter"), text
    if save and factory and (save.parameter, save.raw) == (factory.parameter, factory.raw):
        yield (
            ("memory", "factory"),
            f"memory: {save.raw} to {save.parameter} both saves the settings and returns them to"
            " the factory values.",
        )


def loss_of_line(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield reactions to communication loss that contradict themselves or have no setting."""
    watch = data.communication_fault
    if watch is None:
        return
    parameters = {parameter.code: parameter for parameter in data.parameters}
    word = parameters.get(watch.reaction)
    if word is not None and (word.code == watch.timeout or word.unit):
        yield (
            ("communication_fault", "reaction"),
            f"reaction {word.code} is a value in {word.unit or 'time'}, not a choice of reactions.",
        )
    for place, reaction in enumerate(watch.reactions):
        if reaction.trips and reaction.motor_keeps_running:
            yield (
                ("communication_fault", "reactions", place),
                f"reaction {reaction.raw}: the motor of a drive that trips does not keep running.",
            )


def factory_line(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield factory settings of the line that two tables state differently, and a broadcast."""
    link, slaves = data.link, data.addresses
    if slaves.first == 0:
        yield ("addresses", "first"), "0 is the broadcast address. The first address is 1."
    if slaves.factory not in (slaves.off, *range(slaves.first, slaves.last + 1)):
        yield (
            ("addresses", "factory"),
            f"factory {slaves.factory} is not between first {slaves.first} and last {slaves.last}.",
        )
    for place, baud in enumerate(link.bauds):
        if baud in link.bauds[:place]:
            yield ("link", "bauds", place), f"baud {baud} occurs twice."


def factory_choices(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield factory choices of the line's settings that [link] contradicts."""
    link = data.link
    for index, setting in enumerate(link.settings):
        chosen = [choice for choice in setting.choices if choice.raw == setting.factory]
        at: TomlPath = ("link", "settings", index)
        known = setting.role in ("baud", "format") and setting.choices
        if known and setting.factory is not None and not chosen:
            yield (
                (*at, "factory"),
                f"{setting.parameter}: {setting.factory} is not among its choices.",
            )
        for choice in chosen:
            if choice.baud not in (None, link.baud) or choice.format not in (None, link.format):
                yield (
                    (*at, "factory"),
                    f"{setting.parameter}: its factory choice is {choice.text}, but [link] has"
                    f" {link.baud} {link.format}.",
                )


def fitting_ends(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield bars that end at a parameter in another unit, and percentages of something else."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, parameter in enumerate(data.parameters):
        whole = parameters.get(parameter.rating)
        fits = QUANTITY_UNITS.get(parameter.quantity or "", ())
        if whole is not None and fits and whole.unit and whole.unit not in fits:
            yield (
                ("parameters", index, "rating"),
                f"parameter {parameter.code}: 100 % of {parameter.quantity} cannot be"
                f" {whole.code} in {whole.unit}.",
            )
    for place, value in enumerate(data.monitoring.values):
        shown = parameters.get(value.parameter)
        for end in (value.low, value.high):
            other = parameters.get(end)
            if shown and other and shown.unit and other.unit not in ("", shown.unit):
                yield (
                    ("monitoring", "values", place),
                    f"monitoring: {value.parameter} is in {shown.unit}, its end {end} in"
                    f" {other.unit}.",
                )


def feedback_of_reference(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield feedbacks that are the reference itself, or no speed."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, way in enumerate(data.references):
        shown: Parameter | None = parameters.get(way.feedback)
        if shown is None:
            continue
        at: TomlPath = ("references", index, "feedback")
        if way.feedback == way.parameter:
            yield at, f"reference {way.parameter} is its own feedback: it shows no motor."
        elif shown.unit and shown.unit not in SPEED_UNITS:
            yield at, f"reference {way.parameter}: its feedback {shown.code} is in {shown.unit}."


CONSISTENCY_RULES = (
    full_names,
    possible_values,
    conditions_possible,
    settings_of_words,
    saving_words,
    loss_of_line,
    factory_line,
    fitting_ends,
    feedback_of_reference,
)
