"""Rules for signal paths: each switch has all its contacts, each source a name or a parameter."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from tui.drive.values import is_enumeration

from ..schema import PathSource, PathSwitch, ProfileData
from ..toml_lines import TomlPath

ValueNames = dict[str, dict[str, str]]
"""ValueNames of raw values by the code of their parameter, for enumerations only."""


def signal_paths(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield errors in the sources and the switches of the signal paths."""
    enumerations = {row.id: row.values for row in data.enumerations}
    names = {
        parameter.code: {**enumerations.get(parameter.enumeration, {}), **parameter.values}
        for parameter in data.parameters
        if is_enumeration(parameter)
    }
    known = {source.id for source in data.sources}
    for index, path in enumerate(data.signal_paths):
        at: TomlPath = ("signal_paths", index)
        if path.source.partition(" ")[0].rstrip(";:,") not in known:
            text = f"path {path.id}: its source begins with the id of a document."
            yield (*at, "source"), f"{text} Known: {', '.join(sorted(known)) or 'none'}."
        for text in _source_faults(path.first, names):
            yield (*at, "first"), f"path {path.id}: {text}"
        for place, switch in enumerate(path.switches):
            for text in _switch_faults(switch, names):
                yield (*at, "switches", place), f"path {path.id}: switch {switch.name}: {text}"


def _source_faults(source: PathSource, names: ValueNames) -> Iterator[str]:
    if bool(source.name) == bool(source.parameter):
        yield "a source has either a name or a parameter that selects it."
    elif source.name and (source.line or source.names or source.words):
        yield f"{source.name}: `line`, `names` and `words` are for a source with a parameter."
    elif source.parameter and (source.is_line or source.word):
        yield f"{source.parameter}: `is_line` and `word` are for a source with a name."
    keys = (*source.names, *source.words)
    if wrong := [key for key in keys if not key.lstrip("-").isdecimal()]:
        yield f"{wrong[0]!r} is not a raw value in decimal."
    if source.mask == 0xFFFF and not source.shift:
        values = (*(str(raw) for raw in source.line), *source.words)
        yield from _unknown_values(source.parameter, values, names)


def _switch_faults(switch: PathSwitch, names: ValueNames) -> Iterator[str]:
    yield from _source_faults(switch.other, names)
    yield from _unknown_values(switch.parameter, switch.names, names)
    reached = {position.contact for position in switch.positions}
    for contact in {0, 1} - reached:
        yield f"no position connects contact {contact}."
    for position in switch.positions[:-1]:
        if not position.when:
            yield "a position without conditions must be the last one."
    for position in switch.positions:
        for when in position.when:
            if when.mask is None:
                yield from _unknown_values(when.parameter, map(str, when.values), names)


def _unknown_values(code: str, values: Iterable[str], names: ValueNames) -> Iterator[str]:
    own = names.get(code)
    for value in values if own else ():
        if own is not None and value not in own:
            yield f"{code} has no value {value}."


PATH_RULES = (signal_paths,)
"""Rules for signal paths."""
