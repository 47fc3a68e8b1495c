"""Keys one after another: what is typed ahead reaches the dialog that an earlier key opens.

Textual hands each key to the screen of that moment; a key that the screen does not take itself
comes back to the app's queue, behind those that were typed since. Without this the 30 of a
quickly typed `f30` would be keys of the screen below.
"""

from __future__ import annotations

import asyncio
from collections import deque
from contextlib import suppress

from textual.app import App
from textual.dom import DOMNode
from textual.events import Key
from textual.message_pump import MessagePump

LONGEST = 0.3
"""Seconds that a key waits at most for the one before."""


class KeysInTurn:
    """Lets the app take a key only when the one before has had its whole effect."""

    def __init__(self, app: App[None]) -> None:
        self._app = app
        self._waiting: deque[Key] = deque()
        self._taken: Key | None = None
        self._task: asyncio.Task[None] | None = None

    def admit(self, key: Key) -> bool:
        """Whether the app may take this key now; another one comes again in its turn."""
        if self._taken is not None and key is not self._taken:
            self._waiting.append(key)
            return False
        self._taken = key
        self._task = asyncio.create_task(self._next())
        return True

    async def _next(self) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(LONGEST):
                await self._worked_off()
        self._taken = self._waiting.popleft() if self._waiting else None
        if self._taken is not None:
            self._app.post_message(self._taken)

    async def _worked_off(self) -> None:
        """Wait for every queue on the key's way, and for a screen that it opened."""
        while True:
            screen = self._app.screen
            at: DOMNode | None = self._app.focused or screen
            while at is not None:
                await _emptied(at)
                at = at.parent
            if self._app.screen is screen:
                return


async def _emptied(pump: MessagePump) -> None:
    """Wait until a queue has come to what is in it now."""
    done = asyncio.Event()
    if pump.call_later(done.set):
        await done.wait()
