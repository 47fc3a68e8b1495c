"""Result of a communication loss test, the lengths of its pauses, and its journal entry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tui.drive.profile.schema import Reaction

from ..drive import DriveSession
from ..journal import Entry, now_text

COARSE = (0.25, 0.5, 0.7)
"""Pauses well below the timeout, as shares of it: a shorter timeout shows there."""
FINE_FROM, SILENCE_STEP = 0.82, 0.12
"""Share of the timeout from which pauses grow by the step, so that two differ by at most 300 ms at
2 s."""
LATEST_FINE = 1.3
PAST_TIMEOUT = (1.6, 2.2, 3.0)
"""Pauses longer than the timeout, as shares of it; none longer is tried."""
LONGEST_SILENCE = 90.0
"""Longest pause in seconds, unless the timeout itself requires a longer one."""
LONGEST_SHARE = 1.6
"""Longest pause as a share of a long timeout."""
TIMEOUT_TOLERANCE, LEAST_TIMEOUT_TOLERANCE = 0.05, 0.05
"""Share of the timeout, and seconds, by which a drive may react earlier or later."""


def silences(timeout: float) -> Iterator[float]:
    """Seconds of each pause, growing around the configured timeout."""
    shares = list(COARSE)
    share = FINE_FROM
    while share < LATEST_FINE:
        shares.append(round(share, 3))
        share += SILENCE_STEP
    longest = max(LONGEST_SILENCE, LONGEST_SHARE * timeout)
    yield from dict.fromkeys(min(value * timeout, longest) for value in (*shares, *PAST_TIMEOUT))


@dataclass(frozen=True, slots=True)
class Bracket:
    """The two pauses, in seconds, between which a drive reacted."""

    not_before: float = 0.0
    """The longest pause without a reaction."""
    not_after: float | None = None
    """The shortest pause with a reaction; None if it never reacted."""

    def alive(self, silence: float) -> Bracket:
        """Return the bracket with a pause of so many seconds that caused no reaction."""
        return Bracket(max(self.not_before, silence), self.not_after)

    def reacted(self, silence: float) -> Bracket:
        """Return the bracket with a pause of so many seconds that caused a reaction."""
        return Bracket(self.not_before, max(silence, self.not_before))

    @property
    def measured(self) -> float | None:
        """The middle of the bracket; None if the drive did not react."""
        return None if self.not_after is None else (self.not_before + self.not_after) / 2

    def holds(self, timeout: float) -> bool:
        """Return True if a configured timeout agrees with the measurement."""
        if self.not_after is None:
            return False
        slack = max(TIMEOUT_TOLERANCE * timeout, LEAST_TIMEOUT_TOLERANCE)
        return self.not_before - slack <= timeout <= self.not_after + slack


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
