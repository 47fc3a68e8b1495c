"""This panel's control of a drive, as a screen shows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tui.drive.command_blocked import blocked_reason
from tui.drive.orders import chart_in_force
from tui.drive.profile.profile import Profile
from tui.session.command.unblock_hint import way_by_key
from tui.session.work import Outcome


@dataclass(frozen=True, slots=True)
class Hindrance:
    """Why a run command would have no effect now, and the remedy."""

    text: str
    way: str
    """The remedy as a sentence: a key of the panel, or work at the drive."""
    by_channel: bool = False
    """True if another source commands the drive."""

    @property
    def sentence(self) -> str:
        """Reason and remedy."""
        return f"{self.text} {self.way}".strip()


@dataclass(frozen=True, slots=True)
class Control:
    """State of this panel's control of a drive."""

    armed_for: float | None = None
    """Seconds for which it stays armed; None if it is not armed."""
    why_disarmed: str = ""
    outcome: Outcome | None = None
    """Result of the last command, while it is shown."""
    hindrance: Hindrance | None = None
    """Why a run command would have no effect now; None if it would have one."""
    offer: str = ""
    """A motor that an exited program left running, and the keys for it."""
    barred: str = ""
    """Why the drive cannot be armed from this panel; empty if it can."""
    lost: str = ""
    """Values written by this panel that the drive no longer holds."""


UNARMED = Control()
"""State before anything is known."""


def hindrance(profile: Profile, raws: Mapping[str, int]) -> Hindrance | None:
    """Return the reason against a run command now, as far as known."""
    chart = chart_in_force(profile, raws)
    held = blocked_reason(profile, chart, "forward", raws) if chart is not None else None
    return Hindrance(held.text, way_by_key(held), held.by_channel) if held else None
