"""Result of one cycle of a monitor, for screens and for recorders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from tui.bus.api import Contact, LineState
from tui.drive.profile.profile import Profile
from tui.safety import STALE_CYCLES, STALE_LEAST

from ..drive_state import DriveState, drive_state
from ..reading import Reading, with_text
from ..shown import Quality, Shown
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

    @property
    def read_at(self) -> float:
        """When its newest value was read (monotonic); the end of the cycle if it has none.

        A failed cycle has later times than its values.
        """
        times = (reading.time for reading in self.readings.values() if reading.raw is not None)
        return max(times, default=self.time)

    def is_stale(self, now: float) -> bool:
        """Return True if the last cycle ended so long ago that none of its values is current."""
        return now - self.time > max(stale_after(self.period), STALE_LEAST)


def as_read(profile: Profile, codes: Sequence[str], snapshot: Snapshot, since: float) -> Snapshot:
    """Return the cycle with exactly these codes; values not read after `since` are stale.

    `since` is the end of the previous cycle (monotonic). A code that was never read gets a bad
    reading with the reason. The state follows from the good readings only.
    """
    readings: dict[str, Reading] = {}
    last = with_text(snapshot.readings)
    for code in codes:
        reading = last.get(code)
        if reading is None:
            reading = Reading.bad(profile[code], snapshot.time, snapshot.error)
        elif reading.quality is Quality.GOOD and (snapshot.error or reading.time <= since):
            reading = replace(reading, quality=Quality.STALE)
        readings[code] = reading
    return replace(snapshot, readings=readings, state=drive_state(profile, readings))
