"""Text that a person, a drive, a file or a profile brings, as it may be shown to a person.

A drive's name with an escape sequence in it must neither command the terminal nor hide there: each
control character is replaced by a picture, one for one, so that the layout by length stays correct.
"""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Iterable

PICTURES = 0x2400
"""Offset of the Unicode pictures of the first 32 control characters: ␀ to ␟."""
DELETE = "␡"
UNSHOWN = "\ufffd"
"""For what has no picture: C1 controls, marks of direction, halves of characters."""
COMMANDING = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Categories of characters that a terminal takes as commands, or that show nothing."""


def plain(text: str, *, lines: bool = False) -> str:
    """The text with control characters as visible signs; with `lines` line feeds stay."""
    if text.isprintable():
        return text
    return "".join(c if lines and c == "\n" else _sign(c) for c in text)


def plain_cells(cells: Iterable[object]) -> list[str]:
    """The cells of a row of a table, for a file or a terminal; nothing for None."""
    return ["" if cell is None else plain(str(cell)) for cell in cells]


def escaped_json(text: str) -> str:
    """JSON that means the same, with every character escaped that could command a terminal."""
    if text.replace("\n", "").isprintable():
        return text
    return "".join(json.dumps(c)[1:-1] if c != "\n" and commands(c) else c for c in text)


def escaped_toml(text: str) -> str:
    """A basic string of TOML with every character escaped that could command a terminal."""
    quoted = json.dumps(text.encode("utf-8", "replace").decode(), ensure_ascii=False)
    return "".join(f"\\U{ord(c):08X}" if commands(c) else c for c in quoted)


def commands(character: str) -> bool:
    """Return True if a character could command a terminal, or show nothing at all."""
    return unicodedata.category(character) in COMMANDING


def _sign(character: str) -> str:
    if not commands(character):
        return character
    if character < " ":
        return chr(PICTURES + ord(character))
    return DELETE if character == "\x7f" else UNSHOWN
