"""Updates that send to the terminal only the cells that were drawn anew.

Textual 8.2 sends a changed part of a widget from the widget's left edge on and sets every
colour anew for each piece of text; over a slow link that is most of what a panel sends.
"""

from __future__ import annotations

from typing import cast

from rich.color import ColorSystem
from rich.console import Console, RenderableType
from rich.style import Style
from textual._compositor import ChopsUpdate, CompositorUpdate
from textual.strip import Strip


def lean(update: RenderableType | None) -> RenderableType | None:
    """The same update in fewer bytes, where it is one of single spans."""
    if isinstance(update, ChopsUpdate):
        return cast("RenderableType", LeanUpdate(update))
    return update


class LeanUpdate(CompositorUpdate):
    """Spans of the screen, each cut to the cells that changed."""

    def __init__(self, update: ChopsUpdate) -> None:
        self._update = update

    def render_segments(self, console: Console) -> str:
        """What goes to the terminal."""
        pen = Pen(console._color_system or ColorSystem.TRUECOLOR)
        for y, first, last in self._update.spans:
            line = self._update.chops[y]
            for end, (x, strip) in zip(self._update.chop_ends[y], line.items(), strict=False):
                if strip is None or x >= last or end <= first:
                    continue
                left = max(x, first)
                pen.write(left, y, strip.crop(left - x, min(end, last) - x))
        return pen.text()


class Pen:
    """Writes strips; moves and changes colour only where it has to."""

    def __init__(self, colours: ColorSystem) -> None:
        self._colours = colours
        self._parts: list[str] = []
        self._at: tuple[int, int] | None = None
        self._ansi = ""

    def write(self, x: int, y: int, strip: Strip) -> None:
        """Write a strip from a cell on."""
        if self._at != (x, y):
            self._parts.append(f"\x1b[{y + 1};{x + 1}H")
        for text, style, control in strip:
            if text and not control:
                self._write(text, style)
        self._at = (x + strip.cell_length, y)

    def _write(self, text: str, style: Style | None) -> None:
        if style is not None and style.link:
            self._parts.append("\x1b[0m" if self._ansi else "")
            self._parts.append(Strip.render_style(style, text, self._colours))
            self._ansi = ""
            return
        ansi = Strip.render_ansi(style, self._colours) if style is not None else ""
        if ansi != self._ansi:
            self._parts.append(f"\x1b[0;{ansi}m" if ansi else "\x1b[0m")
            self._ansi = ansi
        self._parts.append(text)

    def text(self) -> str:
        """All that was written, with colours as they were before."""
        if self._ansi:
            self._parts.append("\x1b[0m")
            self._ansi = ""
        return "".join(self._parts)
