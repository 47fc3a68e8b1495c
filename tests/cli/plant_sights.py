"""Lines and drives as published to the plant, without a wire."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal

from tests.session.fakes import OneDrive, parameter, profile_of
from tui.bus.model import DeviceCounters, LineCounters, LineState, LineStatus
from tui.cli.plant.status import DriveStatus, LineReport, drive_status_of
from tui.drive.profile.profile import Profile
from tui.drive.values import decode
from tui.session.drive import DriveSession
from tui.session.drive_state import drive_state
from tui.session.monitor.snapshot import Snapshot
from tui.session.reading import Reading, with_text
from tui.session.shown import Quality

NOW = 1000.0
WALL = 1_700_000_000.0
CONNECTED = LineState(LineStatus.CONNECTED, "", 0.0)

CHART = {
    "id": "drivecom",
    "name": "Drivecom",
    "kind": "drivecom",
    "status": "ETA",
    "states": [
        {"id": "enabled", "name": "Enabled", "kind": "running", "mask": 0x6F, "value": 0x27},
        {"id": "fault", "name": "Fault", "kind": "fault", "mask": 0x4F, "value": 0x08},
    ],
}


def small_drive() -> Profile:
    """A profile with a value of several units, a word and faults."""
    return profile_of(
        parameter("ETA", 3201, bits=[{"bit": 7, "name": "warning", "alarm": True}]),
        parameter("RFR", 3202, scale="0.1", unit="Hz", quantity="output_frequency"),
        parameter("THD", 3203, unit="%"),
        parameter("LFT", 7121),
        charts=[CHART],
        faults={
            "parameter": "LFT",
            "shows_last": True,
            "codes": [{"raw": 18, "code": "ObF", "name": 'Over"braking\\'}],
        },
    )


def cycle(profile: Profile, *, quality: Quality = Quality.GOOD, **raws: int) -> Snapshot:
    """A cycle that has ended half a second ago."""
    readings = {
        code: Reading(
            p, raw, decode(p, raw, profile.names(p), Decimal(p.scale)), quality, NOW - 0.5
        )
        for code, raw in raws.items()
        if (p := profile[code])
    }
    state = drive_state(profile, readings)
    return Snapshot(1, NOW - 0.5, WALL, readings, state, 1.0, "", CONNECTED)


def line_of(
    *drives: DriveStatus, name: str = "pump", counters: LineCounters | None = None
) -> LineReport:
    """A line with these drives."""
    return LineReport(name, "tcp:10.0.0.1:502", CONNECTED, counters or LineCounters(), drives)


def drive_of(seen: Snapshot, profile: Profile | None = None, now: float = NOW) -> DriveStatus:
    """Drive 2 by this cycle."""
    session = DriveSession(OneDrive({}, device=2), 2, profile or small_drive())
    return drive_status_of(2, session, seen, now)


def failed(seen: Snapshot, error: str) -> Snapshot:
    """Earlier values, as in a failed cycle."""
    readings = {c: replace(r, quality=Quality.STALE) for c, r in with_text(seen.readings).items()}
    state = drive_state(small_drive(), readings)
    return replace(seen, readings=readings, state=state, error=error, contact="silent")


def counted(turnarounds: Sequence[int]) -> LineCounters:
    """Counters with those of drive 2."""
    own = DeviceCounters(requests=9, replies=7, exceptions={2: 3}, turnarounds=tuple(turnarounds))
    return LineCounters(requests=9, replies=7, timeouts=2, devices={2: own})
