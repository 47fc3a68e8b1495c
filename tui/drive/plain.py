"""Replacement of control characters in texts of persons, drives, files and profiles.

An escape sequence in a drive's name must neither control the terminal nor stay invisible. Each
control character is replaced by one visible character, so that the length stays correct.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence

PICTURES = 0x2400
"""Offset of the Unicode pictures of the first 32 control characters: ␀ to ␟."""
DELETE = "␡"
UNSHOWN = "\ufffd"
"""Replaces characters without a picture: C1 controls, direction marks, lone surrogates."""
COMMANDING = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Categories of characters that may command a terminal, or are invisible."""


def plain(text: str, *, lines: bool = False) -> str:
    """Replace control characters by visible signs; keep line feeds if `lines`."""
    if text.isprintable():
        return text
    return "".join(c if lines and c == "\n" else _sign(c) for c in text)


def plain_cells(cells: Iterable[object]) -> list[str]:
    """Return the cells of a table row as sanitized text; empty for None."""
    return ["" if cell is None else plain(str(cell)) for cell in cells]


def csv_text(rows: Iterable[Iterable[object]], end: str = "\r\n") -> str:
    """Return rows of sanitized cells as CSV, each with its line end."""
    import csv  # imported late: speeds up the start
    import io

    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator=end)
    for row in rows:
        writer.writerow(plain_cells(row))
    return text.getvalue()


def markdown_cell(text: str) -> str:
    """Return a text that ends neither the column nor the row of a Markdown table."""
    return plain(text.replace("\n", " ")).replace("|", "\\|")


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table."""
    lines = [f"| {' | '.join(map(markdown_cell, row))} |" for row in (head, *rows)]
    return [lines[0], "|" + "---|" * len(head), *lines[1:]]


def escaped_json(text: str) -> str:
    """Return equivalent JSON; every character that could command a terminal is escaped."""
    if text.replace("\n", "").isprintable():
        return text
    import json  # imported late: speeds up the start

    return "".join(json.dumps(c)[1:-1] if c != "\n" and commands(c) else c for c in text)


def escaped_toml(text: str) -> str:
    """Return a basic TOML string; every character that could command a terminal is escaped."""
    import json

    quoted = json.dumps(text.encode("utf-8", "replace").decode(), ensure_ascii=False)
    return "".join(f"\\U{ord(c):08X}" if commands(c) else c for c in quoted)


def commands(character: str) -> bool:
    """Return True if a character could command a terminal, or is invisible."""
    return unicodedata.category(character) in COMMANDING


def _sign(character: str) -> str:
    if not commands(character):
        return character
    if character < " ":
        return chr(PICTURES + ord(character))
    return DELETE if character == "\x7f" else UNSHOWN
