"""Evidence of a run of the motor in the last minutes of its trend; pure functions.

Times are monotonic, in seconds. Frequencies are compared without the sign of their direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..monitor.trend import TrendPoint

TURNS_FROM = 0.1
"""Hz from which the motor turns."""
STEADY_WITHIN = 0.5
"""Most Hz between a steady speed and its reference."""
STEADY_SECONDS = 2.0
TOP_SHARE = 0.98
"""Share of the highest frequency before a stop at which the stop begins."""


class SteadyRun(NamedTuple):
    """A run at one speed: mean values and its end."""

    end: float
    hertz: float
    current: float | None
    """In the unit of the trend."""


class SeenStop(NamedTuple):
    """A stop: its end, the frequency before it, its duration in seconds."""

    end: float
    hertz: float
    seconds: float


def last_run(points: Sequence[TrendPoint], since: float) -> TrendPoint | None:
    """Return the newest point of a run that began after `since`; None without one.

    A family without a frequency shows a run by the mark of its start.
    """
    found: TrendPoint | None = None
    for point in reversed(points):
        if point.time <= since:
            break
        if _turns(point) or point.mark == "start":
            found = found or point
        if found is not None and (point.mark == "start" or not _turns(point)):
            return found
    return None


def _hertz(point: TrendPoint) -> float | None:
    value = point.values[0] if point.values else None
    return None if value is None else abs(value)


def _turns(point: TrendPoint) -> bool:
    return (_hertz(point) or 0.0) >= TURNS_FROM


def last_steady(points: Sequence[TrendPoint], hertz: float, since: float) -> SteadyRun | None:
    """Return the newest run at this speed that lasted STEADY_SECONDS; None without one."""
    held: list[TrendPoint] = []
    for point in reversed(points):
        value = _hertz(point) if point.time > since else None
        if value is not None and abs(value - hertz) <= STEADY_WITHIN:
            held.append(point)
            continue
        if _lasted(held):
            break
        held = []
        if point.time <= since:
            return None
    if not _lasted(held):
        return None
    # the ramp to the speed ends within STEADY_WITHIN of it: its current does not count
    held = [point for point in held if held[0].time - point.time <= STEADY_SECONDS]
    currents = [value for point in held if (value := point.values[1]) is not None]
    mean = sum(_hertz(point) or 0.0 for point in held) / len(held)
    return SteadyRun(held[0].time, mean, sum(currents) / len(currents) if currents else None)


def _lasted(held: Sequence[TrendPoint]) -> bool:
    return len(held) > 1 and held[0].time - held[-1].time >= STEADY_SECONDS


def last_stop(points: Sequence[TrendPoint], since: float) -> SeenStop | None:
    """Return the newest stop from a run to standstill after `since`; None without one."""
    end: TrendPoint | None = None
    way: list[TrendPoint] = []
    for point in reversed(points):
        value = _hertz(point)
        if value is None or point.time <= since:
            break
        if way and not _turns(point):
            break
        if _turns(point):
            way.append(point)
        else:
            end = point  # the first point at standstill after the run, in the end
        if way and end is None:
            return None  # it still turns
    if end is None or not way:
        return None
    top = max(_hertz(point) or 0.0 for point in way)
    begin = next(point for point in way if (_hertz(point) or 0.0) >= TOP_SHARE * top)
    return SeenStop(end.time, top, end.time - begin.time)
