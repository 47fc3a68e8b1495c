"""Rules for each single parameter, and for what must be unique."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import msgspec

from tui.drive.values import raw_range, type_range, word_count
from tui.drive.words import bit_count

from ..help_file import help_findings
from ..schema import HelpData, Parameter, ProfileData
from ..toml_lines import TomlPath
from .names import named_parameters


def unique_names(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield codes, quantities, ids and raw codes that occur twice."""
    yield from _twice(
        ((("parameters", n, "code"), p.code) for n, p in enumerate(data.parameters)),
        "code {} is already used by a parameter above; each needs its own.",
    )
    seen: dict[str, str] = {}
    for index, parameter in enumerate(data.parameters):
        if parameter.quantity is None:
            continue
        if parameter.quantity in seen:
            yield (
                ("parameters", index, "quantity"),
                f"parameter {parameter.code}: quantity {parameter.quantity} already belongs to"
                f" {seen[parameter.quantity]}; a quantity has one parameter at most.",
            )
        seen.setdefault(parameter.quantity, parameter.code)
    yield from _twice(_once_in_other_case(data), "code {} differs from another only in its case.")
    whole = [(n, p) for n, p in enumerate(data.parameters) if p.mask == 0xFFFF and not p.shift]
    yield from _twice(
        ((("parameters", n, "number"), p.number) for n, p in whole),
        "number {} is already used by a parameter above.",
    )
    for path, rows, key, text in _unique_rows(data):
        yield from _twice(
            (((*path, n, key), getattr(row, key)) for n, row in enumerate(rows)), text
        )
    for index, parameter in enumerate(data.parameters):
        at: TomlPath = ("parameters", index)
        named = ((*at, "values"), parameter.values.values()), ((*at, "bits"), _bit_names(parameter))
        for place, names in named:
            yield from _twice(
                ((place, name) for name in names),
                f"parameter {parameter.code}: the name {{!r}} occurs twice.",
            )


def _once_in_other_case(data: ProfileData) -> Iterator[tuple[TomlPath, object]]:
    """Yield each code once, without case: a code finds its parameter in any case."""
    for code, n in {p.code: n for n, p in enumerate(data.parameters)}.items():
        yield ("parameters", n, "code"), code.lower()


def _bit_names(parameter: Parameter) -> list[str]:
    """Return the names of bits whose meaning does not depend on other bits."""
    return [bit.name for bit in parameter.bits if bit.counts is None]


UNIQUE_ROWS = (
    (("parameters",), "name", "name {!r} is already used by a parameter above."),
    (("functions",), "code", "function {} is declared twice."),
    (("exceptions",), "code", "exception {} occurs twice."),
    (("references",), "parameter", "reference {} occurs twice."),
    (("monitoring", "values"), "parameter", "{} is monitored twice."),
    (("identification", "objects"), "id", "object {} occurs twice."),
    (("identification", "registers"), "parameter", "register {} occurs twice."),
    (("link", "settings"), "parameter", "setting {} occurs twice."),
    (("communication_fault", "reactions"), "raw", "reaction {} occurs twice."),
    (("faults", "codes"), "raw", "fault {} occurs twice; a raw code means one fault."),
    (("groups",), "name", "group {!r} occurs twice."),
    *(
        ((table,), "id", f"id {{}} occurs twice in {table}.")
        for table in (
            "sources",
            "enumerations",
            "charts",
            "blocks",
            "control_sources",
            "signal_paths",
        )
    ),
)
"""Rows of which one field must be unique, with its error."""


def _unique_rows(
    data: ProfileData,
) -> Iterator[tuple[TomlPath, Sequence[object], str, str]]:
    for path, key, text in UNIQUE_ROWS:
        rows: Any = data
        for name in path:
            rows = getattr(rows, name) if rows is not None else None
        yield path, rows or (), key, text
    for index, chart in enumerate(data.charts):
        for table in ("states", "options"):
            text = f"chart {chart.id}: id {{}} occurs twice in {table}."
            yield ("charts", index, table), getattr(chart, table), "id", text
    for index, setting in enumerate(data.link.settings):
        at: TomlPath = ("link", "settings", index, "choices")
        yield at, setting.choices, "raw", f"{setting.parameter}: choice {{}} occurs twice."


def _twice(rows: Iterable[tuple[TomlPath, object]], text: str) -> Iterator[tuple[TomlPath, str]]:
    seen: set[object] = set()
    for path, name in rows:
        if name in seen:
            yield path, text.format(name)
        seen.add(name)


