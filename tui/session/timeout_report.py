"""Communication timeout that a drive reported: its length and its reaction."""

from __future__ import annotations

from dataclasses import dataclass

from tui.drive.profile.schema import Reaction


@dataclass(frozen=True, slots=True)
class TimeoutWatch:
    """A drive's watch over the line: seconds to its timeout, and what it does then."""

    timeout: float
    reaction: Reaction | None
    active: bool = True
    """False where the reaction is off, and before the first command where it begins with that."""
    code: str = ""
    """The parameter that sets the timeout."""
    fault: str = ""
    """The fault in which its reaction ends; empty where it ends in none, or it is not known."""
    sure: bool = True
    """True if a document says when it begins; it is taken to have begun where none does."""

    @property
    def acts(self) -> bool:
        """True if a reaction follows a silent line; it may be switched off."""
        return self.reaction is None or not self.reaction.never_set

    @property
    def trips(self) -> bool:
        """True if the drive may end in a fault; a reaction that is not known may be one."""
        return self.reaction is None or self.reaction.trips


@dataclass(frozen=True, slots=True)
class Timeout:
    """Known facts about a drive's communication timeout."""

    known: bool
    """True if the drive has told it."""
    watch: TimeoutWatch | None = None
    """None where there is none, where it is off, or where it is not known."""
