"""Tables of a profile with the rows that it shares with others, and the place of each row.

`profile.rows_from` names files in the folder of the profile. Their tables come first. A row of the
profile with the same key (code, id, raw) changes fields of the shared one. Any other row is added
after the row above it in its file, or at the end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

import tomli

from ..errors import ProfileError
from ..small_file import decoded_text, encoding_fault, read_small
from ..toml_text import toml_tables
from .toml_lines import TomlPath, toml_lines

ROW_KEYS: Mapping[TomlPath, str] = {
    ("sources",): "id",
    ("errata",): "place",
    ("functions",): "code",
    ("blocks",): "id",
    ("exceptions",): "code",
    ("charts",): "id",
    ("command_examples",): "word",
    ("references",): "parameter",
    ("teachable_references",): "parameter",
    ("faults", "codes"): "raw",
    ("faults", "help"): "raw",
    ("control_sources",): "id",
    ("signal_paths",): "id",
    ("start_up",): "step",
    ("predecessors",): "profile",
    ("connectors",): "name",
    ("schematics",): "id",
    ("parts",): "number",
    ("masters",): "name",
    ("groups",): "name",
    ("enumerations",): "id",
    ("parameters",): "code",
}
"""By the place of a list of rows, the field that identifies a row."""


@dataclass(frozen=True)
class SourceText:
    """One file of a profile."""

    file: str
    text: str

    @cached_property
    def lines(self) -> Mapping[TomlPath, int]:
        """Line by path; computed on first use."""
        return toml_lines(self.text)


RowOrigin = tuple[SourceText, TomlPath]


@dataclass(frozen=True)
class ProfileTables:
    """Merged tables of a profile, with the origin of each row."""

    tables: dict[str, Any]
    origins: Mapping[TomlPath, list[RowOrigin]] = field(default_factory=dict)
    """Place of each path; only of rows, if there are several files. The profile's own file comes
    first."""

    def place(self, path: TomlPath) -> tuple[str, int]:
        """Return file and line of a path, or of the row that contains it."""
        for length in range(len(path), -1, -1):
            for source, start in self.origins.get(path[:length], ()):
                if (line := source.lines.get((*start, *path[length:]))) is not None:
                    return source.file, line
        for length in range(len(path), -1, -1):
            for source, start in self.origins.get(path[:length], ()):
                for rest in range(len(path), length - 1, -1):
                    line = source.lines.get((*start, *path[length:rest]))
                    if line is not None:
                        return source.file, line
        return "", 1


def read_tables(path: Path, packaged: Path) -> ProfileTables:
    """Return the tables of a profile file with its shared rows; raises ProfileError.

    `packaged` is the folder that is searched for shared rows if the profile's folder lacks them.
    """
    own = source_text(path)
    tables = parsed(own)
    head = tables.get("profile")
    names = head.get("rows_from", []) if isinstance(head, dict) else []
    merging = _Merging()
    if not isinstance(names, list) or not names:
        merging.origins[()] = [(own, ())]
        return ProfileTables(_word_order(tables), merging.origins)
    whole: dict[str, Any] = {}
    for name in names:
        shared = source_text(_shared_file(own, path, packaged, name))
        merging.into(whole, parsed(shared), shared, (), ())
    without = head.get("without", []) if isinstance(head, dict) else []
    merging.drop(whole, without if isinstance(without, list) else [], own)
    merging.into(whole, tables, own, (), ())
    return ProfileTables(_word_order(whole), merging.origins)


def source_text(path: Path) -> SourceText:
    """Read a file; raises ProfileError."""
    try:
        data = read_small(path)
    except OSError as error:
        raise ProfileError(f"{path}: cannot be read: {error.strerror}.") from error
    if fault := encoding_fault(data):
        raise ProfileError(f"{path}:{fault}")
    return SourceText(str(path), decoded_text(data))


def parsed(source: SourceText) -> dict[str, Any]:
    """Parse a text; raises ProfileError with the line if it is not valid TOML."""
    try:
        return toml_tables(source.text)
    except tomli.TOMLDecodeError as error:
        line = getattr(error, "lineno", 1)
        raise ProfileError(f"{source.file}:{line}: not valid TOML: {error}.") from error


def _shared_file(own: SourceText, path: Path, packaged: Path, name: object) -> Path:
    why = f"{name!r} is not a file name in this folder."
    if isinstance(name, str) and not (
        PurePosixPath(name).is_absolute() or ".." in Path(name).parts
    ):
        for folder in (path.parent, packaged):
            if (found := folder / name).is_file():
                return found
        why = f"there is no file {name!r} in the folder."
    # found only now: it reads the whole text again
    line = own.lines.get(("profile", "rows_from"), 1)
    raise ProfileError(f"{own.file}:{line}: rows_from: {why}")


def _word_order(tables: dict[str, Any]) -> dict[str, Any]:
    """Return the tables; 32-bit values without a word order get that of the family."""
    reading, rows = tables.get("reading"), tables.get("parameters")
    order = reading.get("low_word_first") if isinstance(reading, dict) else None
    if isinstance(order, bool) and isinstance(rows, list):
        for row in rows:
            if isinstance(row, dict) and str(row.get("type")).endswith("32"):
                row.setdefault("low_word_first", order)
    return tables


def _key_of(row: Mapping[str, Any], key: str) -> object:
    """Return the key of a row; if it is a list or table, its text, which is reported later."""
    value = row.get(key)
    return repr(value) if isinstance(value, list | dict) else value


class _Merging:
    """Tables of several files merged, later files over earlier ones."""

    def __init__(self) -> None:
        self.origins: dict[TomlPath, list[RowOrigin]] = {}

    def into(
        self,
        whole: dict[str, Any],
        tables: Mapping[str, Any],
        source: SourceText,
        at: TomlPath,
        there: TomlPath,
    ) -> None:
        """Merge one file's table over the present ones, at the same path."""
        self.origins.setdefault(at, []).insert(0, (source, there))
        for key, value in tables.items():
            path = (*at, key)
            held = whole.get(key)
            if path in ROW_KEYS and isinstance(value, list):
                rows = whole[key] = held if isinstance(held, list) else []
                self._rows(rows, value, source, path, (*there, key))
            elif isinstance(value, dict) and not (at and isinstance(at[-1], int)):
                inner = whole[key] = held if isinstance(held, dict) else {}
                self.into(inner, value, source, path, (*there, key))
            else:
                whole[key] = value

    def _rows(
        self,
        rows: list[Any],
        value: list[Any],
        source: SourceText,
        at: TomlPath,
        there: TomlPath,
    ) -> None:
        key = ROW_KEYS[at]
        # rows of one file do not change each other: two with the same key are an error
        index = {_key_of(row, key): n for n, row in enumerate(rows) if isinstance(row, dict)}
        order = list(range(len(rows)))
        above = -1
        for number, row in enumerate(value):
            known = isinstance(row, dict) and _key_of(row, key) in index
            place = index[_key_of(row, key)] if known else len(rows)
            if not known:
                rows.append({} if isinstance(row, dict) else row)
                order.insert(order.index(above) + 1 if above in order else len(order), place)
            if isinstance(row, dict):
                self.into(rows[place], row, source, (*at, place), (*there, number))
            above = place
        self._reorder(rows, at, order)

    def drop(self, whole: dict[str, Any], codes: list[Any], own: SourceText) -> None:
        """Remove shared parameters by code."""
        rows = whole.get("parameters")
        held = [r.get("code") for r in rows] if isinstance(rows, list) else []
        for code in codes:
            if code not in held:
                line = own.lines.get(("profile", "without"), 1)
                raise ProfileError(f"{own.file}:{line}: without: there is no shared row {code!r}.")
        if not isinstance(rows, list):
            return
        kept = [place for place, code in enumerate(held) if code not in codes]
        self._reorder(rows, ("parameters",), kept)

    def _reorder(self, rows: list[Any], at: TomlPath, order: list[int]) -> None:
        """Keep only these rows, in this order, with their origins."""
        rows[:] = [rows[place] for place in order]
        moved = {old: new for new, old in enumerate(order)}
        length = len(at)
        origins: dict[TomlPath, list[RowOrigin]] = {}
        for path, origin in self.origins.items():
            place = path[length] if path[:length] == at and len(path) > length else None
            if not isinstance(place, int):
                origins[path] = origin
            elif place in moved:
                origins[(*at, moved[place], *path[length + 1 :])] = origin
        self.origins = origins
