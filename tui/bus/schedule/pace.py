"""Division of the line's time among all regular polls.

The holder of the line finds one factor for the periods of all programs; see PollsServed.
"""

from __future__ import annotations

import threading
from collections.abc import Hashable, Mapping

from ..bounds import MOST_SHARE
from ..poll_plan import PollCarrier

SHARE = 0.9
"""Share of the line's time that regular polls may take; the rest is the operator's."""


class Pace:
    """Stretches all wished periods by one factor, so that together they fit the line.

    Of wishes by several programs about one device the greatest counts: they share what is read.
    May be used from any thread.
    """

    def __init__(self) -> None:
        self._wishes: dict[Hashable, tuple[int, float]] = {}
        self._lock = threading.Lock()
        self.others: Mapping[int, float] = {}
        """Share of the line's time that polls of other programs request, by device."""
        self.stretch = 1.0
        """The factor by which the holder of the line lengthens the periods of all programs."""
        self.carrier: PollCarrier | None = None
        """Has polls carried out by the process that holds the line; None in that process."""

    @property
    def own(self) -> dict[int, float]:
        """Share of the line's time that this program's polls wish for, by device."""
        shares: dict[int, float] = {}
        with self._lock:
            for device, share in self._wishes.values():
                shares[device] = shares.get(device, 0.0) + share
        return {device: min(share, MOST_SHARE) for device, share in shares.items()}

    def claim(self, who: Hashable, device: int, seconds: float, period: float) -> float:
        """Announce a wish: so many seconds of the line in each period; returns the period to
        keep."""
        with self._lock:
            self._wishes[who] = device, seconds / period
        wished = sum(greatest(self.own, self.others).values())
        return period * max(1.0, wished / SHARE, self.stretch)

    @property
    def busy(self) -> bool:
        """True if there are regular polls."""
        return bool(self._wishes)

    def release(self, who: Hashable) -> None:
        """Withdraw all requested shares."""
        with self._lock:
            self._wishes.pop(who, None)


def greatest(*wishes: Mapping[int, float]) -> dict[int, float]:
    """The greatest wish about each device."""
    found: dict[int, float] = {}
    for wish in wishes:
        for device, share in wish.items():
            found[device] = max(share, found.get(device, 0.0))
    return found
