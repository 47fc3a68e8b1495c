"""Text of a new profile that begins as a copy of another."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from typing import Any

from ..errors import ProfileError
from ..plain import escaped_toml

_HEAD = re.compile(r"^\[profile\][^\n]*\n.*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)
_ID = re.compile(r"""^id[ \t]*=[ \t]*(?:"[^"\n]*"|'[^'\n]*')""", re.MULTILINE)
_PREFIXES = re.compile(r"^reference_prefixes[ \t]*=[ \t]*\[[^\]]*\]", re.MULTILINE)
_REGISTERS = re.compile(
    r"^registers[ \t]*=[ \t]*\[(?:[^\[\]]|\[[^\[\]]*\])*\][^\n]*\n"
    r"|^\[\[identification\.registers\]\][^\n]*\n(?:[^\[\n][^\n]*\n|\n)*",
    re.MULTILINE,
)
_DEMO = re.compile(r"^(?:demo_hz|rows_from|without)\b[^\n]*\n", re.MULTILINE)
_ROWS = re.compile(r"^\[\[parameters\]\]", re.MULTILINE)
_OTHER_ROWS = r"^\[\[{0}[.\]].*?(?=^\[(?!\[{0}[.\]])|\Z)"
"""Rows of a table and of the tables inside it."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")
IDENTIFIER = re.compile(r"[a-z][a-z0-9_-]*")


def new_profile_text(
    source: str,
    old_id: str,
    new_id: str,
    rows: Mapping[str, Iterable[Mapping[str, Any]]] | None = None,
) -> str:
    """Return a profile's text with another id, and without what recognizes drives.

    `rows` are all rows of its tables that share some, parameters last, because a profile of the
    user contains them itself. Raises ProfileError for an invalid id, and if the head cannot be
    copied.
    """
    if not IDENTIFIER.fullmatch(new_id):
        raise ProfileError(
            f"{new_id!r} is not an id. Use small letters, digits, - and _, with a letter first."
        )
    head = _HEAD.search(source)
    if head is None or not _ID.search(head[0]):
        raise ProfileError(
            f"The profile {old_id} cannot be copied: its table [profile] has another form."
        )
    changed = _DEMO.sub("", _ID.sub(f'id = "{new_id}"', head[0], count=1))
    text = source[: head.start()] + changed + source[head.end() :]
    if rows is not None:
        text = _until_rows(text)
        for table in rows:
            text = re.sub(_OTHER_ROWS.format(table), "", text, flags=re.MULTILINE | re.DOTALL)
        parts = [row_as_toml(table, row) for table, own in rows.items() for row in own]
        text = f"{text}\n" + "\n".join(parts)
    text = _REGISTERS.sub("", text)
    return _PREFIXES.sub(
        '# beginnings of the reference that the drive reports, such as ["NEW12"]\n'
        "reference_prefixes = []",
        text,
        count=1,
    )


def _until_rows(text: str) -> str:
    """Return the text before the parameters, which are last in a file."""
    first = _ROWS.search(text)
    return text[: first.start()] if first else text


def row_as_toml(table: str, row: Mapping[str, Any]) -> str:
    """Return a row of a table as TOML text."""
    return "\n".join([f"[[{table}]]", *(f"{key} = {_written(row[key])}" for key in row), ""])


def _written(value: Any) -> str:
    """Return a value as TOML text."""
    match value:
        case bool():
            return "true" if value else "false"
        case int():
            return str(value)
        case str():
            return escaped_toml(value)
        case dict():
            return f"{{ {', '.join(f'{_key(key)} = {_written(value[key])}' for key in value)} }}"
        case list():
            parts = [_written(item) for item in value]
            long = any(isinstance(item, dict) for item in value)
            if long:
                return "[\n" + "".join(f"  {part},\n" for part in parts) + "]"
            return f"[{', '.join(parts)}]"
    return json.dumps(value)


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key, ensure_ascii=False)
