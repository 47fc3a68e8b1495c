"""True if and how a drive is commanded from here, as a screen shows it."""

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
    """Why a run command would have no effect now, and the way out of that."""

    text: str
    way: str
    """A sentence: the key that opens the way, else what is to be done at the drive."""
    by_channel: bool = False
    """True if somebody else commands the drive."""

    @property
    def sentence(self) -> str:
        """All of it."""
        return f"{self.text} {self.way}".strip()


@dataclass(frozen=True, slots=True)
class Control:
    """True if and how the drive is commanded from here."""

    armed_for: float | None = None
    """Seconds for which it is armed yet; None when it is not."""
    why_disarmed: str = ""
    outcome: Outcome | None = None
    """Result of the last command, while it is new."""
    hindrance: Hindrance | None = None
    """Why a run command would have no effect now; None where it would."""
    offer: str = ""
    """Motor that an earlier program left running, and how it is taken over."""
    barred: str = ""
    """Why the drive cannot be armed from this panel; empty if it can."""
    lost: str = ""
    """Values written by this panel that the drive no longer holds."""


UNARMED = Control()
"""Nothing is known yet."""


def hindrance(profile: Profile, raws: Mapping[str, int]) -> Hindrance | None:
    """Return the reason against a run command now, as far as known."""
    chart = chart_in_force(profile, raws)
    held = blocked_reason(profile, chart, "forward", raws) if chart is not None else None
    return Hindrance(held.text, way_by_key(held), held.by_channel) if held else None
