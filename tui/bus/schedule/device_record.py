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
MISSED_KEPT = 16
"""Requests without a reply that are remembered after it was due."""


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


@dataclass(frozen=True, slots=True)
class Guess:
    """A frame that was taken for an earlier reply, while the reply to a request of `sent` was due.

    The other fields are what was known before.
    """

    sent: float
    outstanding: tuple[Outstanding, ...]
    lateness: float
    settle: float
    repeated: float


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
    missed: deque[Outstanding] = field(default_factory=lambda: deque(maxlen=MISSED_KEPT))
    """Replies that came in none of the time in which they were outstanding."""
    guess: Guess | None = None
    """The last one, until a later reply shows if it was right."""
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


def known_before(record: Device, sent: float) -> Guess:
    """Return what is known before the frames of an exchange are judged."""
    due = tuple(record.outstanding)
    return Guess(sent, due, record.lateness, record.settle, record.repeated)


def judge_guess(record: Device, sent: float, now: float) -> None:
    """Judge the last guess by the reply to a request of `sent`, which is certainly its own.

    If the reply to the request of the guess has not come by then, the frame was that: what it was
    taken for may still come, for as long as before. Otherwise a drive that was frozen once is taken
    for ever for one that is late or repeats itself, if the same is asked again before the doubt
    ends.
    """
    guess = record.guess
    if guess is None or guess.sent >= sent:
        return
    record.guess = None
    if any(late.sent == guess.sent and not late.copy for late in record.outstanding):
        record.lateness, record.settle = guess.lateness, guess.settle
        record.repeated = guess.repeated
        since = (late for late in record.outstanding if late.sent > guess.sent)
        before = (late for late in guess.outstanding if late.expires > now)
        record.outstanding = [*before, *since]


def usual(recent: Mapping[int, Sequence[float]]) -> float | None:
    """The median of the recent turnarounds of reads, None before the first."""
    reads = recent.get(Read.function)
    return median(tuple(reads)) if reads else None


def note_turnaround(record: Device, function: int, turnaround: float) -> None:
    """Note a turnaround; the timeout follows the recent ones."""
    recent = record.recent.setdefault(function, deque(maxlen=TURNAROUNDS_KEPT))
    recent.append(turnaround)
    record.turnaround = max(recent)
