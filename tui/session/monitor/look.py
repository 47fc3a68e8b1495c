"""Check of a drive without a running monitor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tui.bus.api import Contact

from ..drive_state import DriveState
from ..shown import Shown


@dataclass(frozen=True, slots=True)
class Look:
    """Result of one check of a drive; `time` is monotonic."""

    state: DriveState | None
    error: str
    time: float
    timeout: float | None
    """The drive's communication timeout in seconds; None unless it is active."""
    readings: Mapping[str, Shown] = field(default_factory=dict)
    """Values read with the state: output frequency, its reference, motor current."""
    before: Look | None = None
    """The last successful check, if this one failed."""
    contact: Contact = "answers"
    """Result of the requests of this check."""


def last_that_brought(look: Look | None) -> Look | None:
    """Return the check itself if it succeeded, else the last successful one before it."""
    return look.before if look is not None and look.error else look
