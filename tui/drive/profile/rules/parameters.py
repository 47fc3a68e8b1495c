"""Rules for each single parameter, and for what must be unique."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from tui.drive.values import raw_range, type_range

from ..help_file import help_findings
from ..schema import HelpData, Parameter, ProfileData
from ..toml_lines import TomlPath


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
    yield from _twice(
        ((("functions", n, "code"), f.code) for n, f in enumerate(data.functions)),
        "function {} is declared twice.",
    )
    yield from _twice(
        ((("faults", "codes", n, "raw"), f.raw) for n, f in enumerate(data.faults.codes)),
        "fault {} occurs twice; a raw code means one fault.",
    )
    for table in ("sources", "enumerations", "charts", "blocks", "control_sources", "signal_paths"):
        rows = getattr(data, table)
        yield from _twice(
            (((table, n, "id"), row.id) for n, row in enumerate(rows)),
            f"id {{}} occurs twice in {table}.",
        )
    yield from _twice(
        ((("groups", n, "name"), g.name) for n, g in enumerate(data.groups)),
        "group {!r} occurs twice.",
    )


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
    if set(parameter.scale) <= {"0", "."}:
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
    long = parameter.type.endswith("32")
    if parameter.mask != 0xFFFF or parameter.shift:
        if long or parameter.type != "uint16":
            yield "type", f"a field of a register (mask, shift) is uint16, not {parameter.type}."
        if parameter.mask << parameter.shift > 0xFFFF:
            yield "mask", "mask, shifted left by shift, exceeds bit 15 of the word."
        if parameter.mask & (parameter.mask + 1):
            yield "mask", "mask must be adjacent ones from bit 0, such as 1, 3, 7, 15."
    if parameter.function == 4 and parameter.access != "r":
        yield "function", "an input register (function 4) can only be read: access must be r."
    if parameter.address + (2 if long else 1) > 0x10000:
        yield "address", "exceeds address 65535."


def _number_keys(key: str, names: dict[str, object] | dict[str, str]) -> Iterator[tuple[str, str]]:
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


PARAMETER_RULES = (unique_names, fields, enumeration_keys, fault_help)
