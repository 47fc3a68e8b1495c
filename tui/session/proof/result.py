"""Result of a communication loss test, in words and figures, and its journal entry."""

from __future__ import annotations

from dataclasses import dataclass

from tui.drive.profile.schema import Reaction

from ..drive import DriveSession
from ..journal import Entry, now_text
from .silences import Bracket

UNNAMED_FAULT = "a fault"
"""Fault whose code the drive does not report."""


@dataclass(frozen=True, slots=True)
class ProofResult:
    """Result of one timeout test of one drive."""

    device: int
    configured: float
    """The configured communication timeout in seconds."""
    reaction: Reaction | None
    """The configured reaction; None if the family has none to set, or it is unknown."""
    bracket: Bracket
    turning: bool
    """True if the motor turned."""
    seen: str = ""
    """Observed reaction of the drive; empty if it did nothing."""
    fault: str = ""
    """The present fault, as `SLF1, Modbus communication`."""
    expected_fault: str = ""
    """The expected fault."""
    changed: str = ""
    """Settings that differ from the earlier reading, as a sentence."""

    @property
    def as_set(self) -> bool:
        """True if the drive reacted as configured, at the configured time."""
        right = not self.expected_fault or self.fault == self.expected_fault
        return bool(self.seen) and right and self.bracket.holds(self.configured)

    @property
    def short(self) -> str:
        """Short text of the result."""
        middle = self.bracket.measured
        if middle is None:
            return "tested: NO REACTION"
        return f"tested: {middle:.1f} s" if self.as_set else f"tested: {middle:.1f} s, NOT AS SET"

    @property
    def text(self) -> str:
        """The result in one or two sentences, for a person and the report."""
        middle = self.bracket.measured
        if middle is None:
            return (
                f"DID NOT REACT to {self.bracket.not_before:.1f} s without a request. It is set to"
                f" {self.configured:g} s{self._reaction()}. A communication loss does not stop a"
                " running motor."
            )
        does = f", set to: {self.reaction.name.lower()}" if self.reaction else ""
        what = f"{self.seen} {middle:.1f} s after the last request{does}"
        fault = f", {self.fault.partition(',')[0]}" if self.fault else ""
        verdict = "" if self.as_set else f" NOT AS SET: {self._why_not()}"
        return f"{what[0].upper()}{what[1:]}{fault}.{verdict}"

    def _reaction(self) -> str:
        return f", {self.reaction.name.lower()}" if self.reaction else ""

    def _why_not(self) -> str:
        if not self.bracket.holds(self.configured):
            return f"the timeout is set to {self.configured:g} s."
        return f"the fault should be {self.expected_fault or 'none'}."


def proof_entry(session: DriveSession, result: ProofResult) -> Entry:
    """The journal entry of a test: nothing was written, `new` holds the result."""
    rules = session.profile.data.communication_fault
    code = rules.timeout if rules else ""
    address = session.profile[code].address if code else 0
    return Entry(
        now_text(), session.line_text, session.device, session.profile.id, code, address,
        None, "", 0, result.text, "as set" if result.as_set else "NOT AS SET", None,
        "test of the communication timeout", kind="proof",
    )  # fmt: skip
