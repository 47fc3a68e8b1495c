"""State of lines and their drives at one moment, for publication."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.bus.api import Contact, LineCounters, LineState
    from tui.session.drive import DriveSession
    from tui.session.monitor.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class DriveStatus:
    """One drive: its last cycle, or the reason why there is none."""

    device: int
    session: DriveSession | None = None
    """None if the drive was not found."""
    cycle: Snapshot | None = None
    """Values that were not read in this cycle are not good."""
    error: str = ""
    """Reason why there are no current values; empty if there are."""
    contact: Contact = "not_polled"
    """Result of the last requests to it."""


@dataclass(frozen=True, slots=True)
class LineReport:
    """One line with its drives."""

    name: str
    """The line as typed: its name in the settings file if it has one."""
    text: str
    state: LineState
    counters: LineCounters
    drives: tuple[DriveStatus, ...]


def drive_status_of(
    device: int, session: DriveSession | None, cycle: Snapshot, now: float
) -> DriveStatus:
    """Return the state of a drive from its last cycle; without current values if that is too old.

    `now` is on the monotonic clock.
    """
    if session is not None and cycle.is_stale(now):
        cycle = _outdated(session, cycle, now)
    return DriveStatus(device, session, cycle, cycle.error, cycle.contact)


def _outdated(session: DriveSession, cycle: Snapshot, now: float) -> Snapshot:
    """Return a cycle without good values: the program that reads the drive has not polled it
    recently."""
    from tui.session.drive_state import drive_state

    readings = {code: reading.aged(now, -1.0) for code, reading in cycle.readings.items()}
    return replace(
        cycle,
        readings=readings,
        state=drive_state(session.profile, readings),
        rate=0.0,
        contact=cycle.contact if cycle.error else "not_polled",
        error=cycle.error
        or f"Device {session.device} was not polled for {now - cycle.time:.0f} s.",
    )
