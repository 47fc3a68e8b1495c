"""Trend of one drive: the last minutes of some of its values."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity

from ..drive_state import DriveState, with_direction
from ..reading import Reading, with_text
from .snapshot import Snapshot

TREND_SECONDS = 600.0
TREND_QUANTITIES: tuple[Quantity, ...] = (
    "output_frequency",
    "motor_current",
    "frequency_reference",
)
DIRECTED = frozenset({"output_frequency", "frequency_reference"})
"""Quantities whose sign is the direction of the motor."""


@dataclass(frozen=True, slots=True)
class TrendPoint:
    """Values of TREND_QUANTITIES at a time (monotonic); None for a value that was not read."""

    time: float
    values: tuple[float | None, ...]


class Trend:
    """Keeps TREND_QUANTITIES of one drive for TREND_SECONDS."""

    def __init__(self, profile: Profile, points: Iterable[TrendPoint] = ()) -> None:
        self._profile = profile
        self._points = deque(points)
        found = (profile.quantity(quantity) for quantity in TREND_QUANTITIES)
        self._codes = [parameter.code if parameter else None for parameter in found]

    @property
    def points(self) -> tuple[TrendPoint, ...]:
        """The points of the last TREND_SECONDS, oldest first."""
        return tuple(self._points)

    @property
    def kind(self) -> str:
        """Profile, codes and units: points of trends of the same kind can be joined."""
        parts = [f"trend {self._profile.id}"]
        for code in self._codes:
            parameter = self._profile[code] if code else None
            parts.append(f"{parameter.code} {parameter.unit}" if parameter is not None else "-")
        return ", ".join(parts)

    def join(self, earlier: Iterable[TrendPoint]) -> None:
        """Insert points of another program by time."""
        points = {point.time: point for point in (*earlier, *self._points)}
        last = max(points, default=0.0)
        times = sorted(point for point in points if point >= last - TREND_SECONDS)
        self._points = deque(points[time] for time in times)

    def add(self, snapshot: Snapshot) -> TrendPoint:
        """Add a cycle; a failed cycle leaves a gap, never a repeated value."""
        readings = with_text(snapshot.readings)
        values = tuple(
            trend_value(readings[code], snapshot.state)
            if code and code in readings and not snapshot.error
            else None
            for code in self._codes
        )
        point = TrendPoint(snapshot.time, values)
        self._points.append(point)
        while self._points[0].time < snapshot.time - TREND_SECONDS:
            self._points.popleft()
        return point


def trend_value(reading: Reading, state: DriveState) -> float | None:
    """Return a value of the trend; a frequency has the sign of its direction."""
    number, parameter = reading.number, reading.parameter
    if number is None or parameter.quantity not in DIRECTED:
        return number
    return with_direction(parameter, number, state)
