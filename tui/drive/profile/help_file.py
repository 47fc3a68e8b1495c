"""Help of a family's faults and alarms, read on first use.

It has its own file, so that a profile stays readable and a drive is displayed without loading it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import TypeVar

import msgspec

from tui.drive.sentences import sentence

from ..errors import ProfileError
from .converting import converted
from .schema import AlarmHelp, CauseRule, FaultHelp, HelpData, Hint, Parameter, ProfileData
from .shared_rows import SourceText, parsed, source_text
from .toml_lines import TomlPath

FOLDER = "help"
HelpPlace = tuple[str, int]
"""The place of a row in a help file: table and index."""


def read_help(data: ProfileData, folders: tuple[Path, ...]) -> HelpData:
    """Read the help on a family's faults: its own rows before those of its help file.

    `folders` contain profiles; the first help file in their folders `help` is used. The first
    folder is that of the profile. From a help file of another folder, rows that do not fit are
    omitted, because it belongs to another edition. Raises ProfileError with each fault, file and
    line.
    """
    name = (data.faults.help_file or data.profile.id) + ".toml"
    found = next((f / FOLDER / name for f in folders if (f / FOLDER / name).is_file()), None)
    if found is None:
        return HelpData(faults=list(data.faults.help))
    source = source_text(found)
    reported = decode_tables(source, HelpData)
    findings = list(help_findings(data, reported))
    if findings and found.parent.parent == folders[0]:
        lines = [f"{found}:{line_of(source, place)}: {fault}" for place, fault in findings]
        raise ProfileError("\n".join(lines))
    wrong = {place for place, _ in findings}
    own = {fault_help.raw for fault_help in data.faults.help}
    faults = [
        fault_help
        for index, fault_help in enumerate(reported.faults)
        if fault_help.raw not in own and ("faults", index) not in wrong
    ]
    alarms = [
        alarm_help
        for index, alarm_help in enumerate(reported.alarms)
        if ("alarms", index) not in wrong
    ]
    return HelpData(faults=[*data.faults.help, *faults], alarms=alarms)


def help_findings(data: ProfileData, reported: HelpData) -> Iterator[tuple[HelpPlace, str]]:
    """Return the rows of a help file that do not fit the profile, each with the reason."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for place, label, hint in _hints(reported):
        for look in hint.look_at:
            if look.code not in parameters:
                yield place, f"{label}: look_at: there is no parameter {look.code!r}."
        for key in ("ruled_out", "supported"):
            for row in getattr(hint, key):
                for fault in _rule_faults(row, parameters, hint, key):
                    yield place, f"{label}: {key}: {fault}"
    yield from _faults(data, reported)
    yield from _alarms(data, reported)


def _rule_faults(
    row: CauseRule, parameters: Mapping[str, Parameter], hint: Hint, key: str
) -> Iterator[str]:
    """Yield what is wrong with a rule of the list `key`; only `ruled_out` may refer to checks."""
    if row.text not in (*hint.probable, *(hint.check if key == "ruled_out" else ())):
        if key == "supported":
            yield f"{row.text!r} is not in probable."
        else:
            yield f"{row.text!r} is not in probable or check."
    if unknown := [code for code in row.codes if code not in parameters]:
        yield from (f"there is no parameter {code!r}." for code in dict.fromkeys(unknown))
        return
    if not row.has_condition:
        yield f"the rule for {row.text!r} has no values and no limits."
    unit = parameters[row.parameter].unit
    limits = [limit for limit in row.of if limit is not None]
    if not unit and (limits or row.at_least is not None or row.at_most is not None):
        yield f"{row.parameter} has no unit: use values, or min and max."
    for limit in limits:
        if unit and (other := parameters[limit.parameter].unit) != unit:
            yield f"{row.parameter} in {unit} cannot be compared with {limit.parameter} in {other}."
    low, high = row.at_least, row.at_most
    if low is not None and high is not None and Decimal(low) > Decimal(high):
        yield f"at_least {low} is above at_most {high}."


def _hints(reported: HelpData) -> Iterator[tuple[HelpPlace, str, Hint]]:
    """All contents of a help file, with their place and name."""
    for index, fault in enumerate(reported.faults):
        yield ("faults", index), _label(fault), fault
    for index, alarm in enumerate(reported.alarms):
        yield ("alarms", index), _label(alarm), alarm


def _label(hint: FaultHelp | AlarmHelp) -> str:
    if isinstance(hint, AlarmHelp):
        return f"help of alarm {hint.word} bit {hint.bit}"
    return f"help of fault {hint.raw} {hint.code}".rstrip()


def _faults(data: ProfileData, reported: HelpData) -> Iterator[tuple[HelpPlace, str]]:
    known = {fault.raw: fault.code for fault in data.faults.codes}
    seen: set[int | None] = set()
    for index, fault in enumerate(reported.faults):
        place: HelpPlace = ("faults", index)
        if fault.raw in seen:
            yield place, f"{_label(fault)}: there are two."
        seen.add(fault.raw)
        code = known.get(fault.raw) if fault.raw is not None else ""
        if fault.raw is None and known:
            yield place, f"{_label(fault)}: raw is missing."
        elif code is None:
            yield place, f"{_label(fault)}: there is no such fault."
        elif fault.raw is not None and fault.code not in ("", code):
            yield place, f"{_label(fault)}: the profile calls it {code}."


def _alarms(data: ProfileData, reported: HelpData) -> Iterator[tuple[HelpPlace, str]]:
    bits = {p.code: {bit.bit for bit in p.bits} for p in data.parameters}
    seen: set[tuple[str, int]] = set()
    for index, alarm in enumerate(reported.alarms):
        place: HelpPlace = ("alarms", index)
        if (alarm.word, alarm.bit) in seen:
            yield place, f"{_label(alarm)}: there are two."
        seen.add((alarm.word, alarm.bit))
        if alarm.bit not in bits.get(alarm.word, set()):
            yield place, f"{_label(alarm)}: there is no such bit."


T = TypeVar("T")


def decode_tables(source: SourceText, form: type[T]) -> T:
    """Decode a TOML text into a form; raises ProfileError with each fault, its file and line."""
    tables = parsed(source)
    try:
        data: T = converted(tables, form)
    except msgspec.ValidationError as error:
        from .form import form_faults, place_label

        found = form_faults(tables, form)[0].found or [((), str(error))]
        lines = [
            f"{source.file}:{line_of(source, path)}: {place_label(tables, path)}: {sentence(fault)}"
            for path, fault in found
        ]
        raise ProfileError("\n".join(lines)) from error
    return data


def line_of(source: SourceText, path: TomlPath) -> int:
    """Return the line of a place, or of the row that contains it."""
    for length in range(len(path), -1, -1):
        if (line := source.lines.get(path[:length])) is not None:
            return line
    return 1
