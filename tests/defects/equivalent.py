"""Random defects that change nothing a person or a program could notice, each with why."""

from __future__ import annotations

EQUIVALENT: dict[str, str] = {}
"""By the identity of the defect, as `python -m tests.mutants --random` prints it."""
