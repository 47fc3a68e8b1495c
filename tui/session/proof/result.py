"""Result of a communication loss test, in words and figures, and its journal entry."""

from __future__ import annotations

from dataclasses import dataclass

from tui.drive.profile.schema import Reaction

from ..drive import DriveSession
from ..journal import Entry, now_text
from .silences import Bracket

UNNAMED_FAULT = "a fault"
"""Fault whose code the drive does not report."""


_NO_REACTION = (
    "DID NOT REACT to {pause:.1f} s without a request. It is set to {timeout:g} s."
    " A communication loss does not stop a running motor."
)
_NO_REACTION_SET = (
    "DID NOT REACT to {pause:.1f} s without a request. It is set to {timeout:g} s, {reaction}."
    " A communication loss does not stop a running motor."
)
_REACTED = {
    "reacts": "Reacts {seconds:.1f} s after the last request.",
    "trips": "Trips {seconds:.1f} s after the last request.",
    "stops": "Stops {seconds:.1f} s after the last request.",
    "slows down": "Slows down {seconds:.1f} s after the last request.",
}


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
            text = _NO_REACTION_SET if self.reaction else _NO_REACTION
            reaction = self.reaction.name if self.reaction else ""
            return text.format(
                pause=self.bracket.not_before, timeout=self.configured, reaction=reaction
            )
        texts = [_REACTED[self.seen or "reacts"].format(seconds=middle)]
        if self.reaction:
            texts.append(f"Set to: {self.reaction.name}.")
        if self.fault:
            texts.append(f"Fault: {self.fault.partition(',')[0]}.")
        if not self.as_set:
            texts.append(f"NOT AS SET: {self._why_not()}")
        return " ".join(texts)

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
