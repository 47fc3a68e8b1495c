"""Keys one after another: what is typed ahead reaches the dialog that an earlier key opens.

Textual hands each key to the screen of that moment; a key that the screen does not take itself
comes back to the app's queue, behind those that were typed since. Without this the 30 of a
quickly typed `f30` would be keys of the screen below. Whether a key may do anything is asked when
its turn comes: a stop voids those that still wait.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from textual.app import App
from textual.dom import DOMNode
from textual.events import Key, Paste
from textual.message_pump import MessagePump
from textual.screen import Screen

from .stroke import Stroke, stroke_of

WAIT_LONGEST = 3.0
"""Seconds that a key waits at most for the one before: a slow computer builds a screen in less."""
LOOK = 0.05
"""Seconds between two looks whether a queue that is waited for is still that of the key."""

Typed = Key | Paste


class TypeAhead:
    """Lets the app take a key only when the one before has had its whole effect."""

    def __init__(self, app: App[None], admits: Callable[[Typed], bool]) -> None:
        self._app = app
        self._admits = admits
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
