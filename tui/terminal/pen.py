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


def from_reset(style: str) -> str:
    """The sequence from any style to this one."""
    return f"\x1b[{RESET};{style}m" if style else f"\x1b[{RESET}m"


@lru_cache(maxsize=4096)
def change(before: str, after: str) -> str:
    """The shortest sequence from one style to another; empty if they are the same."""
    if before == after:
        return ""
    was, now = cell_style(before), cell_style(after)
    reset = from_reset(after)
    dropped = was.attributes - now.attributes
    default_color = (was.foreground and not now.foreground) or (
        was.background and not now.background
    )
    if default_color or not dropped <= {"1"}:
        return reset
    added = [NOT_BOLD] if dropped else []
    kept = was.attributes - {"2"} if dropped else was.attributes  # NOT_BOLD ends dim, too
    added += sorted(now.attributes - kept)
    added += [now.foreground] if now.foreground != was.foreground else []
    added += [now.background] if now.background != was.background else []
    return min(f"\x1b[{';'.join(added)}m" if added else "", reset, key=len)


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

BLANK: Cell = (" ", "")

Run = tuple[int, int, Sequence["Cell | None"], int]
"""Column, row, cells, and the number of cells of the row."""

CURSOR_MOVE = 8
"""Bytes of the longest usual cursor movement; unchanged cells that take no more are sent again."""

ERASE_REST = 3
"""Bytes of the command that erases the rest of a row."""


class Pen:
    """Writes cells; moves the cursor and changes the color only if necessary.

    The color persists from one output to the next. The position does not, since another program may
    write to the terminal in between. `erases`: the terminal erases cells in the current color.
    """

    def __init__(self, *, erases: bool = False) -> None:
        self._erases = erases
        self._parts: list[str] = []
        self._row: int | None = None
        self._column: int | None = None
        """None if the terminal may be at another column: see `has_known_width`."""
        self._ansi: str | None = None
        self.size = 0
        """Characters written so far; nearly all of them take one byte."""

    def forget_color(self) -> None:
        """Assume nothing about the color that the terminal writes in."""
        self._ansi = None

    def write_all(self, runs: Sequence[Run]) -> None:
        """Write runs of cells, those of the present color first, then color by color."""
        order = {self._ansi: -1}
        places = [order.setdefault(_color_of(run), number) for number, run in enumerate(runs)]
        for number in sorted(range(len(runs)), key=places.__getitem__):
            self._write(*runs[number])

    def take(self, cursor: tuple[int, int] | None = None) -> str:
        """Return the output since the last call; it ends with the cursor at a column and row."""
        if cursor is not None and self._parts:
            self._put(move_to(*cursor))
        text = "".join(self._parts)
        self._parts.clear()
        self._row = self._column = None
        self.size = 0
        return text

    def _write(self, x: int, y: int, cells: Sequence[Cell | None], width: int) -> None:
        """Write cells from this column and row on, in a row of `width` cells."""
        self._move(x, y)
        place = written = 0
        while place < len(cells):
            text, ansi = cells[place] or BLANK
            if ansi != self._ansi and (
                text != " " or self._ansi is None or not same_blank(self._ansi, ansi)
            ):
                self._put(from_reset(ansi) if self._ansi is None else change(self._ansi, ansi))
                self._ansi = ansi
            if text == " " and place >= written:
                blank = self._blanks(cells, place)
                if blank > ERASE_REST and x + place + blank == width:
                    self._put("\x1b[K")
                    return
                if blank > CURSOR_MOVE + len(f"\x1b[{blank}X"):
                    self._put(f"\x1b[{blank}X")
                    place += blank
                    if place < len(cells):
                        self._move(x + place, y)
                    continue
                written = place + blank  # too few to erase
            self._put(text)
            place += 1
            if self._column is not None:
                self._column = x + place if text.isascii() or has_known_width(text) else None
        if x + place >= width:
            self._column = None  # the terminal stays at the last column, or after it

    def _blanks(self, cells: Sequence[Cell | None], place: int) -> int:
        """Return the number of equal blanks from `place` on that may be erased instead."""
        cell = cells[place]
        if not self._erases or cell is None or not erasable(cell[1]):
            return 0
        end = place
        while end < len(cells) and cells[end] == cell:
            end += 1
        return end - place

    def _move(self, x: int, y: int) -> None:
        """Move the cursor by the shortest sequence that every terminal since the VT100 knows."""
        known = [move_to(x, y)]
        if self._row is not None:
            rows = move_by(y - self._row, "B", "A")
            known.append(f"{rows}\r{move_by(x, 'C', 'D')}")
            if self._column is not None:
                back = self._column - x
                known.append(f"{rows}{move_by(-back, 'C', 'D')}")
                known += [f"{rows}{BACKSPACE * back}"] if 0 < back < CURSOR_MOVE else []
        self._put(min(known, key=len))
        self._row, self._column = y, x

    def _put(self, text: str) -> None:
        self._parts.append(text)
        self.size += len(text)


BACKSPACE = "\b"


def move_to(x: int, y: int) -> str:
    """The sequence to this column and row; the terminal takes 1 for an omitted number."""
    row = f"{y + 1}" if y else ""
    return f"\x1b[{row};{x + 1}H" if x else f"\x1b[{row}H"


def move_by(count: int, forward: str, back: str) -> str:
    """The sequence for so many cells forward, or back if negative."""
    if not count:
        return ""
    number = abs(count) if abs(count) > 1 else ""
    return f"\x1b[{number}{forward if count > 0 else back}"


def has_known_width(text: str) -> bool:
    """Return True if terminals draw a symbol in one cell: lines, blocks and braille.

    Some draw other symbols in two cells. After one of those, the column is set, not counted.
    """
    return "\u2500" <= text <= "\u259f" or "\u2800" <= text <= "\u28ff"


def _color_of(run: Run) -> str:
    """The first color of a run that must be set."""
    for cell in run[2]:
        text, ansi = cell or BLANK
        if text != " " or not erasable(ansi):
            return ansi
    return (run[2][0] or BLANK)[1]
