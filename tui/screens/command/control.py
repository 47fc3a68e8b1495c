"""Whether and how a drive is commanded from here, as a screen shows it."""

from __future__ import annotations

from dataclasses import dataclass

from tui.session.work import Outcome


@dataclass(frozen=True, slots=True)
class Control:
    """Whether and how the drive is commanded from here."""

    armed_for: float | None = None
    """Seconds for which it is armed yet; None when it is not."""
    why_disarmed: str = ""
    outcome: Outcome | None = None
    """What has become of the last order, while that is news."""
    no_effect: str = ""
    """Why a run order would have no effect now; empty where it would."""
    offer: str = ""
    """What an earlier program has started and left, and how it is taken over."""
    lost: str = ""
    """What the drive no longer holds of what was written from here."""


UNARMED = Control()
"""Nothing is known yet."""
