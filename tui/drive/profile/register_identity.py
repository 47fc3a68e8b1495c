"""Families that registers identify, and what makes two families look alike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from tui.drive.values import is_enumeration, raw_range
from tui.drive.words import characters_of

from ..errors import ProfileError
from . import library
from .profile import Profile
from .schema import IdentityRegister, Parameter
from .shared_rows import read_tables
from .toml_lines import TomlPath


class RegisterIdentity(NamedTuple):
    """Registers that identify the drives of one family."""

    profile: str
    prefixes: tuple[str, ...]
    rows: tuple[tuple[Parameter, IdentityRegister], ...]
    """Parameters and what they contain; all must fit."""
    others: Mapping[int, tuple[str, ...]]
    """Profiles whose drives may contain these values too, by the address of their status word.
    Drives of this family do not have it."""


def register_identities() -> tuple[RegisterIdentity, ...]:
    """Return the families that registers identify for sure; reads files."""
    listed = (*library.listings(), *library.public_listings())
    if not any(library.identification_of(listing).registers for listing in listed):
        return ()
    known = _known_profiles()
    found = []
    for profile in known:
        rows, words = _rows(profile), dict[int | None, tuple[str, ...]]()
        for other in alike(profile, known):
            word = _telling_word(profile, other)
            words[word] = (*words.get(word, ()), other.id)
        if rows and None not in words:
            prefixes = tuple(profile.data.identification.reference_prefixes)
            others = {word: ids for word, ids in words.items() if word is not None}
            found.append(RegisterIdentity(profile.id, prefixes, rows, others))
    return tuple(found)


def _known_profiles() -> list[Profile]:
    """Return the profiles whose drives do not report their reference."""
    found = []
    for listing in (*library.listings(), *library.public_listings()):
        identification = library.identification_of(listing)
        if identification.prefixes and not identification.registers:
            continue
        try:
            found.append(library.load(listing.id))
        except ProfileError:
            continue  # reported when it is chosen
    return found


def _rows(profile: Profile) -> tuple[tuple[Parameter, IdentityRegister], ...]:
    rows = profile.data.identification.registers
    return tuple((profile[row.parameter], row) for row in rows)


def row_fits(parameter: Parameter, row: IdentityRegister, raw: int | None) -> bool:
    """Return True if a register contains what identifies the family."""
    if raw is None or not row.begins:
        return raw in row.values
    return _begins(characters_of(parameter, raw), row.begins)


def _begins(text: str, beginnings: Sequence[str]) -> bool:
    return text.upper().startswith(tuple(beginning.upper() for beginning in beginnings))


def alike(profile: Profile, known: list[Profile]) -> list[Profile]:
    """Return the other families whose drives may contain all identifying values of a profile.

    Families that report their reference are not among them.
    """
    rows = _rows(profile)
    return [
        other
        for other in known
        if rows
        and other.id != profile.id
        and not other.data.identification.reference_prefixes
        and all(_may_contain(other, parameter, row) for parameter, row in rows)
    ]


def _may_contain(other: Profile, parameter: Parameter, row: IdentityRegister) -> bool:
    """Return True if a drive of another family may have one of these values at that address."""
    held = other.at(parameter.address, parameter.function)
    if held is None:
        reading = other.data.reading
        return reading.gaps_readable and reading.unknown_word in row.values
    for own, own_row in _rows(other):
        if own.code == held.code:
            texts = any(_begins(text, row.begins) for text in own_row.begins)
            texts = texts or any(_begins(text, own_row.begins) for text in row.begins)
            return texts or bool(set(own_row.values) & set(row.values))
    if row.begins:
        return held.type == "ascii"
    if is_enumeration(held):
        return bool(set(row.values) & set(other.names(held)))
    low, high = raw_range(held)
    return any(low <= raw <= high for raw in row.values)


def _telling_word(profile: Profile, other: Profile) -> int | None:
    """Return the address of another family's status word, which drives of a profile lack."""
    status = other.quantity("status_word")
    if status is None or status.function != 3:
        return None
    has_it = profile.data.reading.gaps_readable or profile.at(status.address) is not None
    return None if has_it else status.address


def shared_identification(path: Path) -> list[str]:
    """Return what makes drives of a correct profile look like those of another, by line."""
    findings = list(_findings(library.load_file(path)))
    tables = read_tables(path, library.packaged_folder()) if findings else None
    return [f"{':'.join(map(str, tables.place(at)))}: {text}" for at, text in findings if tables]


def _findings(profile: Profile) -> Iterator[tuple[TomlPath, str]]:
    """Yield where other profiles identify drives like this one, or contain its values."""
    identification = profile.data.identification
    own = {prefix.upper() for prefix in identification.reference_prefixes}
    for listing in (*library.listings(), *library.public_listings()) if own else ():
        prefixes = {prefix.upper() for prefix in library.identification_of(listing).prefixes}
        if listing.id != profile.id and (both := sorted(own & prefixes)):
            yield (
                ("identification", "reference_prefixes"),
                f"identification: the profile {listing.id} has the prefix {both[0]!r} too. A drive"
                " with it stays unknown.",
            )
    for other in alike(profile, _known_profiles()) if identification.registers else ():
        at = ("identification", "registers")
        if other.data.identification.registers:
            yield (
                at,
                f"identification: the profile {other.id} has the same registers and values. A"
                " drive with them stays unknown.",
            )
        elif _telling_word(profile, other) is None:
            yield (
                at,
                f"identification: drives of {other.id} may contain these values too. Add a"
                " register that differs.",
            )
