"""An app whose pictures go to the terminal as fast as it takes them, in as few bytes as can be.

Nothing is drawn that the terminal cannot take yet: what is late is left out, never queued. So a
key that comes back from a slow link finds no second-long row of pictures before its own.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from typing import Any

from rich.color import ColorSystem
from rich.console import RenderableType
from rich.control import Control
from textual.app import App
from textual.filter import LineFilter, Monochrome
from textual.screen import Screen

from .abilities import EVERYTHING, UTF_8, Abilities
from .lean import Picture, strips_of
from .pacing import ASK, WHOLE, Pacing

SIXTEEN = frozenset({ColorSystem.STANDARD, ColorSystem.WINDOWS})

FIRST_PIECE = 60
"""Bytes of the first piece of what hurries on a slow link: about a row."""

PACKETS_APART = 0.02
"""Seconds between that piece and the next."""

HURRY_FOR = 0.5
"""Seconds for which the output of a key precedes automatic changes."""


class LeanApp(App[None]):
    """Sends the difference between what is to be shown and what is, when the terminal can take it.

    `fit_terminal` learns before it runs what the terminal and the way to it are like.
    """

    def __init__(self) -> None:
        super().__init__()
        self.fit_terminal(EVERYTHING)
        self._hurries_until = float("-inf")
        self._later: asyncio.TimerHandle | None = None
        self._first_request = False
        self._begun = False
        """True if a frame was sent in part."""

    def fit_terminal(self, abilities: Abilities, *, slow: bool = False) -> None:
        """Use signs and colors that the terminal has.

        With `slow` the link is taken for slow until it has shown its rate.
        """
        self._colors = abilities.colors or ColorSystem.STANDARD
        self.plain_signs = abilities.encoding != UTF_8
        """True if the terminal has signs of ASCII only, or few more."""
        self.has_braille = abilities.braille
        """True if its font has the dots of braille."""
        self._instead = filters_for(abilities)
        self._picture = Picture(erases=abilities.erases)
        self._pacing = Pacing(slow=slow)

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Textual's own, but for its way to leave colors out, and those of this terminal."""
        own = [
            filter_ for filter_ in super().get_line_filters() if not isinstance(filter_, Monochrome)
        ]
        return [*own, *self._instead]

    def take_styles(self, screen: object) -> None:
        """Know the styles of a screen before it is shown; they concern nothing that is already
        shown.

        Textual would read all styles of the app again, and style everything that is shown.
        """
        for path in screen.css_path if isinstance(screen, Screen) else ():
            if not self.stylesheet.has_source(str(path), ""):
                self.stylesheet.read(path)

    def push_screen(self, screen: Any, *args: Any, **settings: Any) -> Any:
        """Show a screen over the others."""
        self.take_styles(screen)
        return super().push_screen(screen, *args, **settings)

    def switch_screen(self, screen: Any) -> Any:
        """Show a screen in place of the one on top."""
        self.take_styles(screen)
        return super().switch_screen(screen)

    def hurry(self) -> None:
        """Draw the next change at once: a person waits for it, or must see it."""
        self._hurries_until = time.monotonic() + HURRY_FOR

    def picture_taken(self, at: float) -> None:
        """The terminal has drawn the oldest frame on its way, and said so at this time."""
        self._pacing.answered(at)
        self._send()

    def _display(self, screen: Screen[object], renderable: RenderableType | None) -> None:
        strips = strips_of(renderable)
        if strips is None or not self._draws:
            super()._display(screen, renderable)
            return
        self._picture.want(strips, self._colors)
        self._send()
        self.post_display_hook()

    @property
    def _draws(self) -> bool:
        """True if there is a terminal, and a picture of it that is complete."""
        there = self._running and not self._closed and not self.is_headless
        return there and self._driver is not None and not self._batch_count

    def _send(self) -> None:
        """Draw what the terminal can take now; the rest when it has drawn that."""
        if self._picture.is_shown or not self._draws:
            return
        now = time.monotonic()
        if not self._first_request:
            # its answer tells how long the way is, before there is anything on it
            self._write("", now)
            self._first_request = self._begun = True
        hurry = now < self._hurries_until
        while room := self._pacing.room(now, hurry=hurry, rest=self._begun):
            first = hurry and room < WHOLE and not self._begun
            if frame := self._picture.frame(FIRST_PIECE if first else room):
                self._write(frame, now)
            self._begun = not self._picture.is_shown
            if not self._begun:
                break
            if first:  # in a packet of its own, which is shown before the rest has come
                self._later_by(PACKETS_APART)
                return
        self._look_later(now)

    def _write(self, frame: str, now: float) -> None:
        assert self._driver is not None
        if frame:
            at = self.screen.outer_size.clamp_offset(self.cursor_position)
            frame += Control.move_to(*at).segment.text
            self._begin_update()
            self._driver.write(frame)
            self._end_update()
        self._driver.write(ASK)
        self._driver.flush()
        self._pacing.sent(len(frame), now)

    def _look_later(self, now: float) -> None:
        """Check later: without an answer nothing else would send the rest."""
        wait = self._pacing.wait(now)
        if wait is not None and not self._picture.is_shown:
            self._later_by(wait)

    def _later_by(self, seconds: float) -> None:
        if self._later is not None:
            self._later.cancel()
        self._later = asyncio.get_running_loop().call_later(seconds, self._send)

    def on_mount(self) -> None:
        """A terminal that was left for a while may show something else."""
        self.app_resume_signal.subscribe(self, lambda _: self._anew())

    def on_resize(self) -> None:
        """Forget the terminal's contents, which are unknown after a change of size."""
        self._picture.clear()

    def action_redraw(self) -> None:
        """Draw the whole screen again: another program may have written to the terminal."""
        self._anew()
        self.hurry()
        self.refresh()

    def _anew(self) -> None:
        self._pacing.forget()
        self._picture.forget()


def filters_for(abilities: Abilities) -> list[LineFilter]:
    """Return the filters that adapt a picture to the terminal; none if it can show everything."""
    found: list[LineFilter] = []
    if abilities.encoding != UTF_8:
        from .few_colors import PlainSigns

        found.append(PlainSigns(abilities.encoding))
    if abilities.colors is None:
        from .few_colors import NoColors

        found.append(NoColors())
    elif abilities.colors in SIXTEEN:
        from .few_colors import SixteenColors

        found.append(SixteenColors())
    return found
