"""A sentence on what work on a drive has come to."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Said:
    """What the last work has come to; `kind` is working, done or refused."""

    text: str
    kind: str
    time: float
    """When it was said, on the monotonic clock in s."""
