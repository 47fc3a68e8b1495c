"""Record of one device, field by field; `Devices` draws conclusions from it."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median

from ..expectation import Expectation
from ..limits import CAUTIOUS, Limits
from ..requests import Read

TURNAROUNDS_KEPT = 16
"""Turnarounds remembered for each function."""
COPIES = 6
"""Number of replies of which a copy may still come."""


@dataclass(frozen=True, slots=True)
class Outstanding:
    """A reply that may still come until `expires`, to a request of `sent`; it was due at `due`."""

    expectation: Expectation
    sent: float
    due: float
    expires: float
    copy: bool = False
    """True if it has come, at `sent`, and may come again."""
    pdu: bytes = b""
    """The request, if it may be repeated while its reply is outstanding."""

    def is_reply_to(self, pdu: bytes, since: float | None) -> bool:
        """True if it would be as good a reply to a repeat of a request first sent at `since`."""
        return since is not None and bool(pdu) and self.pdu == pdu and self.sent >= since


@dataclass(slots=True)
class Device:
    """The record of one device."""

    limits: Limits = CAUTIOUS
    answers: bool | None = None
    ever_answered: bool = False
    refused: bool = False
    """True if its last reply was a refusal."""
    failures: int = 0
    silent_since: float | None = None
    next_try: float | None = None
    turnaround: float | None = None
    recent: dict[int, deque[float]] = field(default_factory=dict)
    outstanding: list[Outstanding] = field(default_factory=list)
    lateness: float = 0.0
    """Longest delay of a reply after its timeout in seconds."""
    settle: float = 0.0
    """Quiet time after each reply of a device that repeats its replies later."""
    repeated: float = 0.0
    """When a reply last came twice."""
    exchanges: deque[tuple[bytes, bytes]] = field(
        default_factory=lambda: deque(maxlen=COPIES), repr=False
    )
    """The last requests that were answered, with their replies."""
    heard: float | None = None
    reported_usual: float | None = None
    """The usual turnaround, as reported by the program that owns the line."""
    last: Expectation | None = None
    last_time: float = 0.0


def usual(recent: Mapping[int, Sequence[float]]) -> float | None:
    """The median of the recent turnarounds of reads, None before the first."""
    reads = recent.get(Read.function)
    return median(tuple(reads)) if reads else None


def note_turnaround(record: Device, function: int, turnaround: float) -> None:
    """Note a turnaround; the timeout follows the recent ones."""
    recent = record.recent.setdefault(function, deque(maxlen=TURNAROUNDS_KEPT))
    recent.append(turnaround)
    record.turnaround = max(recent)
