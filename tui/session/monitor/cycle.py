"""A cycle of a watched drive for a recorder: good is what was read in that very cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tui.drive.profile.profile import Profile

from ..drive_state import drive_state
from ..reading import Reading, with_text
from ..shown import Quality
from .snapshot import Snapshot


def as_read(profile: Profile, codes: Sequence[str], snapshot: Snapshot, since: float) -> Snapshot:
    """The cycle with all codes in their order; what was not read after `since` is stale.

    `since` is when the cycle before ended (monotonic). What was never read is bad, and says why.
    Its state follows from the present ones.
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