def fields(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield errors in the fields of each parameter."""
    sources = [source.id for source in data.sources]
    enumerations = {enumeration.id: enumeration.values for enumeration in data.enumerations}
    for index, parameter in enumerate(data.parameters):
        for key, fault in _faults_of(parameter, sources, enumerations):
            place: TomlPath = ("parameters", index, key) if key else ("parameters", index)
            yield place, f"parameter {parameter.code}: {fault}"


def _faults_of(
    parameter: Parameter, sources: list[str], enumerations: dict[str, dict[str, str]]
) -> Iterator[tuple[str, str]]:
    yield from _range_faults(parameter, enumerations)
    yield from _shape_faults(parameter)
    if not set(parameter.scale) & set("123456789"):
        yield "scale", "scale must not be 0."
    if parameter.enumeration and parameter.enumeration not in enumerations:
        known = ", ".join(enumerations) or "none"
        yield (
            "enumeration",
            f"there is no enumeration {parameter.enumeration!r}. Known: {known}.",
        )
    for key, source in _sources_of(parameter):
        words = source.split()
        if not words or words[0].rstrip(",;:") not in sources:
            known = ", ".join(sources) or "none, add a table [[sources]]"
            yield (
                key,
                f"source {source!r} does not begin with the id of a source. Known: {known}.",
            )
    yield from _number_keys("values", parameter.values)
    if parameter.scale_by:
        yield from _number_keys("scale_by", parameter.scale_by.scales)
        if not parameter.scale_by.scales:
            yield "scale_by", "scale_by has no scales."
    for key in ("min_of", "max_of", "factory_of"):
        if (of := getattr(parameter, key)) is not None:
            yield from _number_keys(key, of.raws)
    if parameter.unit_by:
        yield from _number_keys("unit_by", parameter.unit_by.units)
    for number, times in Counter(bit.bit for bit in parameter.bits).items():
        if times > 1:
            yield "bits", f"bit {number} occurs twice."


def _sources_of(parameter: Parameter) -> Iterator[tuple[str, str]]:
    """Yield the sources of the row, its limits and its factory setting."""
    yield "source", parameter.source
    if parameter.limit_grounds is not None:
        yield "limit_grounds", parameter.limit_grounds.source
    if parameter.factory_grounds is not None:
        yield "factory_grounds", parameter.factory_grounds.source


def _range_faults(
    parameter: Parameter, enumerations: dict[str, dict[str, str]]
) -> Iterator[tuple[str, str]]:
    low, high = type_range(parameter)
    minimum, maximum = raw_range(parameter)
    if not (low <= minimum <= high and low <= maximum <= high):
        yield "", f"range {minimum}..{maximum} does not fit {parameter.type}: {low} to {high}."
    if minimum > maximum:
        yield "", f"min {minimum} is above max {maximum}."
    factory = parameter.factory
    if factory is None:
        return
    if not low <= factory <= high:
        yield "factory", f"factory {factory} does not fit {parameter.type}: {low} to {high}."
    elif not minimum <= factory <= maximum and str(factory) not in {
        **enumerations.get(parameter.enumeration, {}),
        **parameter.values,
    }:
        yield "factory", f"factory {factory} is outside its limits, {minimum} to {maximum}."


def _shape_faults(parameter: Parameter) -> Iterator[tuple[str, str]]:
    long = word_count(parameter) > 1
    yield from _space_faults(parameter)
    if parameter.mask != 0xFFFF or parameter.shift:
        if long or parameter.type != "uint16":
            yield "type", f"a field of a register (mask, shift) is uint16, not {parameter.type}."
        if parameter.mask << parameter.shift > 0xFFFF:
            yield "mask", "mask, shifted left by shift, exceeds bit 15 of the word."
        if parameter.mask & (parameter.mask + 1):
            yield "mask", "mask must be adjacent ones from bit 0, such as 1, 3, 7, 15."
    if parameter.type == "float32" and _has_float_faults(parameter):
        yield (
            "type",
            "a float32 has a resolution as its scale, such as 0.01, and neither bits, names,"
            " scale_by nor full_scale.",
        )
    width = bit_count(parameter)
    for key, bits in (("bits", [b.bit for b in parameter.bits]), ("reserved", parameter.reserved)):
        if bits and max(bits) >= width:
            what = f"its {width} coils" if parameter.is_bits else parameter.type
            yield key, f"there is no bit {max(bits)} in {what}: 0 to {width - 1}."
    if parameter.offset != "0" or parameter.scale.startswith("-"):
        yield from _offset_faults(parameter)
    if parameter.address + word_count(parameter) > 0x10000:
        yield "address", "exceeds address 65535."


_INPUTS = {2: "a discrete input", 4: "an input register"}


def _space_faults(parameter: Parameter) -> Iterator[tuple[str, str]]:
    """Yield what does not fit the kind of its registers, coils or inputs."""
    if parameter.is_bits:
        yield from _coil_faults(parameter)
    elif parameter.type == "ascii" or parameter.words > 1 or parameter.low_byte_first:
        yield from _text_faults(parameter)
    if (what := _INPUTS.get(parameter.function)) and parameter.access != "r":
        text = f"{what} (function {parameter.function}) can only be read: access must be r."
        yield "function", text


MOST_COILS = 16
"""Most coils or inputs that form one word."""
NOT_OF_COILS = frozenset({
    "type", "low_byte_first", "mask", "shift", "unit", "scale", "offset", "scale_by", "full_scale",
    "unit_by", "base", "rating", "min", "max", "min_from", "max_from", "min_of", "max_of",
    "sure_up_to", "eeprom_address",
})  # fmt: skip
"""Fields that coils and discrete inputs cannot have: they are bits, not numbers."""


def _coil_faults(parameter: Parameter) -> Iterator[tuple[str, str]]:
    """Yield what coils and discrete inputs cannot have."""
    what = "a coil (function 1)" if parameter.function == 1 else "a discrete input (function 2)"
    for item in msgspec.structs.fields(parameter):
        if item.name in NOT_OF_COILS and getattr(parameter, item.name) != item.default:
            yield item.name, f"{what} is 0 or 1 and has no {item.name}."
    if parameter.words > MOST_COILS:
        yield "words", f"at most {MOST_COILS} coils form a word, not {parameter.words}."


FIELDS_OF_TEXTS = frozenset({
    "code", "name", "number", "address", "function", "type", "words", "low_byte_first",
    "low_word_first", "access", "group", "note", "source", "confidence", "storage",
})  # fmt: skip
"""Fields that a text may have."""


def _text_faults(parameter: Parameter) -> Iterator[tuple[str, str]]:
    """Yield what a text cannot have, and what only a text has."""
    if parameter.type != "ascii":
        yield "type", f"words and low_byte_first are for a text (ascii), not for {parameter.type}."
        return
    if parameter.access != "r":
        yield "access", "a text (ascii) is only read: access must be r."
    for item in msgspec.structs.fields(parameter):
        if item.name not in FIELDS_OF_TEXTS and getattr(parameter, item.name) != item.default:
            default = item.default_factory() if callable(item.default_factory) else None
            if getattr(parameter, item.name) != default:
                yield item.name, f"a text (ascii) has no {item.name}."


def texts_are_read(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield places that need a number, and name a text."""
    texts = {parameter.code for parameter in data.parameters if parameter.type == "ascii"}
    for place, code in named_parameters(data) if texts else ():
        if code in texts and place[:2] != ("identification", "registers"):
            yield place, f"{place[0]}: {code} is a text, not a number."


def _has_float_faults(parameter: Parameter) -> bool:
    named = parameter.bits or parameter.values or parameter.enumeration
    return bool(named or parameter.scale_source or parameter.scale == "1")


def _offset_faults(parameter: Parameter) -> Iterator[tuple[str, str]]:
    """Yield what contradicts an offset or a negative scale: it fits a plain measurement only."""
    limited = parameter.min_from or parameter.max_from or parameter.min_of or parameter.max_of
    if parameter.scale_source or limited:
        yield (
            "scale",
            "an offset or a negative scale has neither scale_by, full_scale nor limits of other"
            " parameters.",
        )
    if parameter.quantity in ("command_frequency", "command_speed"):
        yield "scale", "a reference has neither an offset nor a negative scale."


def _number_keys(key: str, names: Iterable[str]) -> Iterator[tuple[str, str]]:
    for raw in names:
        if not raw.lstrip("-").isdecimal() or not raw.isascii():
            yield key, f"{key}: {raw!r} is not a raw value in decimal, such as 0 or 12."


def enumeration_keys(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield keys of shared names that are not raw values."""
    for index, enumeration in enumerate(data.enumerations):
        for key, fault in _number_keys("values", enumeration.values):
            yield ("enumerations", index, key), f"enumeration {enumeration.id}: {fault}"
    for index, chart in enumerate(data.charts):
        if chart.channel:
            for _, fault in _number_keys("names", chart.channel.names):
                yield ("charts", index, "channel"), f"chart {chart.id}: channel: {fault}"


def fault_help(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield help on a missing fault, a second help on a fault, and wrong references in it."""
    rows = data.faults.help
    for place, fault in help_findings(data, HelpData(faults=rows)) if rows else ():
        yield ("faults", "help", place[1]), fault


def no_site(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield parameters and commands that claim what only evidence of this site can prove."""
    for index, chart in enumerate(data.charts):
        for place, order in enumerate(chart.orders):
            if order.confidence == "site":
                yield (
                    ("charts", index, "orders", place, "confidence"),
                    f"command {order.name}: site is proved by evidence, not by a profile.",
                )
    for index, parameter in enumerate(data.parameters):
        if parameter.confidence == "site":
            yield (
                ("parameters", index, "confidence"),
                f"parameter {parameter.code}: site is proved by evidence, not by a profile.",
            )


PARAMETER_RULES = (unique_names, fields, texts_are_read, enumeration_keys, fault_help, no_site)
