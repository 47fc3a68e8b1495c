"""The time of a line shared out among everything that asks again and again."""

from __future__ import annotations

import threading
from collections.abc import Hashable

SHARE = 0.9
"""Share of the line's time that regular polls may take; the rest is the operator's."""


class Pace:
    """Stretches all wished periods by one factor, so that together they fit the line.

    May be used from any thread.
    """

    def __init__(self) -> None:
        self._wishes: dict[Hashable, float] = {}
        self._lock = threading.Lock()
        self.others = 0.0
        """Share of the line's time that other programs' polls take."""

    @property
    def own(self) -> float:
        """Share of the line's time that this program's polls wish for."""
        with self._lock:
            return sum(self._wishes.values())

    def claim(self, who: Hashable, seconds: float, period: float) -> float:
        """Tell a wish: so many seconds of the line in each period; returns the period to keep."""
        with self._lock:
            self._wishes[who] = seconds / period
            return period * max(1.0, (sum(self._wishes.values()) + self.others) / SHARE)

    @property
    def busy(self) -> bool:
        """Whether anybody asks again and again."""
        return bool(self._wishes)

    def release(self, who: Hashable) -> None:
        """Wish for nothing any more."""
        with self._lock:
            self._wishes.pop(who, None)
