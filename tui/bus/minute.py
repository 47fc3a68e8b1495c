"""Replies of the last minute of a line or of one device, good and not: counts in buckets of 5 s."""

from __future__ import annotations

from .model import LastMinute

BUCKET, BUCKETS = 5.0, 12
"""Seconds of one bucket, and how many of them are kept: the last 55 to 60 s."""
_KINDS = LastMinute.__slots__
_PLACES = {kind: place for place, kind in enumerate(_KINDS)}


class MinuteWindow:
    """Counted in the line's loop, read from any thread: the buckets are replaced as a whole."""

    __slots__ = ("_buckets", "_copied", "_summed")

    def __init__(self, copied: LastMinute | None = None) -> None:
        self._buckets: tuple[tuple[int, tuple[int, ...]], ...] = ()
        self._copied = copied
        """Counts of the program that owns the line; None if this one counts."""
        self._summed: tuple[object, int, LastMinute] = (None, 0, LastMinute())
        """The last sum, of which buckets and in which bucket: it is looked at more often."""

    def count(self, kind: str, now: float, number: int = 1) -> None:
        """Count so many of a field of LastMinute; a negative number corrects an earlier count."""
        newest = int(now // BUCKET)
        kept = [bucket for bucket in self._buckets if newest - BUCKETS < bucket[0] <= newest]
        counts = [0] * len(_KINDS)
        if kept and kept[-1][0] == newest:
            counts = list(kept.pop()[1])
        counts[_PLACES[kind]] += number
        self._buckets, self._copied = (*kept, (newest, tuple(counts))), None

    def total(self, now: float) -> LastMinute:
        """The counts of the last minute."""
        if self._copied is not None:
            return self._copied
        buckets, newest = self._buckets, int(now // BUCKET)
        of, then, total = self._summed
        if of is buckets and then == newest:
            return total
        counted = [counts for bucket, counts in buckets if bucket > newest - BUCKETS]
        # what corrects a count may be kept for longer than the count
        total = LastMinute(*(max(0, sum(pair)) for pair in zip(*counted, strict=True)))
        self._summed = (buckets, newest, total)
        return total
