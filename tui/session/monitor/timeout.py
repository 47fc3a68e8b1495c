"""A drive's communication time-out: how long it waits for the line, and what it does then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Reaction

from ..drive import DriveSession
from ..reading import Reading

TOLD_SHARE = 0.5
"""Share of its time-out after which a drive that was not heard is told of."""


@dataclass(frozen=True, slots=True)
class TimeoutWatch:
    """A drive's watch over the line: seconds to its time-out, and what it does then."""

    timeout: float
    reaction: Reaction | None
    active: bool = True
    """False where it begins only with a first command, and none was sent from here."""

    @property
    def trips(self) -> bool:
        """Whether the drive may end in a fault; a reaction that is not known may be one."""
        return self.reaction is None or self.reaction.trips


@dataclass(frozen=True, slots=True)
class TimeoutWarning:
    """A drive that was not heard for a good part of its time-out; times in seconds."""

    device: int
    profile: Profile
    silent: float
    watch: TimeoutWatch

    @property
    def left(self) -> float:
        """Seconds until the drive acts; below zero it has."""
        return self.watch.timeout - self.silent


def left_alone_text(*sessions: DriveSession, watch: TimeoutWatch | None) -> str:
    """What drives of one family do when nobody asks them any more, in a sentence."""
    it = "it" if len(sessions) == 1 else "each"
    if watch is None:
        return f"{names_of(sessions)}: left alone {it} goes on: no communication time-out."
    does = watch.reaction.does if watch.reaction else "its own reaction follows"
    after = f"acts {watch.timeout:g} s after the last request"
    return f"{names_of(sessions)}: left alone {it} {after}: {does.rstrip('.')}."


def names_of(sessions: Sequence[DriveSession]) -> str:
    """Drives of one family as a person calls them: by device, and the family."""
    word = "Device" if len(sessions) == 1 else "Devices"
    return f"{word} {', '.join(str(one.device) for one in sessions)}, {sessions[0].profile.name}"


def timeout_seconds(reading: Reading, off: int | None) -> float | None:
    """The time-out in seconds; None where it is off or could not be read."""
    number = reading.number
    if reading.raw is None or reading.raw == off or not number:
        return None
    return number / 1000 if reading.unit == "ms" else number
