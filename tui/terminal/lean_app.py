"""An app that sends pictures as fast as the terminal accepts them, in as few bytes as possible.

Nothing is drawn before the terminal can accept it: late pictures are skipped, never queued. So the
effect of a key on a slow link does not wait behind seconds of older pictures.

The queue of a pseudo-terminal does not show what sshd and the network hold. So each frame is
followed by a cursor request (`ASK`). The terminal answers after it has drawn the frame, and the
next frame waits for that.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Sequence
from typing import Any, Final

from rich.color import ColorSystem
from rich.console import RenderableType
from textual.app import App
from textual.filter import LineFilter, Monochrome
from textual.screen import Screen

from .abilities import EVERYTHING, UTF_8, Abilities
from .fields import takes_text
from .lean import Picture, strips_of

ASK: Final = "\x1b[6n"
"""Requests the cursor position; every terminal since the VT100 answers."""

MUTE_AFTER: Final = 2.0
"""Seconds that a frame waits for the answer of a terminal that has never answered."""

LOST_AFTER: Final = 10.0
"""Seconds after which an answer counts as lost, if earlier ones came."""

PIECE_LEAST: Final = 300
"""Bytes that a piece of a frame may always have. SSH delivers a piece once it is complete."""

AHEAD: Final = 450
"""Bytes that may be on the way when urgent output follows."""

AHEAD_OF_REST: Final = 900
"""The same for the rest of a frame: so a link with a long delay stays busy."""

WHOLE: Final = 1 << 20
"""More bytes than any frame has."""

PIECE_TIME: Final = 0.3
"""Seconds that the link may take for one piece of a frame, above its shortest round trip."""

GROWTH: Final = 4
"""Factor by which the piece grows after a fast one."""

OWED_MOST: Final = 32
"""Unanswered requests that are remembered at most."""


class Pacing:
    """Counts the frames that a terminal has not answered yet; the answers measure the link.

    With `slow` the link counts as slow until its rate has been measured.
    """

    def __init__(self, *, slow: bool = False) -> None:
        self._requested: deque[tuple[float, int]] = deque(maxlen=OWED_MOST)
        self._answers = False
        self._quickest = float("inf")
        self._piece = PIECE_LEAST if slow else WHOLE

    def sent(self, size: int, now: float) -> None:
        """Note that `size` bytes were sent, followed by a cursor request."""
        self._requested.append((now, size))

    def answered(self, now: float) -> None:
        """Note an answer: the oldest frame on the way has been drawn."""
        self._answers = True
        if not self._requested:
            return  # it had counted as lost
        since, size = self._requested.popleft()
        self._quickest = min(self._quickest, now - since)
        self._learn(size, now - since - self._quickest)

    def _learn(self, size: int, took: float) -> None:
        """Adapt the size of a piece to the time that the last one took."""
        if took > 2 * PIECE_TIME:
            self._piece = max(PIECE_LEAST, int(size * PIECE_TIME / took))
        elif took < PIECE_TIME / 4 and size > self._piece / 2:
            self._piece = min(WHOLE, GROWTH * self._piece)

    def room(self, now: float, *, hurry: bool = False, rest: bool = False) -> int:
        """Bytes that may be sent now; 0 while the last frame is on the way.

        Urgent output (after a key, a stop, a fault) and the `rest` of a frame may be sent sooner,
        while only a small piece is on the way.
        """
        on_its_way, mute = self._on_its_way(now), self._is_mute(now)
        ahead = AHEAD_OF_REST if rest else AHEAD if hurry else 0
        if on_its_way and sum(on_its_way) > ahead and not (mute and (hurry or rest)):
            return 0
        return WHOLE if mute else self._piece

    def wait(self, now: float) -> float | None:
        """Seconds until the awaited answer counts as lost; None if none is awaited."""
        if not self._on_its_way(now):
            return None
        return max(0.0, self._requested[-1][0] + self._patience - now)

    def forget(self) -> None:
        """Expect no more answers, because the app was suspended."""
        self._requested.clear()

    @property
    def _patience(self) -> float:
        return LOST_AFTER if self._answers else MUTE_AFTER

    def _is_mute(self, now: float) -> bool:
        """Return True if the terminal never answered, although it had the time."""
        return (
            not self._answers
            and bool(self._requested)
            and now >= self._requested[0][0] + MUTE_AFTER
        )

    def _on_its_way(self, now: float) -> list[int]:
        """The sizes of the frames whose answers are awaited; an empty one counts as a byte."""
        if self._answers:
            while self._requested and now >= self._requested[0][0] + self._patience:
                self._requested.popleft()
        return [max(1, size) for at, size in self._requested if now < at + self._patience]


SIXTEEN = frozenset({ColorSystem.STANDARD, ColorSystem.WINDOWS})

FIRST_PIECE = 60
"""Bytes of the first piece of urgent output on a slow link: about one row."""

PACKETS_APART = 0.02
"""Seconds between that piece and the next."""

HURRY_FOR = 0.5
"""Seconds after a key in which changes are sent as urgent."""


class LeanApp(App[None]):
    """Sends differences between intended and present contents when the terminal can accept them.

    Call `fit_terminal` with the terminal's abilities before the app runs.
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
        """Use only signs and colors that the terminal has.

        With `slow` the link counts as slow until its rate has been measured.
        """
        self._colors = abilities.colors or ColorSystem.STANDARD
        self.plain_signs = abilities.encoding != UTF_8
        """True if the terminal has ASCII characters only, or few more."""
        self.has_braille = abilities.braille
        """True if its font has the dots of braille."""
        self.has_colors = abilities.colors is not None
        self._instead = filters_for(abilities)
        self._picture = Picture(erases=abilities.erases)
        self._pacing = Pacing(slow=slow)

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Textual's filters except its monochrome one, and those for this terminal."""
        own = [
            filter_ for filter_ in super().get_line_filters() if not isinstance(filter_, Monochrome)
        ]
        return [*own, *self._instead]

    def take_styles(self, screen: object) -> None:
        """Load the styles of a screen before it is shown; they affect nothing already shown.

        Textual would reload all styles of the app, and restyle everything shown.
        """
        for path in screen.css_path if isinstance(screen, Screen) else ():
            if not self.stylesheet.has_source(str(path), ""):
                self.stylesheet.read(path)

    def push_screen(self, screen: Any, *args: Any, **settings: Any) -> Any:
        """Show a screen over the others."""
        self.take_styles(screen)
        return super().push_screen(screen, *args, **settings)

    def switch_screen(self, screen: Any) -> Any:
        """Show a screen instead of the one on top."""
        self.take_styles(screen)
        return super().switch_screen(screen)

    def hurry(self) -> None:
        """Send the next changes as urgent: a person waits for them, or must see them."""
        self._hurries_until = time.monotonic() + HURRY_FOR

    def picture_taken(self, at: float) -> None:
        """Note that the terminal reported at this time that it drew the oldest pending frame."""
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
        """True if there is a terminal and no update is being collected."""
        there = self._running and not self._closed and not self.is_headless
        return there and self._driver is not None and not self._batch_count

    def _send(self) -> None:
        """Send what the terminal can accept now; send the rest after it has drawn that."""
        if self._picture.is_shown or not self._draws:
            return
        now = time.monotonic()
        if not self._first_request:
            # the answer shows the round trip of the empty link
            self._write("", now)
            self._first_request = self._begun = True
        hurry = now < self._hurries_until
        while room := self._pacing.room(now, hurry=hurry, rest=self._begun):
            first = hurry and room < WHOLE and not self._begun
            if frame := self._picture.frame(FIRST_PIECE if first else room, self._cursor()):
                self._write(frame, now)
            self._begun = not self._picture.is_shown
            if not self._begun:
                break
            if first:  # in a packet of its own, which is shown before the rest arrives
                self._later_by(PACKETS_APART)
                return
        self._look_later(now)

    def _write(self, frame: str, now: float) -> None:
        assert self._driver is not None
        if frame:
            self._begin_update()
            self._driver.write(frame)
            self._end_update()
        self._driver.write(ASK)
        self._driver.flush()
        self._pacing.sent(len(frame), now)

    def _cursor(self) -> tuple[int, int]:
        """The place of the terminal's hidden cursor: in a text field, for input methods."""
        if not takes_text(self.focused):
            return 0, 0
        return self.screen.outer_size.clamp_offset(self.cursor_position)

    def _look_later(self, now: float) -> None:
        """Try again later: if the terminal does not answer, nothing else sends the rest."""
        wait = self._pacing.wait(now)
        if wait is not None and not self._picture.is_shown:
            self._later_by(wait)

    def _later_by(self, seconds: float) -> None:
        if self._later is not None:
            self._later.cancel()
        self._later = asyncio.get_running_loop().call_later(seconds, self._send)

    def on_mount(self) -> None:
        """Redraw after the app was suspended: the terminal may show something else."""
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
