"""Rules for limits and for values that a profile proposes."""

from __future__ import annotations

from collections.abc import Iterator

from tui.drive.values import is_enumeration, raw_range, type_range

from ..schema import Parameter, ProfileData
from ..toml_lines import TomlPath


def circles(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield limits that form a circle, and scales that depend on each other."""
    known = {parameter.code for parameter in data.parameters}
    above: dict[str, set[str]] = {}
    follows: dict[str, set[str]] = {}
    for parameter in data.parameters:
        if parameter.max_from in known:
            above.setdefault(parameter.code, set()).add(parameter.max_from)
        if parameter.min_from in known:
            above.setdefault(parameter.min_from, set()).add(parameter.code)
        if parameter.scale_by and parameter.scale_by.parameter in known:
            follows.setdefault(parameter.code, set()).add(parameter.scale_by.parameter)
    for index, parameter in enumerate(data.parameters):
        if way := _circle(above, parameter.code):
            key = "max_from" if parameter.max_from else "min_from"
            yield (
                ("parameters", index, key),
                f"parameter {parameter.code}: its limits form a circle: {' <= '.join(way)}.",
            )
        if way := _circle(follows, parameter.code):
            yield (
                ("parameters", index, "scale_by"),
                f"parameter {parameter.code}: its scale depends on itself: {' -> '.join(way)}.",
            )


def _circle(ways: dict[str, set[str]], start: str) -> list[str]:
    """Return a way from a code back to itself; empty if there is none."""
    open_ways = [[start]]
    seen: set[str] = set()
    while open_ways:
        way = open_ways.pop()
        for code in sorted(ways.get(way[-1], ())):
            if code == start:
                return [*way, code]
            if code not in seen:
                seen.add(code)
                open_ways.append([*way, code])
    return []


def proposed_values(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield values of the profile that their parameter cannot hold."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    names = {enumeration.id: enumeration.values for enumeration in data.enumerations}
    for place, code, raw in _proposed(data):
        parameter = parameters.get(code)
        if parameter is None:
            continue
        own = {**names.get(parameter.enumeration, {}), **parameter.values}
        if fault := _refused(parameter, raw, own):
            yield place, f"{code} = {raw}: {fault}"


def _proposed(data: ProfileData) -> Iterator[tuple[TomlPath, str, int]]:
    for index, source in enumerate(data.control_sources):
        for place, setting in enumerate(source.settings):
            yield ("control_sources", index, "settings", place), setting.parameter, setting.value
    yield from _line_numbers(data)
    for key, order in (("save", data.memory.save), ("factory", data.memory.factory)):
        if order is not None and not order.bit:
            yield ("memory", key, "raw"), order.parameter, order.raw
    if (enter := data.memory.enter) is not None:
        yield ("memory", "enter", "raw"), enter.parameter, enter.raw
    for index, parameter in enumerate(data.parameters):
        if parameter.factory is not None and is_enumeration(parameter):
            yield ("parameters", index, "factory"), parameter.code, parameter.factory


def _line_numbers(data: ProfileData) -> Iterator[tuple[TomlPath, str, int]]:
    for index, setting in enumerate(data.link.settings):
        at: TomlPath = ("link", "settings", index)
        if setting.factory is not None:
            yield (*at, "factory"), setting.parameter, setting.factory
        for place, choice in enumerate(setting.choices):
            yield (*at, "choices", place), setting.parameter, choice.raw
    if watch := data.communication_fault:
        if watch.off is not None:
            yield ("communication_fault", "off"), watch.timeout, watch.off
        for place, reaction in enumerate(watch.reactions):
            yield ("communication_fault", "reactions", place), watch.reaction, reaction.raw


def _refused(parameter: Parameter, raw: int, names: dict[str, str]) -> str:
    """Return why a parameter cannot hold a raw value; empty if it can."""
    if str(raw) in names:
        return ""
    low, high = type_range(parameter)
    # a word may be written as it is on the wire, whatever its sign
    if not low <= raw <= high and not 0 <= raw <= 0xFFFF:
        return f"does not fit {parameter.type}: {low} to {high}."
    if names and is_enumeration(parameter):
        reported = ", ".join(f"{key} {text}" for key, text in names.items())
        return f"is not one of its values: {reported}."
    least, most = raw_range(parameter)
    if not least <= raw <= most:
        return f"is outside its limits, {least} to {most}."
    return ""


def factory_settings(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield factory settings that contradict the other parameter's own factory setting."""
    factory = {p.code: p.factory for p in data.parameters}
    for index, parameter in enumerate(data.parameters):
        by = parameter.factory_by
        if by is None:
            continue
        place: TomlPath = ("parameters", index, "factory_by")
        for raw in by.raws:
            if not raw.lstrip("-").isdecimal():
                yield place, f"parameter {parameter.code}: {raw!r} is not a raw value in decimal."
        if by.raws.get(str(factory.get(by.parameter))) != parameter.factory:
            yield (
                place,
                f"parameter {parameter.code}: factory differs from the value of factory_by for"
                f" the factory setting of {by.parameter}.",
            )


def start_up(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield parameters that are in two steps of the first commissioning."""
    seen: dict[str, str] = {}
    for index, step in enumerate(data.start_up):
        for code in step.parameters:
            if code in seen:
                yield (
                    ("start_up", index),
                    f"step {step.step}: {code} is already in step {seen[code]}.",
                )
            seen.setdefault(code, step.step)


def full_scales(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield full scales of another unit, or from a parameter without a scale of its own."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, parameter in enumerate(data.parameters):
        full = parameter.full_scale
        source = parameters.get(full.parameter) if full is not None else None
        if source is None:
            continue
        at: TomlPath = ("parameters", index, "full_scale")
        start = f"parameter {parameter.code}: its full scale {source.code}"
        if parameter.scale != "1" or parameter.scale_by is not None:
            yield at, f"parameter {parameter.code}: it has full_scale, so omit scale and scale_by."
        bent = source.offset != "0" or source.scale.startswith("-")
        if source.scale_source or source.unit_by or bent or source.access == "w":
            yield at, f"{start} must be readable, with a scale and a unit that never change."
        if not parameter.unit or parameter.unit != source.unit:
            own, other = parameter.unit or "none", source.unit or "none"
            yield at, f"{start} has the unit {other}, and its own unit is {own}. Both are the same."


def signed_references(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield references with a sign for the direction whose word or command contradicts that."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, way in enumerate(data.references):
        word = parameters.get(way.parameter)
        if way.reverse != "negative" or word is None:
            continue
        at: TomlPath = ("references", index, "reverse")
        if not word.type.startswith("int") or raw_range(word)[0] >= 0:
            yield at, f"reference {word.code}: it holds no negative value. Use type int16 or int32."
        if word.access == "w":
            yield at, f"reference {word.code}: its sign must be readable: access rw."
        for chart in data.charts:
            by_id = {o.id: (o.parameter, o.words) for o in chart.orders}
            if "reverse" in by_id and by_id["reverse"] != by_id.get("forward"):
                yield (
                    at,
                    f"reference {word.code}: its sign gives the direction, but the commands"
                    f" forward and reverse of the chart {chart.id} differ. Give both the same"
                    " words.",
                )


LIMIT_RULES = (full_scales, signed_references, circles, proposed_values, factory_settings, start_up)
