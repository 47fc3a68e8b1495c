"""Clock of a session, which a test can replace, and waiting times on a slow line."""

from __future__ import annotations

import asyncio
import time
from datetime import datetime
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine

SET_BY = 0.1
"""Least shift in seconds between both clocks that counts as a change of the computer's time."""


class Clock:
    """Monotonic seconds for ages, and the time of day for people. Thread-safe.

    The line always uses the real clock, because its devices do.
    """

    _apart = 0.0
    """Seconds since 1970 minus monotonic seconds."""

    def monotonic(self) -> float:
        """Return seconds that never go back."""
        return time.monotonic()

    def wall(self) -> float:
        """Return seconds since 1970."""
        return time.time()

    def wall_of(self, moment: float) -> float:
        """Convert a monotonic time to seconds since 1970.

        Repeated calls return the same result, unless the computer's time was set in between.
        """
        apart = self.wall() - self.monotonic()
        if abs(apart - self._apart) > SET_BY:
            self._apart = apart
        return moment + self._apart

    def time_of_day(self) -> str:
        """Return the local time as HH:MM:SS."""
        return datetime.fromtimestamp(self.wall()).strftime("%H:%M:%S")

    async def sleep(self, seconds: float) -> None:
        """Sleep for some seconds; even 0 lets other tasks of the loop run once."""
        await asyncio.sleep(seconds)

    def line_time(self, reported: float) -> float:
        """Convert a time that the line reported (time.monotonic()) to this clock."""
        return reported


REAL_CLOCK = Clock()

SLOW_CHARACTERS = 1200
"""Characters that other programs may send meanwhile: at 1200 baud 11 s, at 19200 0.7 s."""


def patience(line: ModbusLine, seconds: float) -> float:
    """So many seconds, and longer on a slow line: what takes ten exchanges takes seconds there."""
    from tui.bus.link import character_time

    return seconds + SLOW_CHARACTERS * character_time(line.link)
