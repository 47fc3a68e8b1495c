"""The clock that a session counts by, so that a test can move it on."""

from __future__ import annotations

import asyncio
import time
from datetime import datetime

SET_BY = 0.1
"""Seconds by which the time of day must move against the other one to count as set again."""


class Clock:
    """Monotonic seconds for ages, the time of day for people; for any thread.

    The line keeps the real clock, as its wires and devices do.
    """

    _apart = 0.0
    """Seconds that the time of day is ahead of the monotonic clock."""

    def monotonic(self) -> float:
        """Seconds that only go forward."""
        return time.monotonic()

    def wall(self) -> float:
        """Seconds since 1970."""
        return time.time()

    def wall_of(self, moment: float) -> float:
        """When a monotonic moment was, in seconds since 1970.

        The same for one moment, whenever it is asked for, unless the computer's time was set.
        """
        apart = self.wall() - self.monotonic()
        if abs(apart - self._apart) > SET_BY:
            self._apart = apart
        return moment + self._apart

    def time_of_day(self) -> str:
        """The local time in 24 h."""
        return datetime.fromtimestamp(self.wall()).strftime("%H:%M:%S")

    async def sleep(self, seconds: float) -> None:
        """Let others go on for so many seconds; of a loop, and never less than one turn of it."""
        await asyncio.sleep(seconds)

    def line_time(self, reported: float) -> float:
        """A moment that the line has told, time.monotonic(), on this clock."""
        return reported


REAL_CLOCK = Clock()
