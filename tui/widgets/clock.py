"""The clock of the panel, so that a test can hold it still."""

from __future__ import annotations

import time
from datetime import datetime


class Clock:
    """Monotonic seconds for ages, the time of day for people."""

    def monotonic(self) -> float:
        """Seconds that only go forward."""
        return time.monotonic()

    def time_of_day(self) -> str:
        """The local time in 24 h."""
        return datetime.now().strftime("%H:%M:%S")
