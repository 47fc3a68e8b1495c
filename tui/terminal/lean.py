"""Intended and present contents of the terminal; only cells that differ are sent.

Textual 8.2 sends a changed part of a widget from its left edge on, and a new screen whole, several
times. It sets every color again for each piece of text. On a slow link that is most of what a panel
sends. Here the updates are merged into one picture. When the terminal can accept output, only the
difference is sent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rich.cells import get_character_cell_size
from rich.color import ColorSystem
from rich.console import RenderableType
from textual._compositor import ChopsUpdate, LayoutUpdate
from textual.screen import Screen
from textual.strip import Strip

from tui.drive.plain import commands

from .pen import BLANK, CURSOR_MOVE, Cell, Pen, Run, blank_style, change, erasable, same_blank

Placed = tuple[int, int, Strip]
"""A strip at a column and a row."""

BATCH = 1000
"""Bytes of runs that are sorted by color together; a terminal shows larger pictures row by row."""

FIRST_ROWS, LAST_ROWS = 2, 2
"""Rows at the top (status bar, tabs) and at the bottom (message, key bar) that are drawn first."""


class Picture:
    """Intended contents of the terminal, and its present contents according to the frames sent.

    `erases`: the terminal erases cells in the current color.
    """

    def __init__(self, *, erases: bool = False) -> None:
        self._erases = erases
        self._wanted: dict[int, list[Cell | None]] = {}
        self._shown: dict[int, list[Cell | None]] = {}
        self._changed: dict[int, tuple[int, int]] = {}
        self._pen = Pen(erases=erases)

    @property
    def is_shown(self) -> bool:
        """True if the terminal shows all intended contents."""
        return not self._changed

    def forget(self) -> None:
        """Assume nothing about the terminal's contents: another program may have written to it."""
        self._shown.clear()
        self._changed = {y: (0, len(row)) for y, row in self._wanted.items()}
        self._pen.forget_color()

    def clear(self) -> None:
        """Start again after a change of the terminal's size."""
        self._wanted.clear()
        self.forget()

    def want(self, strips: Sequence[Placed], colors: ColorSystem) -> None:
        """Add strips to the intended contents."""
        for x, y, strip in strips:
            cells = cells_of(strip, colors)
            end = x + len(cells)
            row = self._wanted.setdefault(y, [])
            row.extend([None] * (end - len(row)))
            row[x:end] = cells
            first, last = self._changed.get(y, (x, end))
            self._changed[y] = min(first, x), max(last, end)

    def frame(self, room: int, cursor: tuple[int, int] | None = None) -> str:
        """Return the output for the terminal, and count it as shown.

        It has about `room` bytes, and at least a row. The first and the last rows come first, then
        the others from the top. Their runs are sorted by color in batches, since a color takes more
        bytes than a movement. At its end, the terminal's cursor is at this column and row.
        """
        pen, waiting = self._pen, self._in_order()
        while waiting and pen.size <= room:
            batch: list[Run] = []
            size = pen.size
            while waiting and size <= min(room, pen.size + BATCH):
                found = self._take(waiting.pop())
                size += sum(map(_size_of, found))
                batch += found
            pen.write_all(batch)
        return pen.take(cursor)

    def _in_order(self) -> list[int]:
        """The changed rows, the first one last."""
        bottom = max(self._wanted, default=0) - LAST_ROWS
        return sorted(self._changed, key=lambda y: (FIRST_ROWS <= y <= bottom, y), reverse=True)

    def _take(self, y: int) -> list[Run]:
        """Count a row as shown, and return its differing cells."""
        first, last = self._changed.pop(y)
        wanted = self._wanted[y]
        shown = self._shown.setdefault(y, [])
        shown.extend([None] * (len(wanted) - len(shown)))
        found: list[Run] = [
            (start, y, wanted[start:end], len(wanted))
            for start, end in different(shown, wanted, first, last, erases=self._erases)
        ]
        shown[first:last] = wanted[first:last]
        return found


