"""Times in which a drive did not answer, from its record. Times are in seconds since 1970."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import NamedTuple

from .decoding import HistoryPoint
from .reader import RecordReader
from .schema import RecordDamaged

LEAST_SILENCE = 5.0
"""Seconds without a good reply from which the link to a drive was lost."""
LEAST_BAD = 3
"""Bad replies from which the link to a drive was lost."""
LEAST_TRIED = 1.0
"""Seconds in which these bad replies were: the tries of one request are none."""
UNASKED_FOR = 60.0
"""Seconds without a request after which it is not known that a drive was still lost."""


class LostLink(NamedTuple):
    """A time in which the line or a drive did not answer."""

    device: int | None
    """None for the whole line."""
    begun: float
    ended: float | None
    """None if it was still lost at the end."""
    reason: str


def whole_silences(
    files: Sequence[Path], device: int, since: float, until: float
) -> Iterator[LostLink]:
    """Yield the times without an answer to any request, from replies that are not reduced yet.

    A silent drive is polled ever less often, so its status word may have few bad replies. A time is
    not known if nothing was sent for longer than UNASKED_FOR before the next answer.
    """
    for path in files:
        with suppress(RecordDamaged, OSError, sqlite3.Error), closing(RecordReader(path)) as reader:
            for each in reader.silences(device):
                begun, last, ended = (None if at is None else at / 1e6 for at in each[:3])
                assert begun is not None
                assert last is not None
                known = last if ended is None else ended
                tried = each[3] >= LEAST_BAD and last - begun >= LEAST_TRIED
                long = known - begun >= LEAST_SILENCE and known - last <= UNASKED_FOR
                if tried and long and since <= begun < until:
                    yield LostLink(device, begun, ended, "")


def word_silences(device: int, points: Iterable[HistoryPoint]) -> Iterator[LostLink]:
    """Yield the times without a good reply to reads of the status word."""
    begun, last, bad, reason = 0.0, 0.0, 0, ""
    for point in points:
        if not point.good:
            if not bad:
                begun = point.time
                reason = "" if point.reduced else point.quality
            bad, last = bad + point.bad, point.end
            continue
        if bad >= LEAST_BAD and point.time - begun >= LEAST_SILENCE:
            yield LostLink(device, begun, point.time, reason)
        bad = 0
    if bad >= LEAST_BAD and last - begun >= LEAST_SILENCE:
        yield LostLink(device, begun, None, reason)
