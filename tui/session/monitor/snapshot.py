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
"""A cycle is too slow if it takes more than this many times the target cycle time."""


def stale_after(cycle: float, *, often: bool = True) -> float:
    """Return the age in seconds from which a value is stale, for a cycle time in seconds.

    Values of the slow rate (`often` false) have SLOW_FACTOR times longer.
    """
    return STALE_CYCLES * cycle * (1 if often else SLOW_FACTOR)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Values of one cycle; after a failed cycle, the last values with its error."""

    cycle: int
    time: float
    """End of the cycle (monotonic)."""
    wall: float
    """End of the cycle in seconds since 1970."""
    readings: Mapping[str, Shown]
    state: DriveState
    rate: float
    """Measured cycles per second; 0 after a failed cycle."""
    error: str
    """Why this cycle failed; empty if it succeeded."""
    line: LineState
    block: str = ""
    """Name of the block or scanner that returned some of the values; empty if none."""
    period: float = 0.5
    """Measured cycle time in seconds."""
    wished: float = 0.5
    """Target cycle time in seconds."""
    contact: Contact = "answers"
    """Result of the requests of this cycle."""

    @property
    def too_slow(self) -> bool:
        """True if the line does not keep the target cycle time."""
        return self.period > TOO_SLOW * self.wished

    def is_stale(self, now: float) -> bool:
        """Return True if the last cycle ended so long ago that none of its values is current."""
        return now - self.time > max(stale_after(self.period), STALE_LEAST)
