"""What a stop of drives has come to, for a person."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Phase(StrEnum):
    """How far a stop has come."""

    SENDING = "sending"
    STOPPING = "stopping"
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class StopReport:
    """What became of a stop so far; ordered at `time`, and so since `since` (monotonic)."""

    device: int
    phase: Phase
    text: str
    time: float
    since: float


@dataclass(frozen=True, slots=True)
class StopSummary:
    """One stop of one or more drives, for a person."""

    reports: list[StopReport]

    @property
    def ended(self) -> bool:
        """Whether nothing more is awaited."""
        return all(one.phase in (Phase.STOPPED, Phase.FAILED) for one in self.reports)

    @property
    def failed(self) -> bool:
        """Whether some drive could not be stopped from here."""
        return any(one.phase is Phase.FAILED for one in self.reports)

    @property
    def head(self) -> str:
        """What it has come to."""
        if self.failed:
            which = ", ".join(str(r.device) for r in self.reports if r.phase is Phase.FAILED)
            return f"NOT STOPPED from here: device {which}. Stop it at the machine."
        return "STOPPED by the stop key." if self.ended else "STOP is being carried out."

    @property
    def text(self) -> str:
        """Each drive's part."""
        ordered = sorted(self.reports, key=lambda one: (one.phase is not Phase.FAILED, one.device))
        return " · ".join(f"{one.device}: {one.text}" for one in ordered)
