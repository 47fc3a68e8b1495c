"""Facts from a profile without decoding it: its head, and how a drive is identified.

Of a packaged file, only the required tables are parsed. A file of the user is parsed as a whole, so
that an error in it is found.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from ..errors import ProfileError
from ..small_file import encoding_fault, open_regular, read_small, read_small_text

HEAD_BYTES = 4096
"""Most characters of a head."""
_HEADER = re.compile(r"^\[+[ \t]*([\w-]+)[^\n]*", re.MULTILINE)
_TEXT = re.compile(r'^(\w+) = "([^"\\\n]*)"$', re.MULTILINE)
_PARAMETER = re.compile(r"^\[\[parameters\]\]", re.MULTILINE)
_CODE = re.compile(r"""^\[\[parameters\]\]\ncode = (["'])(.+)\1$""", re.MULTILINE)


class ProfileFileHead(NamedTuple):
    """The first table of a file unchanged and unchecked."""

    table: Mapping[str, Any] = MappingProxyType({})
    parameters: int = 0
    fault: str = ""

    def text(self, key: str) -> str:
        """Return a text of the head; empty if there is none."""
        value = self.table.get(key, "")
        return value if isinstance(value, str) else ""

    @property
    def demo_hz(self) -> float | None:
        """Frequency of its motor in the demo."""
        try:
            hertz = float(self.text("demo_hz"))
        except ValueError:
            return None
        return hertz if math.isfinite(hertz) else None


class RequestPrefixes(NamedTuple):
    """Identification of a family's drives on a line."""

    prefixes: tuple[str, ...] = ()
    """Prefixes of the family's references."""
    functions: frozenset[int] = frozenset()
    version_digits: str = "as-told"
    registers: bool = False
    """True if registers identify them."""


def file_head(path: Path, own: bool, packaged: Path) -> ProfileFileHead:
    """Return the head of a file; `fault` is set if the file is broken."""
    return _head(path, own, packaged, _stamp(path))


def quick_head(path: Path, own: bool) -> ProfileFileHead:
    """Return the head of a file from its first characters; empty if they do not contain all of
    it.

    Of a packaged file it has the texts only, found without a parser: the panel starts sooner.
    """
    try:
        with open(open_regular(path), encoding="utf-8") as file:
            text = file.read(HEAD_BYTES)
    except (OSError, UnicodeDecodeError):
        return ProfileFileHead()
    if own:
        return ProfileFileHead(section(text, "profile") or {})
    parts = _HEADER.split(text, 2)  # what is before, its name, the table, the next name, the rest
    return ProfileFileHead(dict(_TEXT.findall(parts[2])) if parts[1:2] == ["profile"] else {})


def request_prefixes(path: Path, own: bool, packaged: Path) -> RequestPrefixes:
    """Return the identification of a file's family; empty for a broken file."""
    return _requested(path, own, packaged, _stamp(path))


def _stamp(path: Path) -> tuple[int, int]:
    """Return a value that changes whenever the file changes."""
    try:
        reported = os.stat(path)
    except OSError:
        return 0, 0
    return reported.st_mtime_ns, reported.st_size


@lru_cache(maxsize=256)
def _head(path: Path, own: bool, packaged: Path, _stamp: tuple[int, int]) -> ProfileFileHead:
    try:
        text = read_small_text(path)
    except OSError as error:
        return ProfileFileHead(fault=f"cannot be read: {error.strerror}")
    except UnicodeDecodeError:
        return ProfileFileHead(fault=f"{path}:{encoding_fault(read_small(path))}")
    head = section(text, "profile") or {}
    if not own and head and (count := _counted(text, head, packaged)) is not None:
        return ProfileFileHead(head, count)
    try:
        tables = _whole(path, packaged)
    except ProfileError as error:
        return ProfileFileHead(head, len(_PARAMETER.findall(text)), str(error))
    head, rows = tables.get("profile", {}), tables.get("parameters", [])
    if not isinstance(head, dict) or not isinstance(head.get("id"), str):
        return ProfileFileHead(fault="the table [profile] with an id is missing")
    return ProfileFileHead(head, len(rows) if isinstance(rows, list) else 0)


def _counted(text: str, head: Mapping[str, Any], packaged: Path) -> int | None:
    """Return the number of a packaged file's parameters, shared ones included; None if not
    plain."""
    if "rows_from" not in head:
        return len(_PARAMETER.findall(text))
    if "without" in head or (shared := shared_texts(head, packaged)) is None:
        return None
    texts = (text, *shared)
    codes = [row[1] for item in texts for row in _CODE.findall(item)]
    plain = len(codes) == sum(len(_PARAMETER.findall(item)) for item in texts)
    return len(set(codes)) if plain else None


def shared_texts(head: Mapping[str, Any], packaged: Path) -> list[str] | None:
    """Return the texts of a packaged file's shared rows; None if they are missing."""
    names = head.get("rows_from")
    try:
        return [read_small_text(packaged / name) for name in names or ()]
    except (OSError, UnicodeDecodeError, TypeError):
        return None


@lru_cache(maxsize=256)
def _requested(path: Path, own: bool, packaged: Path, _stamp: tuple[int, int]) -> RequestPrefixes:
    try:
        tables = _read_tables(path, own, packaged)
    except (OSError, UnicodeDecodeError, ProfileError):
        return RequestPrefixes()
    named, functions = tables.get("identification"), tables.get("functions")
    prefixes = named.get("reference_prefixes") if isinstance(named, dict) else None
    rows = functions if isinstance(functions, list) else []
    codes = [row.get("code") for row in rows if isinstance(row, dict)]
    return RequestPrefixes(
        tuple(p for p in prefixes if isinstance(p, str)) if isinstance(prefixes, list) else (),
        frozenset(code for code in codes if isinstance(code, int)),
        str(named.get("version_digits", "")) if isinstance(named, dict) else "",
        bool(named.get("registers")) if isinstance(named, dict) else False,
    )


def _read_tables(path: Path, own: bool, packaged: Path) -> Mapping[str, Any]:
    """Return the tables of a file, at least identification and functions."""
    if own:
        return _whole(path, packaged)
    text = read_small_text(path)
    head = section(text, "profile")
    shared = shared_texts(head, packaged) if head is not None else None
    if shared is None or any(
        header[1] != "parameters" for item in shared for header in _HEADER.finditer(item)
    ):
        return _whole(path, packaged)
    found = {"identification": section(text, "identification") or {}}
    functions = section(text, "functions")
    return {**found, "functions": functions} if functions else _whole(path, packaged)


def _whole(path: Path, packaged: Path) -> Mapping[str, Any]:
    from .shared_rows import read_tables

    return read_tables(path, packaged).tables


def section(text: str, name: str) -> Any:
    """Parse one top-level table without the others; None if that is not possible."""
    import tomli

    from ..toml_text import toml_tables

    headers = list(_HEADER.finditer(text))
    own = [n for n, header in enumerate(headers) if header[1] == name]
    if not own or own != list(range(own[0], own[-1] + 1)):
        return None
    last = own[-1] + 1
    end = headers[last].start() if last < len(headers) else len(text)
    try:
        return toml_tables(text[headers[own[0]].start() : end]).get(name)
    except tomli.TOMLDecodeError:
        return None
