"""A clock that a test advances, so that no test waits for slow steps."""

from __future__ import annotations

import asyncio
import time
from bisect import bisect_right
from collections.abc import Callable

from tui.session.clock import Clock

TURN = 0.005
"""Real seconds after which a sleeper checks if the clock was advanced."""

MOMENT = 0.04
"""Real seconds that a step of `let_go_until` gives the line."""


class FakeClock(Clock):
    """The real clock plus the time that a test has advanced it. Thread-safe.

    Given to a session and to the simulated drives it moves both; the line's wires stay real.
    """

    def __init__(self) -> None:
        self._since: tuple[float, ...] = (0.0,)
        self._ahead: tuple[float, ...] = (0.0,)

    def advance(self, seconds: float) -> None:
        """Advance by these seconds immediately."""
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
        """Sleep until these seconds have passed or were advanced."""
        end = self.monotonic() + seconds
        await asyncio.sleep(0)
        while (left := end - self.monotonic()) > 0:  # noqa: ASYNC110 - any thread advances it
            await asyncio.sleep(min(left, TURN))

    def line_time(self, reported: float) -> float:
        """Convert a real time to this clock, without later advances."""
        return reported + self._ahead[bisect_right(self._since, reported) - 1]


async def let_go_until(
    clock: FakeClock, holds: Callable[[], bool], step: float = 0.25, patience: float = 30.0
) -> None:
    """Advance time in steps, each with a real moment for the line.

    `patience` is in real seconds.
    """
    end = time.monotonic() + patience
    while not holds():
        assert time.monotonic() < end, "it did not come to that"
        clock.advance(step)
        await asyncio.sleep(MOMENT)
