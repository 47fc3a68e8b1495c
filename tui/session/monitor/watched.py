"""Monitoring of one drive: its times, gaps and readers, and the last trip in the journal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from ..journal import Entry
from ..journal_reading import time_of
from .trend import TREND_QUANTITIES, TrendPoint

TREND_GAP = 5.0
"""Seconds between two points of a trend from which it has a gap."""


@dataclass(frozen=True, slots=True)
class SeenTrip:
    """A trip, or a fault that was there at the first read; times in seconds since 1970."""

    wall: float
    fault: str
    """Code and name of the fault; empty if they are not known."""
    tripped: bool
    """True if the trip itself was seen."""
    reset: float | None = None
    """Time at which its end was seen."""


@dataclass(frozen=True, slots=True)
class Watched:
    """Monitoring of one drive; times are monotonic, in seconds."""

    own: float | None
    """Time since which this program has read it; None if it has not yet."""
    points: Sequence[TrendPoint] = ()
    """The trend of the last minutes, with what other programs on the line have read."""
    last: SeenTrip | None = None
    """Last trip in the journal of this computer, or in the trend."""
    journal_read: bool = False
    """True once the journal was searched."""

    @property
    def since(self) -> float | None:
        """Time since which the drive has been read, by any program; None if it has not been."""
        times = [point.time for point in self.points if None not in point.values[:1]][:1]
        times += [self.own] if self.own is not None else []
        return min(times, default=None)

    @property
    def by_others(self) -> bool:
        """True if another program has read it before this one did."""
        since = self.since
        return since is not None and (self.own is None or since < self.own - 1)

    @property
    def gaps(self) -> Sequence[tuple[float, float]]:
        """Times without a reading for longer than TREND_GAP, each as its begin and end."""
        times = [p.time for p in self.points if any(value is not None for value in p.values)]
        return [(begin, end) for begin, end in pairwise(times) if end - begin > TREND_GAP]

    def highest(self, quantity: str) -> tuple[float, float] | None:
        """Return the largest magnitude of a quantity in the trend, and its time."""
        at = next((n for n, name in enumerate(TREND_QUANTITIES) if name == quantity), None)
        if at is None:
            return None
        found = [
            (abs(value), point.time)
            for point in self.points
            if at < len(point.values) and (value := point.values[at]) is not None
        ]
        return max(found, default=None)


def last_trip(entries: Sequence[Entry]) -> SeenTrip | None:
    """Return the last fault in the journal's entries of one drive, oldest first."""
    found: SeenTrip | None = None
    for entry in entries:
        when = time_of(entry) if entry.kind == "fault" else None
        if when is None:
            continue
        name = f"{entry.code} {entry.new}".strip()
        if found is not None and found.reset is None and entry.answer in ("reset", "code read"):
            # the code may be read a cycle after the state
            reset = when.timestamp() if entry.answer == "reset" else None
            found = SeenTrip(found.wall, found.fault or name, found.tripped, reset)
            continue
        if entry.answer == "reset":
            continue
        found = SeenTrip(when.timestamp(), name, entry.answer == "tripped")
    return found
