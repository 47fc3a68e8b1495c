"""A monitor's cycle for a recorder: only values read in that cycle count as good."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tui.drive.profile.profile import Profile

from ..drive_state import drive_state
from ..reading import Reading, with_text
from ..shown import Quality
from .snapshot import Snapshot


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
