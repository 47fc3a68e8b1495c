"""RunCurve of a run, cycle by cycle: ramp times and stop times from it, and its drawing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple
from xml.sax.saxutils import escape

from tui.drive.plain import plain
from tui.drive.profile.profile import Profile

from ..drive_state import with_direction
from ..monitor.snapshot import Snapshot
from ..reading import with_text

RAMP_FROM, RAMP_TO = 0.1, 0.9
"""Shares of the whole way between which a ramp is timed; its ends may be rounded."""
LEAST_ON_RAMP = 3
"""Fewest values on a ramp that is timed."""


class RunPoint(NamedTuple):
    """Values of one cycle: the time in seconds (monotonic), Hz with the sign of the direction, and
    A if known."""

    time: float
    hertz: float
    amperes: float | None = None


@dataclass(slots=True)
class RunCurve:
    """Values of one run. `take` is called in the line's thread, the rest in any."""

    profile: Profile
    points: list[RunPoint] = field(default_factory=list)
    marks: list[tuple[float, str]] = field(default_factory=list)
    """Events by time (monotonic)."""

    def take(self, latest: Snapshot) -> None:
        """Add the values of a cycle, unless it failed or has no new frequency."""
        parameter = self.profile.quantity("output_frequency")
        if parameter is None or latest.error:
            return
        readings = with_text(latest.readings)
        reading = readings.get(parameter.code)
        number = reading.current_number if reading is not None else None
        if reading is None or number is None:
            return
        if self.points and reading.time <= self.points[-1].time:
            return
        current = self.profile.quantity("motor_current")
        held = readings.get(current.code) if current is not None else None
        amperes = held.current_number if held is not None else None
        hertz = with_direction(parameter, number, latest.state)
        self.points.append(RunPoint(reading.time, hertz, amperes))

    def since(self, start: float, end: float | None = None) -> list[RunPoint]:
        """Return the points of a period (monotonic)."""
        return [p for p in tuple(self.points) if start <= p.time and (end is None or p.time <= end)]


def ramp_seconds(points: Sequence[RunPoint], low: float, high: float, base: float) -> float | None:
    """Return the seconds that a ramp takes for `base` Hz; None if it was not seen.

    It is timed between 10 % and 90 % of the way from `low` to `high` Hz, up or down.
    """
    way = high - low
    begin, end = low + RAMP_FROM * way, low + RAMP_TO * way
    first = _crossing(points, begin)
    if first is None:
        return None
    last = _crossing([p for p in points if p.time >= first], end)
    inside = [p for p in points if last is not None and first <= p.time <= last]
    if last is None or len(inside) < LEAST_ON_RAMP:
        return None
    return (last - first) / (RAMP_TO - RAMP_FROM) * base / abs(way)


def _crossing(points: Sequence[RunPoint], level: float) -> float | None:
    """Return when the frequency, without its sign, first passes a level."""
    for before, after in pairwise(points):
        a, b = abs(before.hertz), abs(after.hertz)
        if (a - level) * (b - level) <= 0 and a != b:
            return before.time + (level - a) / (b - a) * (after.time - before.time)
    return None


# Drawing

WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 800, 320, 56, 36, 40
_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
HERTZ_COLOR, AMPERE_COLOR = "#1f5fa8", "#a85f1f"


def curve_svg(curve: RunCurve, title: str, reach: float = math.inf) -> str:
    """Return a run as SVG: frequency, current, and marks.

    Values that are more than `reach` seconds apart are not connected.
    """
    points = tuple(curve.points)
    start = points[0].time if points else 0.0
    length = max(points[-1].time - start if points else 0.0, 1.0)
    right = WIDTH - LEFT
    plot = HEIGHT - TOP - BOTTOM

    def across(time: float) -> float:
        return LEFT + (time - start) / length * (right - LEFT)

    most = max((abs(p.hertz) for p in points), default=1.0) or 1.0
    low = -most if any(p.hertz < 0 for p in points) else 0.0
    amps = [abs(p.amperes) for p in points if p.amperes is not None]
    most_amps = max(amps, default=0.0) or 1.0

    def up(share: float) -> float:
        return TOP + plot * (1 - share)

    def hertz_at(value: float) -> float:
        return up((value - low) / (most - low))

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}"'
        f' width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        _text(LEFT, 20, title, size=14),
        *(_line(LEFT, hertz_at(v), right, hertz_at(v), "#dddddd") for v in _ticks(low, most)),
        *(
            _text(LEFT - 6, hertz_at(v) + 4, f"{v:g}", anchor="end", color=HERTZ_COLOR)
            for v in _ticks(low, most)
        ),
        _text(LEFT - 6, TOP - 6, "Hz", anchor="end", color=HERTZ_COLOR),
        *(
            _text(across(start + v), HEIGHT - 20, f"{v:g} s", anchor="middle")
            for v in _ticks(0, length)
        ),
    ]
    if amps:
        parts += [
            _text(right + 6, up(v / most_amps) + 4, f"{v:g}", color=AMPERE_COLOR)
            for v in _ticks(0, most_amps)
        ]
        parts.append(_text(right + 6, TOP - 6, "A", color=AMPERE_COLOR))
        for stretch in _stretches([p for p in points if p.amperes is not None], reach):
            shown = [(across(p.time), up(abs(p.amperes or 0.0) / most_amps)) for p in stretch]
            parts.append(_path(shown, AMPERE_COLOR))
    for stretch in _stretches(points, reach):
        shown = [(across(p.time), hertz_at(p.hertz)) for p in stretch]
        parts.append(_path(shown, HERTZ_COLOR))
    for time, text in curve.marks:
        if start <= time <= start + length:
            parts.append(_line(across(time), TOP, across(time), HEIGHT - BOTTOM, "#888888"))
            parts.append(_text(across(time) + 3, TOP + 12, text, color="#555555"))
    return "\n".join([*parts, "</svg>", ""])


def _stretches(points: Sequence[RunPoint], reach: float) -> Iterator[Sequence[RunPoint]]:
    """Yield the points between gaps."""
    begin = 0
    for at in range(1, len(points) + 1):
        if at == len(points) or points[at].time - points[at - 1].time > reach:
            yield points[begin:at]
            begin = at


def _ticks(low: float, high: float) -> Iterator[float]:
    span = high - low
    step = next((s for s in _STEPS if span / s <= 8), span)
    tick = -(-low // step) * step
    while tick <= high + step / 1000:
        yield round(tick, 3) + 0.0  # no -0
        tick += step


def _line(x1: float, y1: float, x2: float, y2: float, color: str) -> str:
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{color}"/>'


def _path(points: Sequence[tuple[float, float]], color: str) -> str:
    places = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{places}" fill="none" stroke="{color}" stroke-width="1.5"/>'


def _text(
    x: float, y: float, text: str, *, anchor: str = "start", color: str = "#222222", size: int = 12
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{color}" font-size="{size}">'
        f"{escape(plain(text))}</text>"
    )
