"""Type-ahead: keys take effect one after another, so that they reach a dialog that a key opens.

Textual sends each key to the present screen. A key that the screen does not handle returns to the
app's queue, after keys typed since. Without this module, the 30 of a quickly typed `f30` would go
to the screen below. Each key is checked when its turn comes: a stop discards keys that still wait.
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
"""Seconds that a key waits at most for the one before; a slow computer builds a screen in less."""
QUEUE_CHECK_INTERVAL = 0.05
"""Seconds between two checks if the awaited queue still belongs to the present screen."""

CURSOR_KEYS = frozenset(
    {"up", "down", "left", "right", "pageup", "pagedown", "home", "end", "tab", "shift+tab"}
)
"""Keys that move a cursor, even in a burst."""

EDITS = frozenset({"backspace", "delete"})

KEYS_REPORTED_AFTER = 0.1
"""Seconds without another ignored key, after which ignored keys are reported."""


PASTE_IGNORED = "Pasted text ignored: it goes into a text field only."

Typed = Key | Paste


class Stamps(Protocol):
    """Methods that the app provides for type-ahead."""

    def stop_stamp(self) -> object:
        """Return a value that changes with every stop."""

    def only_shows(self, key: str, character: str | None) -> bool:
        """Return True if a key can only move a cursor, type text or show something now."""

    def report_ignored_keys(self, count: int, *, late: bool = False) -> None:
        """Report keys that were ignored because they arrived together, or too `late`."""


class TypeAhead:
    """Gives the app a key only after the one before has taken full effect."""

    def __init__(self, app: App[None], stamps: Stamps) -> None:
        self._app = app
        self._stamps = stamps
        self._refused = 0
        """Number of ignored keys that are not reported yet."""
        self._late = False
        self._looking = False
        self._waiting: deque[Typed] = deque()
        self._taken: Typed | None = None
        self._task: asyncio.Task[None] | None = None
        self.done_to = float("-inf")
        """When the last key that took full effect, or was ignored, was read."""

    @property
    def stroke(self) -> Stroke | None:
        """The stroke of the key that is taking effect now, or None."""
        return stroke_of(self._taken) if self._taken is not None else None

    def admit(self, typed: Typed) -> bool:
        """Return True if the app may handle this key now; if not yet, it is posted again."""
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
        """Return True for a repeat of a held key that waits already: it must end on release."""
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
        """Wait for every message queue on the key's way, and for a screen that it opened."""
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
        """Wait until a queue has handled its present messages, or another screen is on top."""
        done = asyncio.Event()
        if not pump.call_later(done.set):
            return
        while not done.is_set() and pump.is_running and self._top() is screen:
            with suppress(TimeoutError):
                async with asyncio.timeout(QUEUE_CHECK_INTERVAL):
                    await done.wait()

    def _admits(self, event: Key | Paste) -> bool:
        """Return True if a key or a paste may take effect, now that its turn has come."""
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
            return False  # a stop discards keys typed before it
        late = time.monotonic() - stroke.read_at > KEY_TOO_LATE
        if late:
            attach(event, stroke._replace(alone=False, held=False, steps=False))
        if (stroke.acts and not late) or self._harmless(event):
            return True
        self._count(late)
        return False

    def _harmless(self, event: Key) -> bool:
        """Return True if a key of a burst can only type text or move a cursor."""
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
        """Report the ignored keys once no more arrive."""
        if self._refused > before:
            now = self._refused
            self._app.set_timer(KEYS_REPORTED_AFTER, lambda: self._look(now))
            return
        count, late = self._refused, self._late
        self._refused, self._late, self._looking = 0, False, False
        self._stamps.report_ignored_keys(count, late=late)
