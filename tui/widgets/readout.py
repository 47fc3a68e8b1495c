"""Numbers three rows high, drawn with box characters; pure functions."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal

ROWS = 3
DIGIT_CELLS = 3
GLYPHS: Mapping[str, tuple[str, str, str]] = {
    "0": ("┌─┐", "│ │", "└─┘"),
    "1": ("  ╷", "  │", "  ╵"),
    "2": ("╶─┐", "┌─┘", "└─╴"),
    "3": ("╶─┐", "╶─┤", "╶─┘"),
    "4": ("╷ ╷", "└─┤", "  ╵"),
    "5": ("┌─╴", "└─┐", "╶─┘"),
    "6": ("┌─╴", "├─┐", "└─┘"),
    "7": ("╶─┐", "  │", "  ╵"),
    "8": ("┌─┐", "├─┤", "└─┘"),
    "9": ("┌─┐", "└─┤", "╶─┘"),
    "-": ("  ", "╶─", "  "),
    ".": (" ", " ", "."),
    " ": (" ", " ", " "),
}
"""The three rows of each character; a minus is two cells wide, a point one."""
PLAIN_GLYPHS: Mapping[str, tuple[str, str, str]] = {
    "0": (" _ ", "| |", "|_|"),
    "1": ("   ", "  |", "  |"),
    "2": (" _ ", " _|", "|_ "),
    "3": (" _ ", " _|", " _|"),
    "4": ("   ", "|_|", "  |"),
    "5": (" _ ", "|_ ", " _|"),
    "6": (" _ ", "|_ ", "|_|"),
    "7": (" _ ", "  |", "  |"),
    "8": (" _ ", "|_|", "|_|"),
    "9": (" _ ", "|_|", " _|"),
    "-": ("  ", "_ ", "  "),
    ".": (" ", " ", "."),
    " ": (" ", " ", " "),
}
"""The same in ASCII, for terminals without box characters."""
DASH = ("   ", "╶─╴", "   ")
"""One digit of a missing number."""


def readout_cells(decimals: int, *, signed: bool, whole: int = 3) -> int:
    """The width of a number with this many digits before and after the point."""
    point = 1 + DIGIT_CELLS * decimals if decimals else 0
    return (2 if signed else 0) + DIGIT_CELLS * whole + point


def big(text: str, width: int, *, plain: bool = False) -> list[str]:
    """A number in three rows, right-aligned in exactly `width` cells.

    A number that is too wide loses decimals first. If it is still too wide, or is not a number, the
    text is shown small in the lowest row. With `plain` it is drawn in ASCII.
    """
    glyphs = PLAIN_GLYPHS if plain else GLYPHS
    for shown in _shorter(text):
        rows = ["".join(glyphs[character][row] for character in shown) for row in range(ROWS)]
        if len(rows[0]) <= width:
            return [row.rjust(width) for row in rows]
    return [" " * width, " " * width, text[:width].rjust(width)]


def dashes(width: int) -> list[str]:
    """Three dashes instead of an unknown number."""
    return ["".join(part[row] for part in (DASH,) * 3).rjust(width)[:width] for row in range(ROWS)]


def _shorter(text: str) -> list[str]:
    """The number, then the number with fewer and fewer decimals; empty if it is not a number."""
    places = len(text.partition(".")[2])
    if not text or not set(text) <= GLYPHS.keys():
        return []
    try:
        number = Decimal(text)
    except ArithmeticError:
        return []
    return [text, *(f"{number:.{left}f}" for left in range(places - 1, -1, -1))]
