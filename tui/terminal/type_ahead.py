"""Keys one after another: what is typed ahead reaches the dialog that an earlier key opens.

Textual hands each key to the screen of that moment; a key that the screen does not take itself
comes back to the app's queue, behind those that were typed since. Without this the 30 of a
quickly typed `f30` would be keys of the screen below. Whether a key may do anything is asked when
its turn comes: a stop voids those that still wait.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from contextlib import suppress
from typing import Any, Protocol

from textual.app import App
from textual.dom import DOMNode
from textual.events import Key, Paste
from textual.message_pump import MessagePump
from textual.screen import Screen

from tui.safety import KEY_TOO_LATE

from .fields import takes_text
from .stroke import Stroke, attach, stroke_of

WAIT_LONGEST = 3.0
"""Seconds that a key waits at most for the one before: a slow computer builds a screen in less."""
LOOK = 0.05
"""Seconds between two looks whether a queue that is waited for is still that of the key."""

CURSOR_KEYS = frozenset(
    {"up", "down", "left", "right", "pageup", "pagedown", "home", "end", "tab", "shift+tab"}
)
"""Keys that move a cursor, and that a piece may move it with."""

EDITS = frozenset({"backspace", "delete"})

KEYS_REPORTED_AFTER = 0.1
"""Seconds after which the keys of a piece are reported without waiting for more."""


PASTE_IGNORED = "Pasted text ignored: it goes into a text field only."

Typed = Key | Paste


class Stamps(Protocol):
    """Needs of admission that not every app meets."""

    def stop_stamp(self) -> object:
        """Another object after every stop."""

    def only_shows(self, key: str, character: str | None) -> bool:
        """Return True if a key can only move a cursor, write text or show something now."""

    def ignored_keys_text(self, count: int, *, late: bool = False) -> None:
        """Report that keys came at once, or too late, and did nothing."""


class TypeAhead:
    """Lets the app take a key only when the one before has had its whole effect."""

    def __init__(self, app: App[None], stamps: Stamps) -> None:
        self._app = app
        self._stamps = stamps
        self._refused = 0
        """Keys that were refused and not reported yet."""
        self._late = False
        self._looking = False
        self._waiting: deque[Typed] = deque()
        self._taken: Typed | None = None
        self._task: asyncio.Task[None] | None = None
        self.done_to = float("-inf")
        """When the last key was read that had its whole effect, or was not taken."""

    @property
    def stroke(self) -> Stroke | None:
        """The stroke of the key that has its effect now; None while there is none."""
        return stroke_of(self._taken) if self._taken is not None else None

    def admit(self, typed: Typed) -> bool:
        """Return True if the app may take this key now; one that must wait comes again in its
        turn."""
        if self._taken is not None and typed is not self._taken:
            if not self._repeats_the_last(typed):
                self._waiting.append(typed)
            return False
        self._taken = typed
        if not self._admits(typed):
            self._call_next()
            return False
        self._task = asyncio.create_task(self._next())
        return True

    def _repeats_the_last(self, typed: Typed) -> bool:
        """Return True if it is a held key that waits already: it is to end with the key."""
        last = self._waiting[-1] if self._waiting else None
        if not isinstance(typed, Key) or not isinstance(last, Key) or typed.key != last.key:
            return False
        strokes = stroke_of(typed), stroke_of(last)
        return all(stroke is not None and stroke.held for stroke in strokes)

    async def _next(self) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(WAIT_LONGEST):
                await self._worked_off()
        self._call_next()

    def _call_next(self) -> None:
        if (stroke := self.stroke) is not None:
            self.done_to = max(self.done_to, stroke.read_at)
        self._taken = self._waiting.popleft() if self._waiting else None
        if self._taken is not None:
            self._app.post_message(self._taken)

    async def _worked_off(self) -> None:
        """Wait for every queue on the key's way, and for a screen that it opened."""
        while self._app.is_running:
            screen = self._app.screen
            at: DOMNode | None = self._app.focused or screen
            while at is not None:
                await self._emptied(at, screen)
                at = at.parent
            if self._top() is screen:
                return

    def _top(self) -> Screen[Any] | None:
        return self._app.screen if self._app.is_running else None

    async def _emptied(self, pump: MessagePump, screen: Screen[Any]) -> None:
        """Wait until a queue has handled its present contents, or belongs to another screen."""
        done = asyncio.Event()
        if not pump.call_later(done.set):
            return
        while not done.is_set() and pump.is_running and self._top() is screen:
            with suppress(TimeoutError):
                async with asyncio.timeout(LOOK):
                    await done.wait()

    def _admits(self, event: Key | Paste) -> bool:
        """Return True if the app may take a key or a paste now, when its turn has come."""
        if isinstance(event, Paste):
            is_text = takes_text(self._app.focused)
            if event.text and not is_text:
                self._app.notify(PASTE_IGNORED)
            return is_text
        stroke = stroke_of(event)
        if stroke is None:  # no terminal has sent it: a test, or the app itself
            attach(event, Stroke(time.monotonic(), self._stamps.stop_stamp()))
            return True
        if stroke.stamp != self._stamps.stop_stamp():
            return False  # a stop was the last word
        late = time.monotonic() - stroke.read_at > KEY_TOO_LATE
        if late:
            attach(event, stroke._replace(alone=False, held=False, steps=False))
        if (stroke.acts and not late) or self._harmless(event):
            return True
        self._count(late)
        return False

    def _harmless(self, event: Key) -> bool:
        """Return True if a key of a piece can only write text or move a cursor."""
        if event.key in CURSOR_KEYS:
            return True
        stroke = stroke_of(event)
        if stroke is not None and stroke.at_once:
            return self._stamps.only_shows(event.key, event.character)
        typed = event.is_printable or event.key in EDITS
        return typed and (takes_text(self._app.focused) or takes_text(self._app.screen))

    def _count(self, late: bool) -> None:
        self._refused += 1
        self._late = self._late or late
        if not self._looking:
            self._looking = True
            self._look(0)

    def _look(self, before: int) -> None:
        """Report once no more keys of the piece arrive."""
        if self._refused > before:
            now = self._refused
            self._app.set_timer(KEYS_REPORTED_AFTER, lambda: self._look(now))
            return
        count, late = self._refused, self._late
        self._refused, self._late, self._looking = 0, False, False
        self._stamps.ignored_keys_text(count, late=late)