def _size_of(run: Run) -> int:
    """Bytes of a run, roughly: each of its colors counts once."""
    cells = [cell or BLANK for cell in run[2]]
    text = "".join([cell[0] for cell in cells])
    return CURSOR_MOVE + len(text.encode()) + sum(len(ansi) + 6 for ansi in {c[1] for c in cells})


def different(
    shown: Sequence[Cell | None],
    wanted: Sequence[Cell | None],
    first: int,
    last: int,
    *,
    erases: bool = False,
) -> list[tuple[int, int]]:
    """The runs of cells of a row that must be sent; a wide character is sent whole.

    If the terminal erases cells, unchanged blanks between two blanks that must be sent cost
    nothing: one command erases them all.
    """
    found: list[tuple[int, int]] = []
    if shown[first:last] == wanted[first:last]:
        return found
    if shown[first:last].count(None) == last - first and None not in wanted[first:last]:
        return [(first, last)]  # the first picture: nothing is equal
    for place in range(first, last):
        cell = wanted[place]
        if cell is None or shown[place] == cell:
            continue
        start = place if cell[0] else max(0, place - 1)
        end = found[-1][1] if found else None
        erased = erases and cell[0] == " " and erasable(cell[1])
        if end is not None and (
            is_shorter_than_move(wanted, end, start)
            or (erased and all(same == cell for same in wanted[end - 1 : start]))
        ):
            found[-1] = (found[-1][0], place + 1)
        else:
            found.append((start, place + 1))
    return found


def is_shorter_than_move(row: Sequence[Cell | None], end: int, start: int) -> bool:
    """Return True if writing the cells from `end` to `start` takes fewer bytes than a jump."""
    gap = row[end:start]
    if len(gap) >= CURSOR_MOVE or None in gap:
        return False
    size, before = 0, (row[end - 1] or BLANK)[1]
    direct = len(change(before, (row[start] or BLANK)[1]))
    for cell in row[end : start + 1]:
        text, ansi = cell or BLANK
        size += 1 if text.isascii() else len(text.encode())
        if ansi != before and (text != " " or not same_blank(before, ansi)):
            size += len(change(before, ansi))
            before = ansi
    text, _ = row[start] or BLANK
    return size - len(text.encode()) <= direct + len(f"\x1b[{start - end}C")


def screen_text(screen: Screen[Any]) -> str:
    """A screen as text, one line per row, as it was last drawn."""
    rows = (strip.text.rstrip() for strip in screen._compositor.render_strips())
    return "\n".join([*rows, ""])


def strips_of(update: RenderableType | None) -> list[Placed] | None:
    """The strips of a Textual update; None for any other renderable."""
    if isinstance(update, ChopsUpdate):
        return list(_span_places(update))
    if isinstance(update, LayoutUpdate):
        return list(_line_places(update))
    return None


def _span_places(update: ChopsUpdate) -> Iterator[Placed]:
    """The changed spans of some lines, column and row first."""
    for y, first, last in update.spans:
        line = update.chops[y]
        for end, (x, strip) in zip(update.chop_ends[y], line.items(), strict=False):
            if strip is None or x >= last or end <= first:
                continue
            left = max(x, first)
            yield left, y, strip.crop(left - x, min(end, last) - x)


def _line_places(update: LayoutUpdate) -> Iterator[Placed]:
    """Whole lines of a part of the screen, column and row first."""
    for y, line in enumerate(update.strips, update.region.y):
        x = update.region.x
        for strip in line:
            yield x, y, strip
            x += strip.cell_length


def cells_of(strip: Strip, colors: ColorSystem) -> list[Cell]:
    """A strip cell by cell."""
    found: list[Cell] = []
    for text, style, control in strip:
        if control:
            continue
        ansi = Strip.render_ansi(style, colors) if style is not None else ""
        blank = (" ", blank_style(ansi))
        if text.isascii() and text.isprintable():
            found += [blank if character == " " else (character, ansi) for character in text]
            continue
        for character in text:
            width = get_character_cell_size(character)
            if character == " ":
                found.append(blank)
            elif width:
                found += [(character, ansi), *[("", ansi)] * (width - 1)]
            elif found and not commands(character):
                found[-1] = (found[-1][0] + character, found[-1][1])
    return found
