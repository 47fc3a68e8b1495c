"""The clock that a session counts by, so that a test can move it on."""

from __future__ import annotations

import asyncio
import time
from datetime import datetime


class Clock:
    """Monotonic seconds for ages, the time of day for people; for any thread.

    The line keeps the real clock, as its wires and devices do.
    """

    def monotonic(self) -> float:
        """Seconds that only go forward."""
        return time.monotonic()

    def wall(self) -> float:
        """Seconds since 1970."""
        return time.time()

    def time_of_day(self) -> str:
        """The local time in 24 h."""
        return datetime.fromtimestamp(self.wall()).strftime("%H:%M:%S")

    async def sleep(self, seconds: float) -> None:
        """Let others go on for so many seconds; of a loop, and never less than one turn of it."""
        await asyncio.sleep(seconds)

    def of_line(self, told: float) -> float:
        """A moment that the line has told, time.monotonic(), on this clock."""
        return told


REAL_CLOCK = Clock()
