"""Points of a history as columns of equal time: minimum, mean and maximum; and its gaps. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from statistics import median
from typing import NamedTuple

from .decoding import HistoryPoint
from .reduction import REDUCED_OVER

GAP_POINTS = 3
"""Usual distances of two points from which on there is a gap between them."""
SAMPLED_DISTANCES = 200


class HistoryColumn(NamedTuple):
    """Values of one column."""

    least: float
    mean: float | None
    """Mean of the replies, each with the same weight; None if a point has none."""
    most: float
    good: int
    bad: int
    """Numbers of good replies and of others."""
    reduced: bool
    """True if a reduced point is among them: it may reach beyond the column."""
    exact: bool


def history_columns(
    points: Sequence[HistoryPoint], start: float, span: float, count: int
) -> list[HistoryColumn | None]:
    """Return `count` columns of equal time from `start` on; None for one without a value.

    A reduced point is in each column that it reaches. Times are as in the points, in seconds.
    """
    found: list[list[HistoryPoint]] = [[] for _ in range(count)]
    per_second = count / span
    for point in points:
        first = math.floor((point.time - start) * per_second)
        last = math.floor((point.end - start) * per_second)
        for column in range(max(first, 0), min(last, count - 1) + 1):
            found[column].append(point)
    return [_column(column) for column in found]


def _column(points: Sequence[HistoryPoint]) -> HistoryColumn | None:
    least, most, total, good, bad = math.inf, -math.inf, 0.0, 0, 0
    reduced, exact, has_mean = False, True, True
    for point in points:
        bad += point.bad
        if point.least is None or point.most is None:
            continue
        least, most = min(least, point.least), max(most, point.most)
        has_mean = has_mean and point.mean is not None
        total += (point.mean or 0.0) * point.good
        good += point.good
        reduced, exact = reduced or point.reduced, exact and point.exact
    if not good:
        return None
    mean = total / good if has_mean else None
    return HistoryColumn(least, mean, most, good, bad, reduced, exact)


def reach_of_points(points: Sequence[HistoryPoint]) -> float:
    """Return the longest time, in seconds, between two points without a gap.

    It is GAP_POINTS times their usual distance; with reduced points at least two of their windows.
    """
    reach = 0.0
    for reduced in (False, True):
        times = [point.time for point in points if point.reduced is reduced][-SAMPLED_DISTANCES:]
        apart = [b - a for a, b in pairwise(times) if b > a]
        least = 2 * REDUCED_OVER / 1e6 if reduced and times else 0.0
        reach = max(reach, GAP_POINTS * median(apart) if apart else 0.0, least)
    return reach


def gaps_of(points: Sequence[HistoryPoint], reach: float) -> list[tuple[float, float]]:
    """Return the times without a value: between two values more than `reach` seconds apart, and
    around points that have none. Those before the first and after the last value are included only
    if such points are there."""
    gaps: list[tuple[float, float]] = []
    begin: float | None = None
    failed = False
    for point in points:
        if point.least is None:
            # a failed read that ended within a reduced point is no gap
            if begin is None or point.end > begin:
                failed, begin = True, point.time if begin is None else begin
            continue
        if begin is not None and (failed or point.time - begin > reach):
            gaps.append((begin, point.time))
        begin, failed = point.end, False
    if failed and begin is not None:
        gaps.append((begin, points[-1].end))
    return gaps
