"""Journal entry of a timeout test, for the report."""

from __future__ import annotations

from ..drive import DriveSession
from ..journal import Entry, now_text
from .result import ProofResult


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
