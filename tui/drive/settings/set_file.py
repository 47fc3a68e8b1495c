"""Parameter set files: parsed with the line of each error, written completely or not at all."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli

from ..errors import ValueRefused
from ..profile import library
from ..profile.profile import Profile
from ..profile.schema import Parameter
from ..shown import raw_of_text, shown
from ..small_file import read_small_text, sync_folder
from ..toml_text import toml_tables
from ..values import type_range
from .parameter_set import (
    ABSENT,
    END_OF_SET,
    SET_FORMAT,
    SET_HEADER,
    ParameterSet,
    SetError,
    SetHead,
    lacking,
)

_AT = re.compile(r"\(at line (\d+), column \d+\)|\(at end of document\)")
_KEY = re.compile(r"\s*(\"(?:[^\"\\]|\\.)*\"|'[^']*'|[A-Za-z0-9_-]+)\s*=")
_TABLE = re.compile(r"\s*\[\s*parameters\s*\.")
_FIELDS = frozenset({"raw", "value", "name"})


@dataclass(frozen=True, slots=True)
class _Entry:
    code: str
    line: int
    raw: int | None
    value: str | None


@dataclass(slots=True)
class _Fault:
    """Makes errors of one file."""

    file: str

    def __call__(self, line: int, text: str) -> SetError:
        return SetError(f"{self.file}:{line}: {text}")


def load_set(text: str, file: str, profile_of: Callable[[str], Profile]) -> ParameterSet:
    """Parse a parameter set; `profile_of` returns a profile by its id.

    Raises SetError with file and line if the set is cut short, of another kind or contradictory,
    and the errors of `profile_of`.
    """
    fault = _Fault(file)
    tables = _tables(text, fault)
    head = _head(tables, text, fault)
    entries = _entries(tables, text, fault)
    _check_whole(tables, text, len(entries), fault)
    profile = profile_of(head.profile)
    known = [entry for entry in entries if profile.get(entry.code) is not None]
    resolver = _Resolver(profile, fault)
    return ParameterSet(
        head=head,
        raws=resolver.raws(known),
        absent={str(code): str(why) for code, why in _table(tables, ABSENT).items()},
        unknown={
            e.code: e.value if e.value is not None else str(e.raw)
            for e in entries
            if profile.get(e.code) is None
        },
        lines={entry.code: entry.line for entry in entries},
        notes=resolver.notes,
        lossy=frozenset(resolver.lossy),
    )


def _tables(text: str, fault: _Fault) -> dict[str, Any]:
    try:
        return toml_tables(text)
    except tomli.TOMLDecodeError as error:
        match = _AT.search(str(error))
        at_end = match is not None and match[1] is None
        line = int(match[1]) if match and match[1] else text.count("\n") + 1
        what = _AT.sub("", str(error)).strip()
        reported = f"not a parameter set: {what}."
        if at_end:
            reported = f"{reported} The file seems to be cut short here."
        raise fault(line, reported) from error


def _table(tables: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = tables.get(name, {})
    return found if isinstance(found, dict) else {}


def _head(tables: Mapping[str, Any], text: str, fault: _Fault) -> SetHead:
    head = _table(tables, SET_HEADER)
    line = _line_of(text, SET_HEADER)
    if "format" not in head or not isinstance(head.get("profile"), str):
        raise fault(
            line, f"not a parameter set: [{SET_HEADER}] with format and profile is missing."
        )
    if head["format"] != SET_FORMAT:
        raise fault(
            line,
            f"this parameter set has format {head['format']}; this panel reads format {SET_FORMAT}."
            " Read it with the panel that wrote it, or a newer one.",
        )
    device = head.get("device", 0)
    texts = {key: str(head.get(key, "")) for key in ("profile_version", "family", "time", "line")}
    return SetHead(
        profile=head["profile"],
        **texts,
        device=device if isinstance(device, int) else 0,
        panel=str(head.get("panel", "")),
        identity={str(k): str(v) for k, v in _table(tables, "identity").items()},
    )


def _check_whole(tables: Mapping[str, Any], text: str, count: int, fault: _Fault) -> None:
    """Raise SetError unless header and end state the number of parameters in the file."""
    last = text.count("\n") + 1
    if END_OF_SET not in tables:
        raise fault(
            last, f"the file is cut short: its [{END_OF_SET}] is missing after {count} parameters."
        )
    for name in (SET_HEADER, END_OF_SET):
        reported = _table(tables, name).get("parameters")
        if reported != count:
            raise fault(
                _line_of(text, name),
                f"[{name}] states {reported} parameters, but the file has {count}. If you deleted"
                f" lines on purpose, write parameters = {count} in [{SET_HEADER}] and in"
                f" [{END_OF_SET}].",
            )


def _line_of(text: str, table: str) -> int:
    match = re.search(rf"^[ \t]*\[\s*{table}\s*\]", text, re.MULTILINE)
    return text.count("\n", 0, match.start()) + 1 if match else 1


def _entries(tables: Mapping[str, Any], text: str, fault: _Fault) -> list[_Entry]:
    lines = _lines_of_codes(text)
    found: dict[str, _Entry] = {}
    for group, members in _table(tables, "parameters").items():
        if not isinstance(members, dict):
            raise fault(1, f"parameters.{group} is not a table of parameters.")
        for code, fields in members.items():
            line = lines.get((group, code), 1)
            if code in found:
                raise fault(line, f"{code} is already in line {found[code].line}.")
            found[code] = _entry(code, line, fields, fault)
    return list(found.values())


def _lines_of_codes(text: str) -> dict[tuple[str, str], int]:
    """Return the line numbers by group and code: each parameter is on one line."""
    found: dict[tuple[str, str], int] = {}
    group = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if line.lstrip().startswith("["):
            group = ""
            if _TABLE.match(line):
                try:
                    (group,) = toml_tables(line)["parameters"]
                except (tomli.TOMLDecodeError, ValueError):
                    group = ""
        elif group and (match := _KEY.match(line)):
            found.setdefault((group, _unquoted(match[1])), number)
    return found


def _unquoted(key: str) -> str:
    if key.startswith('"'):
        try:
            return str(json.loads(key))
        except ValueError:
            return key.strip('"')
    return key.strip("'")


def _entry(code: str, line: int, fields: Any, fault: _Fault) -> _Entry:
    example = f'{code} = {{ raw = 30, value = "3.0 s" }}'
    if not isinstance(fields, dict):
        raise fault(line, f"{code} is not a parameter. Write it like {example}.")
    strange = sorted(set(fields) - _FIELDS)
    if strange:
        raise fault(line, f"{code}: {strange[0]!r} is not a field. Write it like {example}.")
    raw, value = fields.get("raw"), fields.get("value")
    if raw is not None and (not isinstance(raw, int) or isinstance(raw, bool)):
        raise fault(line, f"{code}: raw must be a whole number, not {raw!r}.")
    if isinstance(value, bool) or not isinstance(value, str | int | float | None):
        raise fault(line, f"{code}: value must be a text or a number.")
    if raw is None and value is None:
        raise fault(line, f"{code} has neither raw nor value. Write it like {example}.")
    return _Entry(code, line, raw, None if value is None else str(value))


@dataclass(slots=True)
class _Resolver:
    """Converts lines to raw values; sources of scales come first."""

    profile: Profile
    fault: _Fault
    found: dict[str, int] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)
    lossy: set[str] = field(default_factory=set)

    def raws(self, entries: list[_Entry]) -> dict[str, int]:
        reported = {entry.code: entry.raw for entry in entries if entry.raw is not None}
        for follows in (False, True):
            for entry in entries:
                parameter = self.profile[entry.code]
                if bool(parameter.scale_source) is follows:
                    self.found[entry.code] = self._raw(parameter, entry, {**reported, **self.found})
        return {entry.code: self.found[entry.code] for entry in entries}

    def _raw(self, parameter: Parameter, entry: _Entry, raws: Mapping[str, int]) -> int:
        low, high = type_range(parameter)
        if entry.raw is not None and not low <= entry.raw <= high:
            raise self.fault(
                entry.line, f"{entry.code}: raw {entry.raw} does not fit {parameter.type}."
            )
        if entry.raw is None:
            return self._encoded(parameter, entry, raws)
        if entry.value is None:
            return entry.raw
        absent = lacking(self.profile, raws)
        text = shown(self.profile, parameter, entry.raw, raws, absent).display
        if text == entry.value or self._may_mean(parameter, entry, raws) == entry.raw:
            return entry.raw
        raise self.fault(
            entry.line,
            f"{entry.code}: raw {entry.raw} is {text}, but value is {entry.value}. Delete raw in"
            " this line to use the value, or delete value to use raw.",
        )

    def _may_mean(self, parameter: Parameter, entry: _Entry, raws: Mapping[str, int]) -> int | None:
        try:
            return self._encoded(parameter, entry, raws)
        except SetError:
            return None

    def _encoded(self, parameter: Parameter, entry: _Entry, raws: Mapping[str, int]) -> int:
        absent = lacking(self.profile, raws)
        try:
            conversion = raw_of_text(self.profile, parameter, entry.value or "", raws, absent)
        except ValueRefused as error:
            raise self.fault(entry.line, str(error)) from error
        if conversion.rounded and entry.raw is not None:
            raise self.fault(
                entry.line,
                f"{entry.code}: the drive cannot hold {entry.value} exactly. Use another value.",
            )
        if conversion.rounded:
            held = shown(self.profile, parameter, conversion.raw, raws, absent).display
            self.notes[entry.code] = f"{entry.code}: {entry.value} is rounded to {held}."
        if conversion.lossy:
            self.lossy.add(entry.code)
        return conversion.raw


USUAL_FILE_MODE, PRIVATE_FILE_MODE = 0o666, 0o600


class FileThere(SetError):
    """A file with this name already exists, and overwriting it was not requested."""


def read_set(path: Path, name: str = "") -> ParameterSet:
    """Read a parameter set; raises SetError, UnknownProfile and ProfileError.

    `name` is the name of the file in errors (default: its path).
    """
    name = name or str(path)
    try:
        text = read_small_text(path)
    except OSError as error:
        raise SetError(f"{name}: cannot be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise SetError(
            f"{name}: byte {error.start} is not UTF-8 text: no parameter set."
        ) from error
    return load_set(text, name, library.load)


def write_file(
    path: Path, content: str | bytes, *, force: bool = False, private: bool = False
) -> None:
    """Write a file completely and flushed, or leave it unchanged.

    A `private` file is readable only by its owner. Raises FileThere if the file exists and `force`
    is False, SetError if the folder refuses it.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    mode = PRIVATE_FILE_MODE if private else USUAL_FILE_MODE
    if not force and path.exists():
        raise FileThere(
            f"{path} already exists. Choose another name, or use --force to replace it."
        )
    if path.exists() and not path.is_file():  # a device would be replaced by a file
        raise SetError(f"{path} is not a regular file. Choose another name.")
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        with os.fdopen(os.open(part, flags, mode), "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        _put(part, path, force=force)
        with suppress(OSError):
            sync_folder(path.parent)
    except OSError as error:
        raise SetError(f"{path}: cannot be written: {error.strerror or error}.") from error
    finally:
        with suppress(OSError):
            part.unlink()


def _put(part: Path, path: Path, *, force: bool) -> None:
    """Give the file its name; without `force`, fail atomically if the name is in use."""
    if force:
        part.replace(path)
        return
    try:
        os.link(part, path)
    except FileExistsError as error:
        raise FileThere(
            f"{path} already exists. Choose another name, or use --force to replace it."
        ) from error
    except (OSError, NotImplementedError):
        # the file system has no links; the name was free at the check before
        part.replace(path)
