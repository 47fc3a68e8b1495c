"""Result of a stop of drives, for a person."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

NOT_STOPPED = "NOT STOPPED: "
"""The beginning of every text of a stop that does not stop its motor."""
AT_THE_MACHINE = "Stop it at the machine."
NOT_PROVED = (
    f"{NOT_STOPPED}it is not known if the motor stopped. The drive does not identify itself.{{}}"
    " Look at the machine, or name its profile."
)
"""The text for a drive whose family is neither named nor proved, with what was read."""


def not_stopped(why: str) -> str:
    """The text of a stop that does not stop its motor: why, and what to do."""
    where = "" if why.endswith("at the machine.") else f" {AT_THE_MACHINE}"
    return f"{NOT_STOPPED}{why}{where}"


def not_proved(read_as: str = "") -> str:
    """The text for a drive of a guessed family, that is at standstill if `read_as` this one."""
    return NOT_PROVED.format(f" Read as {read_as}, it is at standstill." if read_as else "")


class Phase(StrEnum):
    """Progress of a stop."""

    SENDING = "sending"
    """Its frame waits for the line."""
    STOPPING = "stopping"
    """Its frame was sent."""
    UNHEEDED = "unheeded"
    """Its frame was sent, or waits, and something else than the line runs the motor."""
    STOPPED = "stopped"
    FAILED = "failed"


NOT_STOPPING = frozenset({Phase.UNHEEDED, Phase.FAILED})
"""Phases in which a person must stop the motor at the machine."""
OVER = frozenset({Phase.STOPPED, Phase.FAILED})
"""Phases after which nothing more is awaited."""


class StopReport(NamedTuple):
    """Result of a stop so far; ordered at `time`, in this phase since `since` (monotonic)."""

    device: int
    phase: Phase
    text: str
    time: float
    since: float


class StopSummary(NamedTuple):
    """One stop of one or more drives, for a person."""

    reports: list[StopReport]

    @property
    def ended(self) -> bool:
        """True if nothing more is awaited."""
        return all(report.phase in OVER for report in self.reports)

    @property
    def failed(self) -> bool:
        """True if some drive could not be stopped from here."""
        return any(report.phase in NOT_STOPPING for report in self.reports)

    @property
    def head(self) -> str:
        """Result."""
        if self.failed:
            which = ", ".join(str(r.device) for r in self.reports if r.phase in NOT_STOPPING)
            return f"NOT STOPPED by Drive Panel: device {which}. Stop it at the machine."
        return "STOPPED by the stop key." if self.ended else "STOP is being carried out."

    @property
    def text(self) -> str:
        """Each drive's part."""
        ordered = sorted(
            self.reports, key=lambda report: (report.phase not in NOT_STOPPING, report.device)
        )
        return " · ".join(f"{item.device}: {item.text}" for item in ordered)
