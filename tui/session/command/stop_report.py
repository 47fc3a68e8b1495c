"""Progress and result of stops, as shown to a person."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile

    from ..drive_state import DriveState
    from ..shown import Shown

NOT_STOPPED = "NOT STOPPED: "
"""Beginning of each text about a motor that does not stop."""
AT_THE_MACHINE = "Stop it at the machine."
NOT_PROVED = (
    f"{NOT_STOPPED}it is not known if the motor stopped. The drive does not identify itself.{{}}"
    " Check the machine, or name its profile."
)
"""Text for a drive whose family is neither named nor identified; `{}` is what was read."""


def not_stopped(why: str) -> str:
    """Return the text for a motor that does not stop: why, and what to do."""
    where = "" if why.endswith("at the machine.") else f" {AT_THE_MACHINE}"
    return f"{NOT_STOPPED}{why}{where}"


def not_proved(read_as: str = "") -> str:
    """Return the text for a drive of a guessed family; `read_as` names the one that shows 0 Hz."""
    return NOT_PROVED.format(f" Read as {read_as}, it is at standstill." if read_as else "")


MAY_COAST = "without current, and may still coast"
"""Text of a motor at 0 Hz that nothing brakes, if it turned before: its speed is not known."""


class Phase(StrEnum):
    """Progress of a stop."""

    SENDING = "sending"
    """Its frame waits for the line."""
    STOPPING = "stopping"
    """Its frame was sent."""
    UNHEEDED = "unheeded"
    """Its frame was sent, or waits, but another source runs the motor, or the drive is silent."""
    STOPPED = "stopped"
    FAILED = "failed"


NOT_STOPPING = frozenset({Phase.UNHEEDED, Phase.FAILED})
"""Phases in which a person must stop the motor at the machine."""
OVER = frozenset({Phase.STOPPED, Phase.FAILED})
"""Phases in which a stop has ended."""


_MESSAGES = {
    Phase.STOPPING: "Stopping: {text}",
    Phase.STOPPED: "The motor is {text}.",
}
"""Messages by phase. The text of other phases is a message as it is."""


def message_text(phase: Phase, text: str) -> str:
    """Return the text of a report as a message that is understood without its phase."""
    return _MESSAGES.get(phase, "{text}").format(text=text)


class StopReport(NamedTuple):
    """Result of a stop so far; ordered at `time`, in this phase since `since` (monotonic)."""

    device: int
    phase: Phase
    text: str
    """If stopping, the command and the frequency. If stopped, a state: `stopped`, and in brackets
    the kind of stop that the drive lacks, or MAY_COAST. Otherwise sentences."""
    time: float
    since: float

    @property
    def may_coast(self) -> bool:
        """True if the drive is stopped, but nothing brakes its motor, which may still turn."""
        return self.phase is Phase.STOPPED and self.text.startswith(MAY_COAST)


def as_seen(
    report: StopReport,
    profile: Profile,
    state: DriveState | None,
    readings: Mapping[str, Shown],
) -> StopReport:
    """Return the report to show with this state: stopping, while an older state still moves.

    The stop reads the standstill itself, before the next poll or check does.
    """
    if report.phase is not Phase.STOPPED or state is None:
        return report
    if state.motion not in ("running", "stopping"):
        return report
    read = [readings[code].time for code in profile.data.status_codes if code in readings]
    if not read or min(read) > report.since:
        return report
    return report._replace(phase=Phase.STOPPING, text="standstill was read")


class StopSummary(NamedTuple):
    """Reports of one stop of one or more drives."""

    reports: list[StopReport]

    @property
    def ended(self) -> bool:
        """True if all have ended."""
        return all(report.phase in OVER for report in self.reports)

    @property
    def failed(self) -> bool:
        """True if a drive could not be stopped."""
        return any(report.phase in NOT_STOPPING for report in self.reports)

    @property
    def head(self) -> str:
        """The result in one sentence."""
        if self.failed:
            which = ", ".join(str(r.device) for r in self.reports if r.phase in NOT_STOPPING)
            return f"NOT STOPPED by Drive Panel: device {which}. Stop it at the machine."
        return "STOPPED by the stop key." if self.ended else "STOP is being carried out."

    @property
    def text(self) -> str:
        """The text of each drive, those that do not stop first."""
        ordered = sorted(
            self.reports, key=lambda report: (report.phase not in NOT_STOPPING, report.device)
        )
        return " · ".join(f"{item.device}: {item.text}" for item in ordered)
