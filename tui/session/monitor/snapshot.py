"""Result of one cycle of a monitor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tui.bus.api import Contact, LineState
from tui.safety import STALE_CYCLES, STALE_LEAST

from ..drive_state import DriveState
from ..shown import Shown
from .rates import SLOW_FACTOR

TOO_SLOW = 1.2
"""A cycle takes too long from so many times the wished one."""


def stale_after(cycle: float, *, often: bool = True) -> float:
    """Seconds after which a value is no longer the present one, for a cycle of so many seconds.

    What is not read in every cycle has as many times longer.
    """
    return STALE_CYCLES * cycle * (1 if often else SLOW_FACTOR)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All values of one cycle, or the last ones with the error of a cycle that failed."""

    cycle: int
    time: float
    """When it was taken (monotonic)."""
    wall: float
    """The same as time.time()."""
    readings: Mapping[str, Shown]
    state: DriveState
    rate: float
    """Cycles a second as they were; 0 while nothing answers."""
    error: str
    """Why this cycle brought nothing, or empty."""
    line: LineState
    block: str = ""
    """The block or scanner that brought some of the values."""
    period: float = 0.5
    """Seconds from one cycle to the next, as they were."""
    wished: float = 0.5
    """Seconds from one cycle to the next, as they should be."""
    contact: Contact = "answers"
    """Result of the requests of this cycle."""

    @property
    def too_slow(self) -> bool:
        """True if the line does not keep the wished cycle time."""
        return self.period > TOO_SLOW * self.wished

    def is_stale(self, now: float) -> bool:
        """Return True if no cycle has ended for so long that nothing here is the present any
        more."""
        return now - self.time > max(stale_after(self.period), STALE_LEAST)
