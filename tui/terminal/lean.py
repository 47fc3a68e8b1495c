"""Updates that send to the terminal only the cells that look different.

Textual 8.2 sends a changed part of a widget from its left edge on, a new screen as a whole and
several times over, and sets every colour anew for each piece of text; over a slow link that is
most of what a panel sends.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import cast

from rich.cells import get_character_cell_size
from rich.color import ColorSystem
from rich.console import Console, RenderableType
from textual._compositor import ChopsUpdate, CompositorUpdate, LayoutUpdate
from textual.app import App
from textual.screen import Screen
from textual.strip import Strip

from tui.drive.plain import commands

Cell = tuple[str, str]
"""A character and its colours; none where the one to the left takes two cells."""

CURSOR_MOVE = 8
"""Bytes that moving the cursor takes: cells that stay the same between others are sent again."""


class Shown:
    """What the terminal shows, as far as the updates sent so far tell."""

    def __init__(self) -> None:
        self._rows: dict[int, list[Cell | None]] = {}

    def forget(self) -> None:
        """The terminal may show something else: it was resized, or others have written to it."""
        self._rows.clear()

    def put(self, x: int, y: int, cells: Sequence[Cell]) -> list[tuple[int, int]]:
        """Take cells that are to be shown from a place on; the runs of them that must be sent."""
        row = self._rows.setdefault(y, [])
        row.extend([None] * (x + len(cells) - len(row)))
        found: list[tuple[int, int]] = []
        for place, cell in enumerate(cells):
            if row[x + place] == cell:
                continue
            row[x + place] = cell
            # the second half of a wide character is sent with the first
            first = place if cell[0] else max(0, place - 1)
            if found and first - found[-1][1] < CURSOR_MOVE:
                found[-1] = (found[-1][0], place + 1)
            else:
                found.append((first, place + 1))
        return found


def lean(update: RenderableType | None, shown: Shown) -> RenderableType | None:
    """The same update in fewer bytes, given what the terminal shows."""
    if isinstance(update, ChopsUpdate):
        return cast("RenderableType", LeanUpdate(list(_of_spans(update)), shown))
    if isinstance(update, LayoutUpdate):
        return cast("RenderableType", LeanUpdate(list(_of_lines(update)), shown))
    return update


class LeanUpdate(CompositorUpdate):
    """Strips at their places, cut to the cells that changed."""

    def __init__(self, strips: list[tuple[int, int, Strip]], shown: Shown) -> None:
        self._strips = strips
        self._shown = shown

    def render_segments(self, console: Console) -> str:
        """What goes to the terminal, which shows it from then on."""
        colours = console._color_system or ColorSystem.TRUECOLOR
        pen = Pen()
        for x, y, strip in self._strips:
            cells = cells_of(strip, colours)
            for first, end in self._shown.put(x, y, cells):
                pen.write(x + first, y, cells[first:end])
        return pen.text()


def _of_spans(update: ChopsUpdate) -> Iterator[tuple[int, int, Strip]]:
    """The changed spans of some lines, column and row first."""
    for y, first, last in update.spans:
        line = update.chops[y]
        for end, (x, strip) in zip(update.chop_ends[y], line.items(), strict=False):
            if strip is None or x >= last or end <= first:
                continue
            left = max(x, first)
            yield left, y, strip.crop(left - x, min(end, last) - x)


def _of_lines(update: LayoutUpdate) -> Iterator[tuple[int, int, Strip]]:
    """Whole lines of a part of the screen, column and row first."""
    for y, line in enumerate(update.strips, update.region.y):
        x = update.region.x
        for strip in line:
            yield x, y, strip
            x += strip.cell_length


def cells_of(strip: Strip, colours: ColorSystem) -> list[Cell]:
    """A strip cell by cell."""
    found: list[Cell] = []
    for text, style, control in strip:
        if control:
            continue
        ansi = Strip.render_ansi(style, colours) if style is not None else ""
        for character in text:
            width = get_character_cell_size(character)
            if width:
                found += [(character, ansi), *[("", ansi)] * (width - 1)]
            elif found and not commands(character):
                found[-1] = (found[-1][0] + character, found[-1][1])
    return found


class Pen:
    """Writes cells; moves and changes colour only where it has to."""

    def __init__(self) -> None:
        self._parts: list[str] = []
        self._at: tuple[int, int] | None = None
        self._ansi = ""

    def write(self, x: int, y: int, cells: Sequence[Cell]) -> None:
        """Write cells from a place on."""
        if self._at != (x, y):
            self._parts.append(f"\x1b[{y + 1};{x + 1}H")
        for text, ansi in cells:
            if ansi != self._ansi:
                self._parts.append(f"\x1b[0;{ansi}m" if ansi else "\x1b[0m")
                self._ansi = ansi
            self._parts.append(text)
        self._at = (x + len(cells), y)

    def text(self) -> str:
        """All that was written, with colours as they were before."""
        if self._ansi:
            self._parts.append("\x1b[0m")
            self._ansi = ""
        return "".join(self._parts)


class LeanApp(App[None]):
    """An app that sends what changed in as few bytes as that takes."""

    def __init__(self) -> None:
        super().__init__()
        self._terminal = Shown()

    def _display(self, screen: Screen[object], renderable: RenderableType | None) -> None:
        super()._display(screen, lean(renderable, self._terminal))

    def on_mount(self) -> None:
        """A terminal that was left for a while may show something else."""
        self.app_resume_signal.subscribe(self, lambda _: self._terminal.forget())

    def on_resize(self) -> None:
        """What a terminal of another size shows is not known."""
        self._terminal.forget()

    def action_redraw(self) -> None:
        """Draw the whole screen anew: something else may have written to the terminal."""
        self._terminal.forget()
        self.refresh()
