"""A timer that is put off again and again, as for the silence after each piece of a reply."""

from __future__ import annotations

import asyncio
from collections.abc import Callable


class PutOffTimer:
    """Does one thing once some seconds have gone by; lives in the line's loop."""

    def __init__(self) -> None:
        self._timer: asyncio.TimerHandle | None = None
        self._due = 0.0
        self._action: Callable[[], None] | None = None

    def start(self, delay: float, action: Callable[[], None]) -> None:
        """Do this once so many seconds have gone by; a timer that is set for it is put off."""
        loop = asyncio.get_running_loop()
        self._due, before, self._action = loop.time() + delay, self._action, action
        if self._timer is not None and (before != action or self._timer.when() > self._due):
            self.stop()
        if self._timer is None:
            self._timer = loop.call_at(self._due, self._ring)

    def _ring(self) -> None:
        """The time that was set first is over; to set it anew for each piece costs more."""
        loop = asyncio.get_running_loop()
        if loop.time() < self._due:
            self._timer = loop.call_at(self._due, self._ring)
            return
        self._timer = None
        if self._action is not None:
            self._action()

    def stop(self) -> None:
        """Do nothing any more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
