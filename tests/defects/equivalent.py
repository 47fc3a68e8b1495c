"""Random defects that change nothing a person or a program could notice, each with why."""

from __future__ import annotations

EQUIVALENT: dict[str, str] = {
    "tui/bus/schedule/step_proof.py:StepProof.sent: condition: job.priority is Priority.STOP and"
    " job.request.changes -> ((job.priority is Priority.STOP) or (job.request.changes))": (
        "Anything but a write of a stop waits until replies are trusted, so it is not sent here."
    ),
    "tui/bus/schedule/connection.py:Connection._serve: return: return -> pass": (
        "The call before it never returns: it serves until the line is lost, which it raises."
    ),
}
"""By the identity of the defect, as `python -m tests.mutants --random` prints it."""
