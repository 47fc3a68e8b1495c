"""Values of several parameters as rows for a table: each row is one cycle of one drive; pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from .columns import reach_of_points
from .decoding import HistoryPoint
from .history import History

CYCLE_AT_MOST = 1.0
"""Most seconds from the first to the last reply of a row."""


class ExportRow(NamedTuple):
    """Values of one drive that were read within CYCLE_AT_MOST, each once."""

    time: float
    """Time of the first reply, in seconds since 1970; the begin of a gap."""
    device: int
    points: Mapping[str, HistoryPoint]
    """By code; empty in a row that stands for a gap."""
    gap_until: float | None = None
    """End of the gap; None for a row of values."""


def export_rows(device: int, histories: Mapping[str, History]) -> Iterator[ExportRow]:
    """Yield the rows of a drive by time, with one row for each time without any reading.

    A time counts as one if it is longer than usual between the values of the fastest parameter.
    """
    rows = list(_cycles(device, histories))
    fastest = max((found.points for found in histories.values()), key=len, default=())
    reach = reach_of_points(fastest)
    for row, following in pairwise([*rows, None]):
        assert row is not None
        yield row
        end = max(point.end for point in row.points.values())
        if reach and following is not None and following.time - end > reach:
            yield ExportRow(end, device, {}, following.time)


def _cycles(device: int, histories: Mapping[str, History]) -> Iterator[ExportRow]:
    """Yield the readings, those of one cycle together."""
    every = sorted(
        ((point.time, code, point) for code, found in histories.items() for point in found.points),
        key=lambda item: item[0],
    )
    start, points = 0.0, dict[str, HistoryPoint]()
    for time, code, point in every:
        if points and (code in points or time - start > CYCLE_AT_MOST):
            yield ExportRow(start, device, points)
            points = {}
        if not points:
            start = time
        points[code] = point
    if points:
        yield ExportRow(start, device, points)


def from_trigger(time: float, triggers: Sequence[float]) -> float | None:
    """Return the seconds from the nearest trigger, negative before it; None without any."""
    return min((time - trigger for trigger in triggers), key=abs, default=None)
