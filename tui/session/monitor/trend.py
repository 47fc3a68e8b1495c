"""Trend of one drive: the last minutes of some of its values, shared with other programs."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol, get_args

import msgspec

from tui.bus.line_events import LineEvent, NoteReceived
from tui.bus.notes import LONGEST_KIND, LineNote
from tui.bus.shared_state import SharedState
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity

from ..drive_state import DriveState, with_direction
from ..reading import Reading, with_text
from ..shown import Shown

TREND_SECONDS = 600.0
TREND_QUANTITIES: tuple[Quantity, ...] = (
    "output_frequency",
    "motor_current",
    "frequency_reference",
)
READOUT_NAMES: dict[Quantity, tuple[str, ...]] = {
    "output_frequency": ("output frequency",),
    "motor_current": ("motor current", "output current"),
}
"""Names by which a family has a quantity that no manual confirms; its value is shown raw."""
DIRECTED = frozenset({"output_frequency", "frequency_reference"})
"""Quantities whose sign is the direction of the motor."""


@dataclass(frozen=True, slots=True)
class TrendPoint:
    """Values of TREND_QUANTITIES at a time (monotonic); None for a value that was not read."""

    time: float
    values: tuple[float | None, ...]
    mark: str = ""
    """A TrendMark, or empty; a program of another version may leave others."""


class TrendCycle(Protocol):
    """One read of a drive's values: a cycle of its monitor, or a check of the line watch."""

    @property
    def time(self) -> float:
        """End of the read (monotonic)."""

    @property
    def error(self) -> str:
        """Why it failed; empty if it succeeded."""

    @property
    def readings(self) -> Mapping[str, Shown]:
        """Its values."""

    @property
    def state(self) -> DriveState | None:
        """State of the drive; None if the read failed."""


TrendMark = Literal["lost", "trip", "stop", "start", "reset", "write", "reference"]
"""Event in a trend: the drive stopped answering, tripped, stopped, started, was reset, got
settings by an edit, or got another reference."""
TREND_MARKS: tuple[TrendMark, ...] = get_args(TrendMark)
"""All of them, the most urgent first."""
REFERENCE_STEP = 0.5
"""Least change of a reference, in its unit, that is marked; smaller ones are noise of an input."""


def readout_parameter(profile: Profile, quantity: Quantity) -> Parameter | None:
    """Return the parameter of a quantity, confirmed by a manual or only by its name."""
    if (parameter := profile.quantity(quantity)) is not None:
        return parameter
    watched = (profile[value.parameter] for value in profile.data.monitoring.values)
    names = READOUT_NAMES.get(quantity, ())
    return next((p for p in watched if p.name.casefold() in names), None)


class Trend:
    """Keeps TREND_QUANTITIES of one drive for TREND_SECONDS."""

    def __init__(self, profile: Profile, points: Iterable[TrendPoint] = ()) -> None:
        self._profile = profile
        self._points = deque(points)
        found = (readout_parameter(profile, quantity) for quantity in TREND_QUANTITIES)
        self._codes = [parameter.code if parameter else None for parameter in found]
        self._marker = TrendMarker()

    @property
    def points(self) -> tuple[TrendPoint, ...]:
        """The points of the last TREND_SECONDS, oldest first."""
        return tuple(self._points)

    @property
    def last(self) -> TrendPoint | None:
        """The newest point; None without any."""
        return self._points[-1] if self._points else None

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

    def add(self, cycle: TrendCycle, edits: int = 0) -> TrendPoint:
        """Add a cycle; a failed cycle leaves a gap, never a repeated value.

        `edits` is the number of settings that this program has written to the drive so far.
        """
        state = None if cycle.error else cycle.state
        readings = with_text(cycle.readings)
        values = tuple(
            trend_value(readings[code], state)
            if code and code in readings and state is not None
            else None
            for code in self._codes
        )
        mark = self._marker.mark(cycle, values[REFERENCE_PLACE], edits)
        point = TrendPoint(cycle.time, values, mark)
        self._points.append(point)
        while self._points[0].time < cycle.time - TREND_SECONDS:
            self._points.popleft()
        return point


REFERENCE_PLACE = TREND_QUANTITIES.index("frequency_reference")
"""Place of the reference among the values of a point."""


