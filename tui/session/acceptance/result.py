"""Result of an acceptance test: checks of each step, and what became known of the drive."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from tui.drive.sentences import without_stop
from tui.drive.settings.parameter_set import ParameterSet

from .curve import RunCurve
from .steps import AcceptanceStep

StepResultKind = Literal["passed", "failed", "not run"]


@dataclass(frozen=True, slots=True)
class LimitCheck:
    """A value compared with its limit; all but `passed` are texts for the report."""

    name: str
    value: str
    limit: str
    passed: bool

    @property
    def text(self) -> str:
        """The comparison as a sentence."""
        return f"{self.name}: {without_stop(self.value)}, allowed: {self.limit}."


@dataclass(slots=True)
class StepResult:
    """Result of one step."""

    number: int
    step: AcceptanceStep
    outcome: StepResultKind = "not run"
    text: str = ""
    """Why it failed or was not run; empty if its checks say all."""
    checks: list[LimitCheck] = field(default_factory=list)
    begun: float = 0.0
    """Wall time in seconds since 1970; 0 if it was not run."""
    seconds: float = 0.0
    """Duration."""
    curve: RunCurve | None = None
    """Values of its run; None if the motor was not run."""

    @property
    def title(self) -> str:
        """Name of the step for a person."""
        return self.step.name or self.step.kind

    def check(self, name: str, value: str, limit: str, *, passed: bool) -> bool:
        """Add a check; return its result."""
        self.checks.append(LimitCheck(name, value, limit, passed))
        return passed


@dataclass(slots=True)
class AcceptanceResult:
    """Result of a whole test of one drive."""

    name: str
    line: str
    device: int
    profile: str
    family: str
    profile_version: str
    panel: str
    """Version of Drive Panel."""
    by: str
    """Person who ran the test."""
    file: str
    file_hash: str
    begun: float
    """Wall time in seconds since 1970."""
    steps: list[StepResult]
    identity: Mapping[str, str] = field(default_factory=dict)
    """Vendor, reference, firmware version and name that the drive reports."""
    ended: float = 0.0
    ended_by: str = ""
    """Why the test ended early; empty if it was carried out to its end."""
    settings_hash: str = ""
    """Hash of the settings before the test."""
    settings_after: str = ""
    """Hash of the settings after the test; empty if they were not read."""
    settings_read: int = 0
    unreadable: int = 0

    @property
    def passed(self) -> bool:
        """True if every step passed, and the settings are unchanged."""
        same = self.settings_hash and self.settings_hash == self.settings_after
        return bool(same) and not self.ended_by and all(s.outcome == "passed" for s in self.steps)

    @property
    def why_not(self) -> str:
        """Why it did not pass, in a sentence; empty if it passed."""
        if self.ended_by:
            return f"The test ended early: {self.ended_by}."
        failed = [str(s.number) for s in self.steps if s.outcome == "failed"]
        if failed:
            return f"Failed: step {', '.join(failed)}."
        if self.settings_trouble:
            return self.settings_trouble
        return "" if self.passed else "Steps were not run."

    @property
    def settings_trouble(self) -> str:
        """Why the settings are not known to be unchanged, in a sentence; empty if they are."""
        if not self.settings_after:
            return "The settings were not read after the test."
        if self.settings_after != self.settings_hash:
            return "Settings of the drive changed during the test."
        return ""


def settings_hash(values: ParameterSet) -> str:
    """Return the SHA-256 of the raw settings, one `code=raw` a line, sorted by code."""
    rows = "".join(f"{code}={raw}\n" for code, raw in sorted(values.raws.items()))
    return hashlib.sha256(rows.encode()).hexdigest()
