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
        """Do only this, once so many seconds have gone by; a timer that is set is put off."""
        loop = asyncio.get_running_loop()
        self._due, self._action = loop.time() + delay, action
        if self._timer is not None and self._timer.when() > self._due:
            self.stop()
        if self._timer is None:
            self._timer = loop.call_at(self._due, self._ring)

    def _ring(self) -> None:
        """The time that was set first is over; a new one for each piece costs more."""
        loop, self._timer = asyncio.get_running_loop(), None
        if self._action is None:
            return
        if loop.time() < self._due:
            self._timer = loop.call_at(self._due, self._ring)
        else:
            self._action()

    def leave(self) -> None:
        """Do nothing any more; where it is soon started again, that costs less than stop()."""
        self._action = None

    def stop(self) -> None:
        """Do nothing any more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
