"""Communication timeout as a drive reported it: its length and its reaction."""

from __future__ import annotations

from dataclasses import dataclass

from tui.drive.profile.schema import Reaction


@dataclass(frozen=True, slots=True)
class TimeoutWatch:
    """A drive's communication timeout in seconds, and its reaction; None if that is unknown."""

    timeout: float
    reaction: Reaction | None
    active: bool = True
    """False if the reaction is off, or begins with the first command and none is known."""
    code: str = ""
    """Code of the parameter that sets the timeout."""
    fault: str = ""
    """Fault code of the reaction; empty if it causes no fault, or an unknown one."""
    sure: bool = True
    """True if a document states when it begins; if none does, it counts as begun."""

    @property
    def begun(self) -> bool | None:
        """True if it runs, False if its reaction is off; None if it may run.

        A reset, a freewheel or a reference of 0 begins it and leaves no trace in the drive.
        """
        return True if self.active else None if self.acts else False

    @property
    def acts(self) -> bool:
        """True if the drive reacts to communication loss; False if its reaction is off."""
        return self.reaction is None or not self.reaction.never_set

    @property
    def trips(self) -> bool:
        """True if the reaction is a fault, or unknown."""
        return self.reaction is None or self.reaction.trips


@dataclass(frozen=True, slots=True)
class Timeout:
    """Known facts about a drive's communication timeout."""

    known: bool
    """True if the drive reported it."""
    watch: TimeoutWatch | None = None
    """None if there is no timeout, or it is off or not known."""
