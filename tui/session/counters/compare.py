"""Comparison of a drive's counters with the requests to it, and its turnarounds.

Pure. The growth between two readings is compared. While other frames are on the line, the number
of frames sent before the drive read its own counter is known only within bounds. Only certain
differences are reported.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Literal

from tui.bus.api import TURNAROUND_EDGES, DeviceCounters, LineCounters
from tui.drive.sentences import counted

MODULO = 0x10000
MOST = 0xFFFF
"""Value at which a counter of checksum errors saturates."""
STRANGE = 0x8000
"""A counter that fell has rolled over, or was reset. A roll-over that needs this many more frames
than this program sent counts as a reset."""

COUNTED_ANEW = (
    "The drive restarted its counters: it was switched off, or they were reset. The comparison"
    " starts again from there."
)

DifferenceKind = Literal[
    "never-arrived", "not-answered", "damaged-there", "not-from-here", "damaged-here",
    "no-answer", "counted-anew", "another-port", "strays",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Bounds:
    """Range of a number; both limits are possible."""

    low: int
    high: int

    def since(self, before: Bounds) -> Bounds:
        """Return the growth since an earlier moment."""
        return Bounds(max(0, self.low - before.high), max(0, self.high - before.low))


@dataclass(frozen=True, slots=True)
class DriveCount:
    """One pair of the drive's counters, and this program's counts at that time."""

    frames: int
    """Frames to its address, damaged ones included, modulo 65536."""
    damaged: int
    """Frames with a wrong checksum; stays at 65535."""
    sent: Bounds
    """Frames that this program sent to the drive, the read of this counter included."""
    answered: Bounds
    """Number of `sent` frames that were answered."""

    @property
    def saturated(self) -> bool:
        """True if the counter of checksum errors has stopped at its maximum."""
        return self.damaged >= MOST


@dataclass(frozen=True, slots=True)
class Comparison:
    """Growth of a pair of a drive's counters over several readings, corrected for roll-overs."""

    first: DriveCount
    last: DriveCount
    frames: int = 0
    """Frames that the drive counted since the first reading."""
    damaged: int = 0
    anew: bool = False
    """True if the drive's counters were reset just before the first reading."""

    def with_look(self, now: DriveCount) -> Comparison:
        """Add a reading; begin again if the counters of either side were reset."""
        sent = now.sent.since(self.last.sent)
        frames = frames_since(self.last.frames, now.frames, sent)
        if now.sent.high < self.last.sent.low:
            return Comparison(now, now)  # another program owns the line now, with its own counts
        if frames is None or now.damaged < self.last.damaged:
            return Comparison(now, now, anew=True)
        damaged = self.damaged + now.damaged - self.last.damaged
        return Comparison(self.first, now, self.frames + frames, damaged, self.anew)

    @property
    def sent(self) -> Bounds:
        """Frames that this program sent since the first reading."""
        return self.last.sent.since(self.first.sent)

    @property
    def answered(self) -> Bounds:
        """Number of these frames that were answered."""
        return self.last.answered.since(self.first.answered)

    @property
    def counts_this_line(self) -> bool | None:
        """True if the drive counts the frames of this line; None if not known yet."""
        if not self.answered.low:
            return None
        return self.frames >= self.answered.low


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference between the counters, as a sentence; concerns at least `count` frames."""

    kind: DifferenceKind
    count: int
    text: str


def frames_since(before: int, now: int, sent: Bounds) -> int | None:
    """Return the growth of a counter modulo 65536; None if the counter was reset.

    If several numbers of roll-overs are possible, the result nearest to `sent` applies.
    """
    found = (now - before) % MODULO
    turns = round((sent.low - found) / MODULO)
    found += max(0, turns) * MODULO
    return None if now < before and found >= sent.high + STRANGE else found


_OTHER_PORT = (
    "The drive answered 1 frame, but counted {frames}. So these counters belong to another port of"
    " the drive, or were reset.",
    "The drive answered {count} frames, but counted {frames}. So these counters belong to another"
    " port of the drive, or were reset.",
)
_NEVER_ARRIVED = (
    "The drive did not count 1 frame that was sent. It was lost on the way, or arrived with a"
    " damaged address. Check its connector, the polarity and the termination.",
    "The drive did not count {count} frames that were sent. They were lost on the way, or arrived"
    " with a damaged address. Check its connector, the polarity and the termination.",
)
_DAMAGED_THERE = (
    "The drive received 1 damaged frame, because of noise. Check the shield, the termination,"
    " the polarization, and motor cables close to the line.",
    "The drive received {count} damaged frames, because of noise. Check the shield, the"
    " termination, the polarization, and motor cables close to the line.",
)
_NOT_ANSWERED = (
    "The drive received 1 frame whose reply did not arrive. It was lost or damaged on the way back,"
    " or later than the timeout.",
    "The drive received {count} frames whose replies did not arrive. They were lost or damaged on"
    " the way back, or later than the timeout.",
)
_FOREIGN = (
    "The drive counted 1 frame more than this program sent: another master polls it, or a gateway"
    " repeats requests.",
    "The drive counted {count} frames more than this program sent: another master polls it, or a"
    " gateway repeats requests.",
)
_DAMAGED_HERE = (
    "1 frame came back damaged: noise, two devices that answer together, or a wrong format.",
    "{count} frames came back damaged: noise, two devices that answer together, or a wrong format.",
)
_UNANSWERED = (
    "1 frame got no reply. Only counters in the drive could show if it was lost on the way there or"
    " on the way back.",
    "{count} frames got no reply. Only counters in the drive could show if they were lost on the"
    " way there or on the way back.",
)


def differences(found: Comparison) -> list[Difference]:
    """Return the certain findings of the drive's counters; empty if all agrees."""
    reported = [Difference("counted-anew", 0, COUNTED_ANEW)] if found.anew else []
    if found.counts_this_line is False:
        text = counted(found.answered.low, *_OTHER_PORT, frames=found.frames)
        return [*reported, Difference("another-port", found.answered.low - found.frames, text)]
    return [*reported, *_differences(found)]


