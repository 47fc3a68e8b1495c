"""Diagnosis of a drive that does not answer, in one sentence, with the next steps; pure."""

from __future__ import annotations

from dataclasses import dataclass, field

from .checks import LADDER
from .evidence import DiagnosticEvidence
from .sick import CERTAIN

ANSWERS = "answers"
"""Verdict for a drive that answers, with no fault on the way."""

UNOPENED = "not-open"
NOTHING_SEEN = "Nothing is wrong with this line as far as it is seen while it is not open."
OPEN_IT = "Open it, then try again: a drive is polled only on an open line."


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Verdict of a diagnosis, with its sentence and the next steps."""

    rung: str
    text: str
    steps: tuple[str, ...]
    sight: DiagnosticEvidence
    certainty: str = CERTAIN
    """Certainty of the verdict: `certain`, `likely` or `possible`."""
    others: tuple[str, ...] = field(default=())
    """Other possible causes."""

    @property
    def well(self) -> bool:
        """True if the drive answers and no fault was found."""
        return self.rung == ANSWERS


def diagnosed(sight: DiagnosticEvidence) -> Diagnosis:
    """Return the verdict of the first check whose test holds."""
    for rung in LADDER:
        if rung.fails(sight):
            sure = rung.certainty(sight)
            others = () if sure == CERTAIN else rung.others
            return Diagnosis(
                rung.id, rung.says(sight), tuple(rung.steps(sight)), sight, sure, others
            )
    heard = sight.heard
    if not heard.requested:
        return Diagnosis(UNOPENED, NOTHING_SEEN, (OPEN_IT,), sight)
    after = f", {sight.turnaround * 1000:.0f} ms after each request" if sight.turnaround else ""
    measure = sight.measure
    sent = heard.requested + (measure.requested if measure is not None else 0)
    answered = heard.answered + (measure.answered if measure is not None else 0)
    text = f"Address {sight.device} answers: {answered} of {sent} requests{after}."
    if sight.idle:
        text += f" The gateway kept the connection for {sight.idle:.0f} s without a request."
    return Diagnosis(ANSWERS, text, (), sight)
