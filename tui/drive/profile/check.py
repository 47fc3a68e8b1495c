"""Validation of a profile: its form, and the rules that a form cannot express."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from tui.drive.sentences import sentence

from ..errors import ProfileError
from .address_rule import fill_addresses
from .converting import converted
from .rules import RULES, Finding, Rules
from .rules.hints import HINT_RULES
from .schema import ProfileData
from .shared_rows import ProfileTables, read_tables
from .toml_lines import TomlPath

FAULTS_LISTED = 10
"""Most faults in the error of a profile that cannot be loaded; a check lists all."""


@dataclass(frozen=True, slots=True)
class ProfileFault:
    """One fault, and its place."""

    file: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.text}"


def checked_data(path: Path, packaged: Path) -> ProfileData:
    """Load a profile file; raises ProfileError with its first faults."""
    data, faults = examined(path, packaged)
    if faults or data is None:
        lines = [str(fault) for fault in faults[:FAULTS_LISTED]]
        if len(faults) > FAULTS_LISTED:
            lines.append(
                f"... and {len(faults) - FAULTS_LISTED} more faults; profiles --check lists all."
            )
        raise ProfileError("\n".join(lines))
    return data


def examined(
    path: Path, packaged: Path, rules: Rules = RULES
) -> tuple[ProfileData | None, list[ProfileFault]]:
    """Return the data of a profile file, and all its faults by line.

    The data is None if the form is wrong. `packaged` is the folder of the profiles that come with
    the panel. Raises ProfileError if the file cannot be read, or is not valid TOML.
    """
    sources = read_tables(path, packaged)
    if by_rule := fill_addresses(sources.tables):
        # without their addresses, every other check of these rows would be wrong
        return None, _in_order(_placed(sources, by_rule))
    try:
        data: ProfileData = converted(sources.tables, ProfileData)
    except msgspec.ValidationError:
        return None, _faults_of_form(sources, rules)
    return data, _in_order(_placed(sources, _broken_rules(data, rules)))


def hints_in(path: Path, packaged: Path) -> list[ProfileFault]:
    """Return the probable mistakes of a profile without faults, by line. Raises ProfileError."""
    sources = read_tables(path, packaged)
    fill_addresses(sources.tables)
    data: ProfileData = converted(sources.tables, ProfileData)
    found = [hint for rule in HINT_RULES for hint in rule(data, sources.tables)]
    return _in_order(_placed(sources, found))


def _faults_of_form(sources: ProfileTables, rules: Rules) -> list[ProfileFault]:
    """Return the faults of form, and the other faults that can still be found."""
    from .form import form_faults, place_label

    form, mended = form_faults(sources.tables)
    reported = [
        (path, f"{place_label(sources.tables, path)}: {sentence(text)}")
        for path, text in _missing_addresses_once(form.found)
    ]
    try:
        data: ProfileData = converted(mended, ProfileData)
    except msgspec.ValidationError as error:
        reported = reported or [((), f"the file: {error}.")]
    else:
        broken = _broken_rules(data, rules)
        reported += [rule for rule in broken if not _invented(rule[0], form.invented)]
    return _in_order(_placed(sources, reported))


NO_ADDRESS = "the field `address` is missing"


def _missing_addresses_once(found: list[tuple[TomlPath, str]]) -> Iterator[tuple[TomlPath, str]]:
    """Yield faults of form, with one for all parameters without an address."""
    lacking = [item for item in found if item[0][:1] == ("parameters",) and NO_ADDRESS in item[1]]
    for path, text in found:
        if len(lacking) < 2 or (path, text) not in lacking:
            yield path, text
        elif path == lacking[0][0]:
            yield (
                path,
                f"{NO_ADDRESS} in {len(lacking)} rows. Give each a number from 0 to 65535, or one"
                " rule for all as address of [profile], such as '10 * number - 1'",
            )


def _invented(path: TomlPath, invented: list[TomlPath]) -> bool:
    """Return True if a place depends on a value that the file does not have."""
    return any(path[: len(pair)] == pair or pair[: len(path)] == path for pair in invented)


def _broken_rules(data: ProfileData, rules: Rules) -> list[Finding]:
    return [finding for rule in rules for finding in rule(data)]


def _placed(sources: ProfileTables, found: list[tuple[TomlPath, str]]) -> Iterator[ProfileFault]:
    for path, text in found:
        yield ProfileFault(*sources.place(path), text)


def _in_order(faults: Iterator[ProfileFault]) -> list[ProfileFault]:
    return sorted(dict.fromkeys(faults), key=lambda fault: (fault.file, fault.line))