class TrendMarker:
    """Finds the events between one cycle and the next."""

    def __init__(self) -> None:
        self._kind = ""
        """Kind of the last known state; empty before the first, and after an unknown one."""
        self._failed = True
        self._references: tuple[float | None, float | None] = (None, None)
        self._edits = 0

    def mark(self, cycle: TrendCycle, reference: float | None, edits: int) -> str:
        """Return the most urgent event since the last cycle; empty without one."""
        state = None if cycle.error else cycle.state
        found = set(self._events(state, reference, edits))
        self._failed = state is None
        self._references = (self._references[1], reference)
        if state is not None:
            self._kind, self._edits = "" if state.kind == "unknown" else state.kind, edits
        return next((mark for mark in TREND_MARKS if mark in found), "")

    def _events(
        self, state: DriveState | None, reference: float | None, edits: int
    ) -> Iterator[TrendMark]:
        """Yield the events of a cycle; `state` is None if it failed."""
        if state is None:
            if not self._failed:
                yield "lost"
            return
        if edits > self._edits:
            yield "write"
        before, kind = self._kind, state.kind
        if before and kind not in (before, "unknown"):
            found = _change(before, kind)
            # events of a drive that was not read are not known, except a fault that it now has
            yield from (mark for mark in found if not self._failed or mark == "trip")
        earlier, last = self._references
        if reference is None or last is None or earlier != last:
            return  # an analog input changes with each cycle: only a step from rest is an event
        if abs(reference - last) >= REFERENCE_STEP:
            yield "reference"


def _change(before: str, kind: str) -> Iterator[TrendMark]:
    """Yield the events of a change from one kind of state to another."""
    if kind == "fault":
        yield "trip"
    elif before == "fault":
        yield "reset"
    elif before == "running":
        yield "stop"
    if kind == "running":
        yield "start"


def trend_value(reading: Reading, state: DriveState) -> float | None:
    """Return a value of the trend; a frequency has the sign of its direction."""
    number, parameter = reading.number, reading.parameter
    if number is None or parameter.quantity not in DIRECTED:
        return number
    return with_direction(parameter, number, state)


NOTED_EVERY = 2.0
"""Seconds of the trend in one note, approximately: a killed program loses as many."""
MOST_NOTED = 100
"""Points in one note."""


class TrendNotes:
    """Shares the points of one trend as notes on the line, and adds those of other programs.

    Times are on the computer's monotonic clock, which all its programs share.
    """

    def __init__(self, facts: SharedState, device: int, trend: Trend) -> None:
        self._notes = facts.notes
        self._events = facts.events
        self._device = device
        self._trend = trend
        self._kind = trend.kind[:LONGEST_KIND]
        self._points: list[TrendPoint] = []
        self._others: list[TrendPoint] = []
        """Points received from other programs, not in the trend yet."""
        self._requested = False
        self._end: Callable[[], None] | None = None

    def ask(self) -> None:
        """Request the trend from other programs; only the first call sends a request."""
        if self._end is None:
            self._end = self._events.subscribe(self._hear)
        if not self._requested:
            self._requested = True
            self._notes.ask(self._device, self._kind)

    def end(self) -> None:
        """Stop receiving notes until the next call of `ask`."""
        if self._end is not None:
            self._end()
            self._end = None

    def add(self, point: TrendPoint) -> None:
        """Add a point to the next note, which is sent when it has enough points."""
        if self._others:
            self._trend.join(self._others)
            self._others = []
        self._points.append(point)
        if point.time - self._points[0].time >= NOTED_EVERY or len(self._points) >= MOST_NOTED:
            data = msgspec.msgpack.encode(self._points)
            self._points = []
            self._notes.leave(LineNote(self._device, self._kind, data))

    def _hear(self, event: LineEvent) -> None:
        if not isinstance(event, NoteReceived):
            return
        note = event.note
        if (note.device, note.kind) == (self._device, self._kind):
            points = msgspec.msgpack.decode(note.data, type=list[TrendPoint])
            self._others += [point for point in points if _is_whole(point)]


def _is_whole(point: TrendPoint) -> bool:
    """True if the point has all values, and no infinite or undefined one."""
    numbers = [point.time, *(value for value in point.values if value is not None)]
    return len(point.values) == len(TREND_QUANTITIES) and all(map(math.isfinite, numbers))
