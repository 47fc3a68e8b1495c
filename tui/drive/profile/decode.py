"""From TOML text to a checked form, with file and line of every fault (not for profiles: check)."""

from __future__ import annotations

from typing import TypeVar

import msgspec

from ..errors import ProfileError
from .converting import converted
from .form import form_faults, place_label
from .shared_rows import SourceText, parsed
from .toml_lines import TomlPath

T = TypeVar("T")


def decode_tables(source: SourceText, form: type[T]) -> T:
    """The data of a TOML text in a form; raises ProfileError with each fault, file and line."""
    tables = parsed(source)
    try:
        data: T = converted(tables, form)
    except msgspec.ValidationError as error:
        found = form_faults(tables, form)[0].found or [((), str(error))]
        lines = [
            f"{source.file}:{line_of(source, path)}: {place_label(tables, path)}:"
            f" {fault.rstrip('.')}."
            for path, fault in found
        ]
        raise ProfileError("\n".join(lines)) from error
    return data


def line_of(source: SourceText, path: TomlPath) -> int:
    """The line of a place, or of the row that it is in."""
    for length in range(len(path), -1, -1):
        if (line := source.lines.get(path[:length])) is not None:
            return line
    return 1
