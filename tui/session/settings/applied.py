"""Result of writing staged edits, and the edits that remain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from tui.drive.settings.edits import Edit, Edits

from .link_change import LinkChange


class EditOutcome(StrEnum):
    """Result of one edit."""

    DONE = "done"
    SENT = "sent, line changed"
    CHANGED = "changed meanwhile"
    NOT_TAKEN = "not taken"
    DRIVE_REFUSED = "the drive refused"
    REFUSED = "not written"
    UNKNOWN = "not known"
    NOT_SENT = "not sent"
    HELD_BACK = "held back"
    WAITS = "waits for an answer"


@dataclass(frozen=True, slots=True)
class Result:
    """One edit with its outcome, a sentence for a person, and what the drive holds now."""

    edit: Edit
    outcome: EditOutcome
    text: str
    held: int | None = None
    voided: bool = False
    """True if a stop, or the end of arming, kept it from being sent."""

    @property
    def done(self) -> bool:
        """True if the drive has the new value, as far as that can be seen."""
        return self.outcome in (EditOutcome.DONE, EditOutcome.SENT)


@dataclass(frozen=True, slots=True)
class Applied:
    """Result of all edits."""

    results: tuple[Result, ...]
    left: Edits
    """Edits still staged, against the present values of the drive."""
    links: tuple[LinkChange, ...] = ()
    """Changes of the line itself, now or after a reset."""
    after_reset: tuple[str, ...] = ()
    """Codes whose new value is in force only once the drive was reset."""
    unsaved: tuple[str, ...] = ()
    """Codes whose new value is lost at power-off until the drive is ordered to save."""
    stopped: str = ""
    """Why the rest was not tried; empty where all were."""
    stamp: int = 0
    """The count of stops under which they were written: a stop since voids what waits."""
    waits: tuple[str, ...] = ()
    """Codes that could be written yet, once a person says so: one before them failed."""

    @property
    def written(self) -> tuple[Result, ...]:
        """The edits that the drive has now."""
        return tuple(result for result in self.results if result.done)


WriteProgress = Callable[[int, int, Result], None]
"""Called after each edit with how many are done, how many there are, and the result."""
