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
"""By character, its three rows; a minus is two cells wide, a point one."""
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
"""The same in ASCII, for terminals that have no more."""
DASH = ("   ", "╶─╴", "   ")
"""One place of a number that is not there."""


def readout_cells(decimals: int, *, signed: bool, whole: int = 3) -> int:
    """The width that a number of so many digits takes."""
    point = 1 + DIGIT_CELLS * decimals if decimals else 0
    return (2 if signed else 0) + DIGIT_CELLS * whole + point


def big(text: str, width: int, *, plain: bool = False) -> list[str]:
    """A number in three rows, to the right of exactly so many cells.

    What is too wide loses decimals first; texts other than numbers, and those still too wide, are
    in the lowest row unchanged. With `plain` it is drawn in ASCII.
    """
    glyphs = PLAIN_GLYPHS if plain else GLYPHS
    for shown in _shorter(text):
        rows = ["".join(glyphs[character][row] for character in shown) for row in range(ROWS)]
        if len(rows[0]) <= width:
            return [row.rjust(width) for row in rows]
    return [" " * width, " " * width, text[:width].rjust(width)]


def dashes(width: int) -> list[str]:
    """Three dashes in the place of a number that is not known."""
    return ["".join(part[row] for part in (DASH,) * 3).rjust(width)[:width] for row in range(ROWS)]


def _shorter(text: str) -> list[str]:
    """The number itself, then with fewer and fewer decimals; nothing for what is none."""
    places = len(text.partition(".")[2])
    if not text or not set(text) <= GLYPHS.keys():
        return []
    try:
        number = Decimal(text)
    except ArithmeticError:
        return []
    return [text, *(f"{number:.{left}f}" for left in range(places - 1, -1, -1))]
