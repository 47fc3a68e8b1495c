"""How long a new holder of a line waits for the programs of the one before."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

BACK_WITHIN = 2.0
"""Seconds in which programs come back, unless they are gone, too; while this one can be reached."""
BACK_AT_LATEST = 6.0
"""Seconds after which they count as gone in any case."""
BACK_LOOK = 0.1
"""Seconds between two looks. A late one counts as one: nobody was served in the meantime."""


class ComingBack:
    """Ends when every program that was on the line has had its time; for one loop.

    A computer that is short of time, as in a container with a quota, does not run this process for
    long: a program that has called in the meantime is heard first.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        is_greeting: Callable[[], bool],
        over: Callable[[], None],
    ) -> None:
        self._loop = loop
        self._is_greeting = is_greeting
        self._over = over
        self._begun = 0.0
        self._left = BACK_WITHIN
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Programs can reach this one from now on."""
        self._begun, self._left = self._loop.time(), BACK_WITHIN
        self._timer = self._loop.call_later(BACK_LOOK, self._look)

    def close(self) -> None:
        """Wait for nobody any more."""
        if self._timer is not None:
            self._timer.cancel()

    def _look(self) -> None:
        self._left -= BACK_LOOK
        waits = self._left > 0 or self._is_greeting()
        if waits and self._loop.time() < self._begun + BACK_AT_LATEST:
            self._timer = self._loop.call_later(BACK_LOOK, self._look)
        else:
            self._over()
