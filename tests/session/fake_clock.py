"""A clock that a test moves on, so that nobody waits for what takes its time."""

from __future__ import annotations

import asyncio
import time
from bisect import bisect_right
from collections.abc import Callable

from tui.session.clock import Clock

TURN = 0.005
"""Real seconds after which a sleeper looks whether the clock was moved on."""

MOMENT = 0.04
"""Real seconds that a step of `let_go_until` leaves to the line."""


class FakeClock(Clock):
    """The real clock, ahead of it by all that a test has advanced it; for any thread.

    Given to a session and to the simulated drives it moves both; the line's wires stay real.
    """

    def __init__(self) -> None:
        self._since: tuple[float, ...] = (0.0,)
        self._ahead: tuple[float, ...] = (0.0,)

    def advance(self, seconds: float) -> None:
        """Let so many seconds go by at once."""
        ahead = self._ahead[-1] + seconds
        # the longer one first: another thread may look between the two
        self._ahead = (*self._ahead, ahead)
        self._since = (*self._since, time.monotonic())

    def monotonic(self) -> float:
        """Seconds that only go forward."""
        return time.monotonic() + self._ahead[-1]

    def wall(self) -> float:
        """Seconds since 1970."""
        return time.time() + self._ahead[-1]

    async def sleep(self, seconds: float) -> None:
        """Until so many seconds have gone by, or were let go by."""
        end = self.monotonic() + seconds
        await asyncio.sleep(0)
        while (left := end - self.monotonic()) > 0:  # noqa: ASYNC110 - any thread advances it
            await asyncio.sleep(min(left, TURN))

    def line_time(self, reported: float) -> float:
        """A real moment on this clock: what was advanced since then is not in it."""
        return reported + self._ahead[bisect_right(self._since, reported) - 1]


async def let_go_until(
    clock: FakeClock, holds: Callable[[], bool], step: float = 0.25, patience: float = 30.0
) -> None:
    """Let time go by in steps, each with a real moment in which a line can carry something.

    `patience` is in real seconds.
    """
    end = time.monotonic() + patience
    while not holds():
        assert time.monotonic() < end, "it did not come to that"
        clock.advance(step)
        await asyncio.sleep(MOMENT)
