"""TOML files of a person, such as tests and plans: reading them, and faults with their lines."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NoReturn

import tomli

from ..errors import DriveError
from ..small_file import read_small_text
from ..toml_text import toml_tables
from .toml_lines import TomlPath, toml_lines

_AT = re.compile(r" \(at line (\d+), column \d+\)")


def read_person_file(path: Path, error: type[DriveError]) -> tuple[str, dict[str, Any]]:
    """Return the text of a file and its tables. Raises `error` with the line of an error."""
    try:
        text = read_small_text(path)
        return text, toml_tables(text)
    except OSError as why:
        raise error(f"{path}: cannot be read: {why.strerror or why}.") from why
    except UnicodeDecodeError as why:
        raise error(f"{path}: byte {why.start} is not UTF-8 text.") from why
    except tomli.TOMLDecodeError as why:
        found = _AT.search(str(why))
        place = f"{path}:{found[1]}" if found else f"{path}"
        raise error(f"{place}: {_AT.sub('', str(why))}.") from why


def raise_faults(
    path: Path,
    text: str,
    faults: Iterable[tuple[TomlPath, str]],
    rows: Mapping[str, str],
    error: type[DriveError],
) -> NoReturn:
    """Raise `error` with all faults, one a line, each with its line and key.

    `rows` has the word for a row by the name of its table: `steps` and `step`.
    """
    lines = toml_lines(text)
    found = sorted((_line(lines, at), at, fault) for at, fault in faults)
    raise error("\n".join(f"{path}:{line}: {_key(at, rows)}{fault}." for line, at, fault in found))


def _line(lines: Mapping[TomlPath, int], at: TomlPath) -> int:
    """Return the line of a path, or of the nearest table around it."""
    return next((lines[at[:n]] for n in range(len(at), -1, -1) if at[:n] in lines), 1)


def _key(at: TomlPath, rows: Mapping[str, str]) -> str:
    """Return a path as a person counts: the third step is `step 3`."""
    parts: list[str] = []
    row = ""
    for part in at:
        if isinstance(part, int):
            name, row = row or "entry", ""
            parts.append(f"{name} {part + 1}")
        elif part in rows:
            row = rows[part]
        else:
            parts.append(part)
    return f"{', '.join(parts)}: " if parts else ""