def _differences(found: Comparison) -> Iterator[Difference]:
    frames, damaged = found.frames, found.damaged
    if (lost := found.sent.low - frames) > 0:
        yield Difference("never-arrived", lost, counted(lost, *_NEVER_ARRIVED))
    if damaged > 0:
        yield Difference("damaged-there", damaged, counted(damaged, *_DAMAGED_THERE))
    # foreign frames may have been answered or not, so they do not count
    missed = min(frames, found.sent.low) - damaged - found.answered.high
    if missed > 0:
        yield Difference("not-answered", missed, counted(missed, *_NOT_ANSWERED))
    if (foreign := frames - found.sent.high) > 0:
        yield Difference("not-from-here", foreign, counted(foreign, *_FOREIGN))


_UNANSWERED_YET = (
    "1 frame got no reply. The drive's counters do not show where it was lost.",
    "{count} frames got no reply. The drive's counters do not show where they were lost.",
)


def own_differences(
    ours: DeviceCounters, *, unanswered: int | None = None, compared: bool = False
) -> list[Difference]:
    """Return the differences that this program's counts alone show.

    For drives without counters, and drives that do not answer. `unanswered` are the timeouts that
    are not explained otherwise (default: all). `compared` is True with the drive's counters.
    """
    unanswered = ours.timeouts if unanswered is None else unanswered
    found = []
    if ours.checksum:
        text = counted(ours.checksum, *_DAMAGED_HERE)
        found.append(Difference("damaged-here", ours.checksum, text))
    if unanswered:
        text = counted(unanswered, *(_UNANSWERED_YET if compared else _UNANSWERED))
        found.append(Difference("no-answer", unanswered, text))
    return found


def device_since(now: DeviceCounters, before: DeviceCounters) -> DeviceCounters:
    """Return the growth of this program's counts; all of `now` if another program counts now."""
    if now.requests < before.requests or now.replies < before.replies:
        return now
    plain = {
        field.name: getattr(now, field.name) - getattr(before, field.name)
        for field in fields(DeviceCounters)
        if field.name not in ("exceptions", "turnarounds", "minute")
    }
    bars = tuple(a - b for a, b in zip(now.turnarounds, before.turnarounds, strict=True))
    refused = _grown(now.exceptions, before.exceptions)
    return DeviceCounters(**plain, exceptions=refused, turnarounds=bars, minute=now.minute)


def _grown(now: Mapping[int, int], before: Mapping[int, int]) -> dict[int, int]:
    grown = {code: count - before.get(code, 0) for code, count in sorted(now.items())}
    return {code: count for code, count in grown.items() if count}


def load_of(now: LineCounters, before: LineCounters, seconds: float) -> float | None:
    """Return the share of the time in which the line was busy, 0 to 1; None if not known."""
    busy = now.busy_seconds - before.busy_seconds
    return min(1.0, busy / seconds) if seconds > 0 and busy >= 0 else None


@dataclass(frozen=True, slots=True)
class TurnaroundBar:
    """Bar of the histogram: replies up to a turnaround in ms; None for all longer ones."""

    up_to_ms: int | None
    count: int

    @property
    def label(self) -> str:
        """Range of the bar as text, for example `up to 20 ms`."""
        return f"up to {self.up_to_ms} ms" if self.up_to_ms is not None else "longer"


def bars(turnarounds: Sequence[int]) -> list[TurnaroundBar]:
    """Return the bars for the counts of a device, shortest turnaround first."""
    edges = [*(round(1000 * edge) for edge in TURNAROUND_EDGES), None]
    return [TurnaroundBar(edge, count) for edge, count in zip(edges, turnarounds, strict=True)]
