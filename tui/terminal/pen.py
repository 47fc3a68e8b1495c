"""Styles of cells, and the pen that writes cells in as few bytes as possible."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

RESET = "0"
NOT_BOLD = "22"
INVISIBLE_ON_BLANKS = frozenset({"1", "2", "3"})
"""Bold, dim, italic: a blank looks the same with or without them."""
FOREGROUND = frozenset({*range(30, 38), *range(90, 98)})
BACKGROUND = frozenset({*range(40, 48), *range(100, 108)})
EXTENDED = {38: "foreground", 48: "background"}
NUMBERS = {2: 5, 5: 3}
"""Count of numbers in an extended color, by the number after 38 or 48."""


class CellStyle(NamedTuple):
    """Attributes and colors of a character; an empty color is the terminal's default."""

    attributes: frozenset[str] = frozenset()
    foreground: str = ""
    background: str = ""


@lru_cache(maxsize=1024)
def cell_style(ansi: str) -> CellStyle:
    """Parse a style such as `1;38;5;7;48;5;0`."""
    attributes, colors = set(), {"foreground": "", "background": ""}
    left = ansi.split(";") if ansi else []
    while left:
        number = int(left[0])
        size = 1
        if number in EXTENDED:
            size = NUMBERS[int(left[1])]
            colors[EXTENDED[number]] = ";".join(left[:size])
        elif number in FOREGROUND:
            colors["foreground"] = left[0]
        elif number in BACKGROUND:
            colors["background"] = left[0]
        elif number not in (39, 49):
            attributes.add(left[0])
        left = left[size:]
    return CellStyle(frozenset(attributes), **colors)


@lru_cache(maxsize=4096)
def change(before: str, after: str) -> str:
    """The shortest sequence from one style to another; empty if they are the same."""
    if before == after:
        return ""
    was, now = cell_style(before), cell_style(after)
    from_reset = f"\x1b[{RESET};{after}m" if after else f"\x1b[{RESET}m"
    dropped = was.attributes - now.attributes
    default_color = (was.foreground and not now.foreground) or (
        was.background and not now.background
    )
    if default_color or not dropped <= {"1"}:
        return from_reset
    added = [NOT_BOLD] if dropped else []
    kept = was.attributes - {"2"} if dropped else was.attributes  # NOT_BOLD ends dim, too
    added += sorted(now.attributes - kept)
    added += [now.foreground] if now.foreground != was.foreground else []
    added += [now.background] if now.background != was.background else []
    return min(f"\x1b[{';'.join(added)}m" if added else "", from_reset, key=len)


def erasable(ansi: str) -> bool:
    """Return True if a blank of this style looks like an erased cell."""
    return cell_style(ansi).attributes <= INVISIBLE_ON_BLANKS


@lru_cache(maxsize=1024)
def blank_style(ansi: str) -> str:
    """The style of a blank, without attributes that a blank does not show."""
    return cell_style(ansi).background if erasable(ansi) else ansi


def same_blank(before: str, after: str) -> bool:
    """Return True if a blank looks the same in two styles."""
    return erasable(before) and erasable(after) and blank_style(before) == blank_style(after)


Cell = tuple[str, str]
"""A character and its colors; an empty character if the one to the left is two cells wide."""

CURSOR_MOVE = 8
"""Bytes of a cursor movement: a shorter run of unchanged cells is sent again instead."""

ERASE = 5
"""Bytes of an erase command."""


class Pen:
    """Writes cells; moves the cursor and changes the color only if necessary.

    `erases`: the terminal erases cells in the current color.
    """

    def __init__(self, *, erases: bool = False) -> None:
        self._erases = erases
        self._parts: list[str] = []
        self._at: tuple[int, int] | None = None
        self._ansi = ""
        self.size = 0
        """Characters written so far; nearly all of them take one byte."""

    def write(self, x: int, y: int, cells: Sequence[Cell | None]) -> None:
        """Write cells from this column and row on."""
        if self._at != (x, y):
            self._put(f"\x1b[{y + 1};{x + 1}H")
        place, moved = 0, True
        while place < len(cells):
            text, ansi = cells[place] or (" ", "")
            if not moved:
                self._put(f"\x1b[{y + 1};{x + place + 1}H")
            if ansi != self._ansi and (text != " " or not same_blank(self._ansi, ansi)):
                self._put(change(self._ansi, ansi))
                self._ansi = ansi
            blank = self._blank(cells, place) if text == " " else 0
            self._put(f"\x1b[{blank}X" if blank else text)
            place, moved = place + (blank or 1), not blank
        self._at = (x + len(cells), y) if moved else None

    def _blank(self, cells: Sequence[Cell | None], place: int) -> int:
        """Return the number of blanks from `place` on that are erased rather than written."""
        cell = cells[place]
        if not self._erases or cell is None or not erasable(cell[1]):
            return 0
        end = place
        while end < len(cells) and cells[end] == cell:
            end += 1
        return end - place if end - place > CURSOR_MOVE + ERASE else 0

    def _put(self, text: str) -> None:
        self._parts.append(text)
        self.size += len(text)

    def text(self) -> str:
        """All output, ending with the colors reset."""
        if self._ansi:
            self._put("\x1b[0m")
            self._ansi = ""
        return "".join(self._parts)
