"""Whether and how a drive is commanded from here, as a screen shows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tui.drive.orders import chart_in_force, locked_by, order_target, unmet
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Chart
from tui.session.work import Outcome


@dataclass(frozen=True, slots=True)
class Hindrance:
    """Why a run command would have no effect now, and the way out of that."""

    text: str
    way: str
    """A sentence: the key that opens the way, else what is to be done at the drive."""
    of_channel: bool = False
    """Whether somebody else commands the drive."""

    @property
    def sentence(self) -> str:
        """All of it."""
        return f"{self.text} {self.way}".strip()


@dataclass(frozen=True, slots=True)
class Control:
    """Whether and how the drive is commanded from here."""

    armed_for: float | None = None
    """Seconds for which it is armed yet; None when it is not."""
    why_disarmed: str = ""
    outcome: Outcome | None = None
    """What has become of the last order, while that is news."""
    hindrance: Hindrance | None = None
    """Why a run command would have no effect now; None where it would."""
    offer: str = ""
    """What an earlier program has started and left, and how it is taken over."""
    lost: str = ""
    """What the drive no longer holds of what was written from here."""


UNARMED = Control()
"""Nothing is known yet."""

OPENS_CONTROL = "6 opens Control."
TAKES_CONTROL = "t takes the control."


def hindrance(profile: Profile, raws: Mapping[str, int]) -> Hindrance | None:
    """What stands against a run command now, as far as that is known."""
    chart = chart_in_force(profile, raws)
    if chart is None:
        return None
    if (lock := locked_by(chart, "forward", raws)) is not None:
        if lock.parameter not in raws:
            return Hindrance(f"{lock.parameter}, which decides, is not read yet: {lock.text}", "")
        channel = _is_set_up_on_control(profile, lock.parameter)
        return Hindrance(lock.text, OPENS_CONTROL if channel else lock.remedy, channel)
    if (when := unmet(chart, "forward", raws)) is not None:
        shown = _shown(profile, when.parameter, raws[when.parameter])
        way = TAKES_CONTROL if _takes_control_by(profile, chart, when.parameter) else ""
        return Hindrance(f"The drive is not commanded by Modbus: {shown}.", way, of_channel=True)
    return None


def _is_set_up_on_control(profile: Profile, code: str) -> bool:
    """Whether a way of commanding the drive, as the screen Control writes it, sets this word."""
    sources = profile.data.control_sources
    written = {setting.parameter for source in sources for setting in source.settings}
    return code in written or profile[code].quantity == "command_channel"


def _takes_control_by(profile: Profile, chart: Chart, code: str) -> bool:
    return any(
        order.id == "take-control" and order_target(profile, chart, order).code == code
        for order in chart.orders
    )


def _shown(profile: Profile, code: str, raw: int) -> str:
    """A word and what it says, as a person reads it."""
    name = profile.names(profile[code]).get(raw, str(raw))
    return f"{code} is {name}"
