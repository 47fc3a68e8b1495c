"""Rules for names: every parameter, state and word that a profile names exists."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator

from tui.drive.sentences import any_of

from ..schema import Chart, Parameter, ProfileData, path_places
from ..toml_lines import TomlPath

TAKEN_IDS = frozenset({"confirm", "new", "path"})
NamedPlace = tuple[TomlPath, str]
"""A place that names a parameter, and the code."""
WORD_FORMS = {
    re.compile(r"16#"): re.compile(r"\b(?=[0-9]*[A-F])[0-9A-F]{4}\b"),
    re.compile(r"W[0-9]"): re.compile(r"\bW[0-9]{3,5}\b"),
    re.compile(r"[0-9]+\.[0-9]"): re.compile(r"\b[0-9]{1,2}\.[0-9]{2}\b"),
}
"""Pattern of the words named in texts, by the notation of the family's numbers."""


def references(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield codes of parameters that do not exist."""
    codes = [parameter.code for parameter in data.parameters]
    known = set(codes)
    for place, code in named_parameters(data):
        if code and code not in known:
            near = difflib.get_close_matches(code, codes, n=3, cutoff=0.6)
            text = f"{place[0]}: there is no parameter {code!r}."
            yield place, f"{text} Did you mean {any_of(near)}?" if near else text


def named_parameters(data: ProfileData) -> Iterator[NamedPlace]:
    """Yield every place that names a parameter, with its code."""
    for index, parameter in enumerate(data.parameters):
        for key, code in _parameter_names(parameter):
            yield ("parameters", index, key), code
    for index, block in enumerate(data.blocks):
        for key in ("slots", "values"):
            for place, code in enumerate(getattr(block, key)):
                yield ("blocks", index, key, place), code
        for place, choice in enumerate(block.choices):
            yield ("blocks", index, "choices", place, "parameter"), choice.parameter
    for index, chart in enumerate(data.charts):
        for path, code in _chart_names(chart):
            yield ("charts", index, *path), code
    yield from _reference_places(data)
    for index, group in enumerate(data.groups):
        yield ("groups", index, "needs_factory"), group.needs_factory
    yield from _channel_names(data)
    yield from _monitoring_names(data)
    yield from _fault_names(data)
    yield from _port_counter_names(data)
    yield from _table_names(data)


def _parameter_names(parameter: Parameter) -> Iterator[tuple[str, str]]:
    yield "min_from", parameter.min_from
    yield "max_from", parameter.max_from
    yield "rating", parameter.rating
    if parameter.scale_by:
        yield "scale_by", parameter.scale_by.parameter
    if parameter.full_scale:
        yield "full_scale", parameter.full_scale.parameter
    if parameter.unit_by:
        yield "unit_by", parameter.unit_by.parameter
    for key in ("factory_by", "min_of", "max_of", "factory_of"):
        if (of := getattr(parameter, key)) is not None:
            yield key, of.parameter


def _chart_names(chart: Chart) -> Iterator[NamedPlace]:
    yield ("status",), chart.status
    yield ("command",), chart.command
    for key in ("direction", "reached", "alarm", "local", "channel", "when"):
        if (mark := getattr(chart, key)) is not None:
            yield (key,), mark.parameter
    for place, state in enumerate(chart.states):
        for when in state.also:
            yield ("states", place, "also"), when.parameter
    for key in ("orders", "interlocks", "options"):
        for place, row in enumerate(getattr(chart, key)):
            yield (key, place, "parameter"), row.parameter
            for when in getattr(row, "when", ()):
                yield (key, place, "when"), when.parameter
            for code in getattr(row, "clears", ()):
                yield (key, place, "clears"), code


def _reference_places(data: ProfileData) -> Iterator[NamedPlace]:
    for index, reference in enumerate(data.references):
        yield ("references", index, "parameter"), reference.parameter
        yield ("references", index, "feedback"), reference.feedback
        if reference.scale_when is not None:
            yield ("references", index, "scale_when"), reference.scale_when.parameter
    for index, teachable_reference in enumerate(data.teachable_references):
        yield ("teachable_references", index, "parameter"), teachable_reference.parameter
        yield ("teachable_references", index, "most"), teachable_reference.most


def _channel_names(data: ProfileData) -> Iterator[NamedPlace]:
    for path, code in path_places(data.signal_paths):
        yield ("signal_paths", *path), code
    for key in ("command", "reference", "switches"):
        for index, row in enumerate(getattr(data.channels, key)):
            yield ("channels", key, index, "parameter"), row.parameter
            for when in row.when:
                yield ("channels", key, index, "when"), when.parameter


def _monitoring_names(data: ProfileData) -> Iterator[NamedPlace]:
    for place, value in enumerate(data.monitoring.values):
        at: TomlPath = ("monitoring", "values", place)
        yield (*at, "parameter"), value.parameter
        for key, end in (("low", value.low), ("high", value.high)):
            if not end.lstrip("-").replace(".", "").isdecimal():
                yield (*at, key), end
    if speed := data.monitoring.speed_from:
        for key in ("frequency", "poles", "result"):
            yield ("monitoring", "speed_from", key), getattr(speed, key)


def _fault_names(data: ProfileData) -> Iterator[NamedPlace]:
    yield ("faults", "parameter"), data.faults.parameter
    for place, code in enumerate(data.faults.history):
        yield ("faults", "history", place), code
    for place, stored in enumerate(data.faults.stored):
        for inner, code in enumerate(stored):
            yield ("faults", "stored", place, inner), code
    for key in ("stored_from", "held"):
        for place, code in enumerate(getattr(data.faults, key)):
            yield ("faults", key, place), code
    if ready := data.faults.reset_ready:
        yield ("faults", "reset_ready"), ready.parameter
    for place, row in enumerate(data.faults.after_reset):
        for when in row.when:
            yield ("faults", "after_reset", place, "when"), when.parameter
    if inputs := data.faults.inputs:
        yield ("faults", "inputs", "parameter"), inputs.parameter


def _port_counter_names(data: ProfileData) -> Iterator[NamedPlace]:
    for index, port in enumerate(data.port_counters):
        yield ("port_counters", index, "frames"), port.frames
        yield ("port_counters", index, "checksum_errors"), port.checksum_errors


def _predecessor_names(data: ProfileData) -> Iterator[NamedPlace]:
    for index, predecessor in enumerate(data.predecessors):
        for old, code in predecessor.codes.items():
            yield ("predecessors", index, "codes", old), code


def _table_names(data: ProfileData) -> Iterator[NamedPlace]:
    for place, setting in enumerate(data.link.settings):
        yield ("link", "settings", place, "parameter"), setting.parameter
    if watch := data.communication_fault:
        yield ("communication_fault", "timeout"), watch.timeout
        for place, code in enumerate(watch.other_timeouts):
            yield ("communication_fault", "other_timeouts", place), code
        yield ("communication_fault", "reaction"), watch.reaction
    yield from _memory_names(data)
    for index, step in enumerate(data.start_up):
        for place, code in enumerate(step.parameters):
            yield ("start_up", index, "parameters", place), code
    yield from _predecessor_names(data)
    for index, source in enumerate(data.control_sources):
        for place, item in enumerate(source.settings):
            yield ("control_sources", index, "settings", place), item.parameter
    yield ("identification", "model_parameter"), data.identification.model_parameter
    yield ("identification", "class_parameter"), data.identification.class_parameter
    for place, register in enumerate(data.identification.registers):
        yield ("identification", "registers", place, "parameter"), register.parameter
    for place, server in enumerate(data.addresses.servers):
        yield ("addresses", "servers", place, "parameter"), server.parameter


def _memory_names(data: ProfileData) -> Iterator[NamedPlace]:
    for key, order in (("save", data.memory.save), ("factory", data.memory.factory)):
        if order is not None:
            yield ("memory", key, "parameter"), order.parameter
            yield ("memory", key, "groups"), order.groups
            if order.done:
                yield ("memory", key, "done"), order.done.parameter
    if (enter := data.memory.enter) is not None:
        yield ("memory", "enter", "parameter"), enter.parameter
        if enter.when is not None:
            yield ("memory", "enter", "when"), enter.when.parameter
    for place, when in enumerate(data.memory.eeprom.also_saved_by):
        yield ("memory", "eeprom", "also_saved_by", place), when.parameter


def own_id(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield an id that is also a word of `drivepanel profiles`."""
    if data.profile.id in TAKEN_IDS:
        taken = ", ".join(sorted(TAKEN_IDS))
        yield ("profile", "id"), f"{data.profile.id!r} is reserved, as are {taken}."


def groups_in_use(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield described groups without parameters."""
    known = {parameter.group for parameter in data.parameters}
    for index, group in enumerate(data.groups):
        if group.name not in known:
            yield ("groups", index, "name"), f"no parameter is in the group {group.name!r}."


def fault_of_the_line(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield the fault of a communication loss if it is not among the faults."""
    watch = data.communication_fault
    known = {fault.raw for fault in data.faults.codes}
    if watch and watch.fault is not None and data.faults.codes and watch.fault not in known:
        yield ("communication_fault", "fault"), f"there is no fault {watch.fault}."


def written_words(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield words in texts of control sources that do not exist."""
    numbers = [parameter.number for parameter in data.parameters]
    known = {name for p in data.parameters for name in (p.code, p.number, p.number[3:])}
    forms = [form for start, form in WORD_FORMS.items() if any(start.match(n) for n in numbers)]
    for index, source in enumerate(data.control_sources):
        texts = [source.name, source.note]
        texts += [
            t for way in (source.command, source.reference) for t in (*way.sources, way.switch)
        ]
        for word in (word for text in texts for form in forms for word in form.findall(text)):
            if word not in known:
                yield (
                    ("control_sources", index),
                    f"control source {source.id}: there is no word {word}.",
                )


NAME_RULES = (own_id, references, groups_in_use, fault_of_the_line, written_words)
