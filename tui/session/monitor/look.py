"""Looks at a drive that no monitor watches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tui.bus.api import Contact

from ..drive_state import DriveState
from ..shown import Shown


@dataclass(frozen=True, slots=True)
class Look:
    """Result of the last check of a drive."""

    state: DriveState | None
    error: str
    time: float
    timeout: float | None
    """The drive's communication timeout in seconds, if it is one that runs already."""
    readings: Mapping[str, Shown] = field(default_factory=dict)
    """Values read with the state: output frequency, its reference, motor current."""
    before: Look | None = None
    """The last look that brought something, where this one brought nothing."""
    contact: Contact = "answers"
    """Result of the requests of this look."""


def last_that_brought(look: Look | None) -> Look | None:
    """The look itself if it brought something, else the last one before that did."""
    return look.before if look is not None and look.error else look
