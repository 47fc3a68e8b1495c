"""Checks of a profile that its schema cannot express: references, duplicates, ranges."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from ..errors import ProfileError
from ..values import raw_range, type_range, word_count
from .decode import source_line
from .help_file import help_findings
from .schema import HelpData, Multiple, Parameter, ProfileData

WORD_FORMS = {
    re.compile(r"16#"): re.compile(r"\b(?=[0-9]*[A-F])[0-9A-F]{4}\b"),
    re.compile(r"W[0-9]"): re.compile(r"\bW[0-9]{3,5}\b"),
    re.compile(r"[0-9]+\.[0-9]"): re.compile(r"\b[0-9]{1,2}\.[0-9]{2}\b"),
}
"""How a text names a word, by how the numbers of a family are written."""

SchemaPath = list[str | int]
Finding = tuple[SchemaPath, str]


def check(data: ProfileData, file: str, text: str) -> None:
    """Raise ProfileError with the first ten faults of a profile, each with its line."""
    findings = [finding for rule in RULES for finding in rule(data)]
    if findings:
        lines = [f"{file}:{source_line(text, place)}: {fault}" for place, fault in findings[:10]]
        if len(findings) > 10:
            lines.append(f"... and {len(findings) - 10} more faults.")
        raise ProfileError("\n".join(lines))


def _unique_codes(data: ProfileData) -> Iterator[Finding]:
    for key in ("code", "address"):
        seen: dict[object, str] = {}
        for index, parameter in enumerate(data.parameters):
            value = getattr(parameter, key)
            if value in seen:
                yield (
                    ["parameters", index],
                    f"parameter {parameter.code}: {key} {value} is already that of {seen[value]}.",
                )
            seen.setdefault(value, parameter.code)


def _unique_quantities(data: ProfileData) -> Iterator[Finding]:
    seen: dict[str, str] = {}
    for index, parameter in enumerate(data.parameters):
        if parameter.quantity is None:
            continue
        if parameter.quantity in seen:
            yield (
                ["parameters", index, "quantity"],
                f"parameter {parameter.code}: {parameter.quantity} is already "
                f"{seen[parameter.quantity]}.",
            )
        seen.setdefault(parameter.quantity, parameter.code)


def _parameter_fields(data: ProfileData) -> Iterator[Finding]:
    sources = {source.id for source in data.sources}
    enumerations = {enumeration.id for enumeration in data.enumerations}
    for index, parameter in enumerate(data.parameters):
        for fault in _faults_of(parameter, sources, enumerations):
            yield ["parameters", index], f"parameter {parameter.code}: {fault}"


def _faults_of(parameter: Parameter, sources: set[str], enumerations: set[str]) -> Iterator[str]:
    low, high = type_range(parameter)
    minimum, maximum = raw_range(parameter)
    if not (low <= minimum <= high and low <= maximum <= high):
        yield f"range {minimum}..{maximum} does not fit {parameter.type}."
    if minimum > maximum:
        yield f"min {minimum} is above max {maximum}."
    if parameter.factory is not None and not low <= parameter.factory <= high:
        yield f"factory {parameter.factory} does not fit {parameter.type}."
    if set(parameter.scale) <= {"0", "."}:
        yield "scale is 0."
    if parameter.enumeration and parameter.enumeration not in enumerations:
        yield f"there is no enumeration {parameter.enumeration!r}."
    for source in _sources_of(parameter):
        if source.split()[0].rstrip(",;:") not in sources:
            yield f"source {source!r} does not begin with the id of a source."
    for raw in parameter.values:
        if not raw.lstrip("-").isdecimal():
            yield f"value {raw!r} is not a raw value in decimal."
    numbers = [bit.bit for bit in parameter.bits]
    if len(numbers) != len(set(numbers)):
        yield "a bit is named twice."
    if parameter.address + word_count(parameter) > 0x10000:
        yield "runs past address 65535."


def _sources_of(parameter: Parameter) -> tuple[str, ...]:
    """What the row, its limits and its factory setting rest on."""
    grounds = (parameter.limit_grounds, parameter.factory_grounds)
    return (parameter.source, *(one.source for one in grounds if one is not None))


def _enumeration_keys(data: ProfileData) -> Iterator[Finding]:
    for index, enumeration in enumerate(data.enumerations):
        for raw in enumeration.values:
            if not raw.lstrip("-").isdecimal():
                yield (
                    ["enumerations", index],
                    f"enumeration {enumeration.id}: {raw!r} is not a raw value in decimal.",
                )


def _references(data: ProfileData) -> Iterator[Finding]:
    codes = {parameter.code for parameter in data.parameters}
    for place, code in _referred(data):
        if code and code not in codes:
            yield place, f"{place[0]}: there is no parameter {code!r}."


def _referred(data: ProfileData) -> Iterator[tuple[SchemaPath, str]]:
    """Every place that names a parameter, with the code it names."""
    for index, parameter in enumerate(data.parameters):
        for code in _named_by(parameter):
            yield ["parameters", index], code
    for index, block in enumerate(data.blocks):
        for code in (*block.slots, *block.values, *(c.parameter for c in block.choices)):
            yield ["blocks", index], code
    for index, chart in enumerate(data.charts):
        marks = (
            chart.direction,
            chart.reached,
            chart.alarm,
            chart.local,
            chart.channel,
            chart.when,
        )
        ordered = [o.parameter for o in chart.orders]
        ordered += [when.parameter for o in chart.orders for when in o.when]
        ordered += [code for o in chart.orders for code in o.clears]
        ordered += [lock.parameter for lock in chart.interlocks]
        ordered += [when.parameter for lock in chart.interlocks for when in lock.when]
        ordered += [option.parameter for option in chart.options]
        for code in (chart.status, chart.command, *(m.parameter for m in marks if m), *ordered):
            yield ["charts", index], code
    for index, reference in enumerate(data.references):
        yield ["references", index], reference.parameter
        yield ["references", index], reference.feedback
    for index, teachable in enumerate(data.teachable_references):
        yield ["teachable_references", index], teachable.parameter
        yield ["teachable_references", index], teachable.most
    for table, codes in _named_in_tables(data).items():
        for code in codes:
            yield [table], code


def _named_by(parameter: Parameter) -> tuple[str, ...]:
    return (
        parameter.min_from,
        parameter.max_from,
        parameter.rating,
        parameter.scale_by.parameter if parameter.scale_by else "",
        parameter.unit_by.parameter if parameter.unit_by else "",
        parameter.factory_by.parameter if parameter.factory_by else "",
        *(of.parameter for of in _multiples(parameter)),
    )


def _multiples(parameter: Parameter) -> tuple[Multiple, ...]:
    """All that is so many times another parameter."""
    found = (parameter.min_of, parameter.max_of, parameter.factory_of)
    return tuple(one for one in found if one is not None)


def _named_in_tables(data: ProfileData) -> dict[str, list[str]]:
    """Codes named in the tables of which a profile has one."""
    values = data.monitoring.values
    ends = (end for value in values for end in (value.low, value.high))
    speed, watch = data.monitoring.speed_from, data.communication_fault
    return {
        "monitoring": [
            *(value.parameter for value in values),
            *(end for end in ends if not end.lstrip("-").replace(".", "").isdecimal()),
            *((speed.frequency, speed.poles, speed.result) if speed else ()),
        ],
        "faults": [
            data.faults.parameter,
            *data.faults.history,
            *(code for stored in data.faults.stored for code in stored),
            data.faults.reset_ready.parameter if data.faults.reset_ready else "",
        ],
        "link": [setting.parameter for setting in data.link.settings],
        "communication_fault": [watch.timeout, watch.reaction] if watch else [],
        "memory": [
            code
            for order in (data.memory.save, data.memory.factory)
            if order is not None
            for code in (order.parameter, order.groups)
        ],
        "start_up": [code for step in data.start_up for code in step.parameters],
        "control_sources": [s.parameter for c in data.control_sources for s in c.settings],
        "channels": [code for told in _channel_words(data) for code in told],
        "identification": [
            data.identification.model_parameter,
            data.identification.class_parameter,
        ],
        "addresses": [server.parameter for server in data.addresses.servers],
    }


def _written_words(data: ProfileData) -> Iterator[Finding]:
    """Words that the texts of control sources name by their numbers."""
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
                place: SchemaPath = ["control_sources", index]
                yield place, f"control source {source.id}: there is no word {word}."


def _states(data: ProfileData) -> Iterator[Finding]:
    for index, chart in enumerate(data.charts):
        ids = {state.id for state in chart.states}
        for transition in chart.transitions:
            for state in (transition.source, transition.target):
                if state not in ids:
                    yield ["charts", index], f"chart {chart.id}: there is no state {state!r}."
        for order in chart.orders:
            for state in order.states:
                if state not in ids:
                    yield ["charts", index], f"order {order.id}: there is no state {state!r}."
            if not order.words or not (order.parameter or chart.command):
                yield ["charts", index], f"order {order.id}: nothing to write, or nowhere."
        for state_ in chart.states:
            if state_.value & ~state_.mask:
                yield (
                    ["charts", index],
                    f"chart {chart.id}: state {state_.id} has value bits outside its mask.",
                )


def _channel_words(data: ProfileData) -> Iterator[tuple[str, ...]]:
    channels = data.channels
    for row in (*channels.command, *channels.reference):
        yield row.parameter, *(when.parameter for when in row.when)
    for switch in channels.switches:
        yield switch.parameter, *(when.parameter for when in switch.when)


def _functions(data: ProfileData) -> Iterator[Finding]:
    codes = [function.code for function in data.functions]
    for index, code in enumerate(codes):
        if code in codes[:index]:
            yield ["functions", index], f"function {code} is declared twice."
    if 3 not in codes:
        yield ["functions"], "function 3 is missing: nothing could be read."


def _fault_help(data: ProfileData) -> Iterator[Finding]:
    rows = data.faults.help
    for place, fault in help_findings(data, HelpData(faults=rows)) if rows else ():
        yield ["faults", "help", place[1]], fault


def _scales(data: ProfileData) -> Iterator[Finding]:
    for index, parameter in enumerate(data.parameters):
        if parameter.scale_by and not parameter.scale_by.scales:
            yield ["parameters", index], f"parameter {parameter.code}: scale_by has no scales."


def _factory_settings(data: ProfileData) -> Iterator[Finding]:
    """Factory settings that follow another parameter, against that one's own factory setting."""
    factory = {p.code: p.factory for p in data.parameters}
    for index, parameter in enumerate(data.parameters):
        by = parameter.factory_by
        place: SchemaPath = ["parameters", index, "factory_by"]
        if by is None:
            continue
        for raw in by.raws:
            if not raw.lstrip("-").isdecimal():
                yield place, f"parameter {parameter.code}: {raw!r} is not a raw value in decimal."
        if by.raws.get(str(factory.get(by.parameter))) != parameter.factory:
            yield (
                place,
                f"parameter {parameter.code}: factory is not what factory_by gives for the"
                f" factory setting of {by.parameter}.",
            )


def _start_up(data: ProfileData) -> Iterator[Finding]:
    seen: dict[str, str] = {}
    for index, step in enumerate(data.start_up):
        for code in step.parameters:
            if code in seen:
                yield (
                    ["start_up", index],
                    f"step {step.step}: {code} stands in step {seen[code]} already.",
                )
            seen.setdefault(code, step.step)


RULES: tuple[Callable[[ProfileData], Iterator[Finding]], ...] = (
    _unique_codes,
    _unique_quantities,
    _parameter_fields,
    _enumeration_keys,
    _references,
    _states,
    _functions,
    _fault_help,
    _scales,
    _factory_settings,
    _start_up,
    _written_words,
)
