"""Trend of one drive: the last minutes of some of its values, shared with other programs."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, Protocol, get_args

import msgspec

from tui.bus.line_events import DeviceWritten, LineEvent, NoteReceived
from tui.bus.notes import LONGEST_KIND, LineNote
from tui.bus.program import readable
from tui.bus.requests import BROADCAST
from tui.bus.shared_state import SharedState
from tui.drive.foreign_write import WordKind, classify_words, has_reference
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity
from tui.wire.frames import BIT_READS, at_place

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
    by: tuple[str, ...] = ()
    """Programs that wrote the settings, or a command or reference in the COMMAND_REACH before."""
    codes: tuple[str, ...] = ()
    """Settings that a `write` changed; `register N` for an address that the profile lacks.

    For a `trip`, its fault with code and name; empty if it was not read.
    """


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
settings from a program on the line, or got another reference."""
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


def trend_codes(profile: Profile) -> list[str | None]:
    """Return the code of each of TREND_QUANTITIES; None for one that the profile lacks."""
    found = (readout_parameter(profile, quantity) for quantity in TREND_QUANTITIES)
    return [parameter.code if parameter else None for parameter in found]


def trend_values(codes: Iterable[str | None], cycle: TrendCycle) -> tuple[float | None, ...]:
    """Return the values of codes in a cycle; None for each that was not read."""
    state = None if cycle.error else cycle.state
    readings = with_text(cycle.readings)
    return tuple(
        trend_value(readings[code], state)
        if code and code in readings and state is not None
        else None
        for code in codes
    )


class Trend:
    """Keeps TREND_QUANTITIES of one drive for TREND_SECONDS."""

    def __init__(self, profile: Profile, points: Iterable[TrendPoint] = ()) -> None:
        self._profile = profile
        self._points = deque(points)
        self._codes = trend_codes(profile)
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

    def resume(self, earlier: Trend) -> None:
        """Continue another trend of the drive: it replaces the points up to its last one."""
        if (last := earlier.last) is None:
            return
        later = [point for point in self._points if point.time > last.time]
        self._points = deque((*earlier.points, *later))
        if not later:
            self._marker = earlier._marker

    def note_write(self, written: DeviceWritten) -> None:
        """Note a write to the drive by any program, for the mark of the next cycle."""
        words = classify_words(self._profile, written.words, {})
        settings = [item for item in words if item.kind in (WordKind.SETTING, WordKind.UNKNOWN)]
        codes = [
            code
            for item in settings
            for code in [part.code for part in item.parameters] or [_place_text(item.address)]
        ]
        by = written.program.text
        if codes:
            self._marker.writes.append(TrendWrite(written.time, by, tuple(dict.fromkeys(codes))))
        if len(settings) < len(words):
            reference = has_reference(self._profile, words)
            self._marker.commands.append(TrendWrite(written.time, by, reference=reference))

    def add(self, cycle: TrendCycle) -> TrendPoint:
        """Add a cycle; a failed cycle leaves a gap, never a repeated value."""
        values = trend_values(self._codes, cycle)
        mark, by, codes = self._marker.mark(cycle, values[REFERENCE_PLACE])
        point = TrendPoint(cycle.time, values, mark, by, codes)
        last = self.last
        if last is not None and last.mark == "trip" and not last.codes and cycle.state is not None:
            # the fault code may be read a cycle after the state
            self._points[-1] = replace(last, codes=_fault_of(cycle.state))
        self._points.append(point)
        while self._points[0].time < cycle.time - TREND_SECONDS:
            self._points.popleft()
        return point


REFERENCE_PLACE = TREND_QUANTITIES.index("frequency_reference")
"""Place of the reference among the values of a point."""


COMMAND_REACH = 2.0
"""Seconds before the end of a cycle in which a command may be the cause of its event."""
MOST_COMMANDS = 20
"""Commands that are kept for the cause of an event."""
MOST_BY, MOST_CODES = 2, 20
"""Programs and settings that a point names; the newest programs, the first settings."""
COMMANDED = ("stop", "start", "reset", "reference")


def _place_text(place: int) -> str:
    function, address = at_place(place)
    return f"coil {address}" if function in BIT_READS else f"register {address}"


class TrendWrite(NamedTuple):
    """Write to a drive, with its time (monotonic) and program; no codes for a command."""

    time: float
    by: str
    codes: tuple[str, ...] = ()
    reference: bool = True
    """False for a command that does not change the reference."""


class MarkedEvent(NamedTuple):
    """Event of a cycle, with the fields of its point."""

    mark: str
    by: tuple[str, ...] = ()
    codes: tuple[str, ...] = ()


class TrendMarker:
    """Finds the events between one cycle and the next."""

    def __init__(self) -> None:
        self._kind = ""
        """Kind of the last known state; empty before the first, and after an unknown one."""
        self._failed = True
        self._references: tuple[float | None, float | None] = (None, None)
        self.writes: list[TrendWrite] = []
        """Writes of settings since the last cycle that succeeded."""
        self.commands: deque[TrendWrite] = deque(maxlen=MOST_COMMANDS)
        """The last writes of commands and references, the newest last."""

    def mark(self, cycle: TrendCycle, reference: float | None) -> MarkedEvent:
        """Return the most urgent event since the last cycle."""
        state = None if cycle.error else cycle.state
        found = set(self._events(state, reference))
        self._failed = state is None
        self._references = (self._references[1], reference)
        writes = self.writes
        if state is not None:
            self._kind, self.writes = "" if state.kind == "unknown" else state.kind, []
        mark = next((mark for mark in TREND_MARKS if mark in found), "")
        if mark == "write":
            codes = tuple(dict.fromkeys(code for write in writes for code in write.codes))
            return MarkedEvent(mark, _programs(writes), codes[:MOST_CODES])
        if mark == "trip" and state is not None:
            return MarkedEvent(mark, codes=_fault_of(state))
        if mark not in COMMANDED:
            return MarkedEvent(mark)
        recent = [item for item in self.commands if cycle.time - item.time <= COMMAND_REACH]
        if mark == "reference":
            recent = [item for item in recent if item.reference]
        return MarkedEvent(mark, _programs(recent))

    def _events(self, state: DriveState | None, reference: float | None) -> Iterator[TrendMark]:
        """Yield the events of a cycle; `state` is None if it failed."""
        if state is None:
            if not self._failed:
                yield "lost"
            return
        if self.writes:
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


def _fault_of(state: DriveState) -> tuple[str, ...]:
    """Return the present fault with code and name; empty if it was not read."""
    return (f"{state.fault.code} {state.fault.name}".strip(),) if state.fault else ()


def _programs(writes: Iterable[TrendWrite]) -> tuple[str, ...]:
    """Return the programs of writes, the last ones last."""
    newest = dict.fromkeys(write.by for write in reversed(list(writes)))
    return tuple(newest)[:MOST_BY][::-1]


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
LONGEST_BY = 120
"""Characters of the name of a program or a setting, of those that another program leaves."""


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
        match event:
            case NoteReceived(note) if (note.device, note.kind) == (self._device, self._kind):
                points = msgspec.msgpack.decode(note.data, type=list[TrendPoint])
                self._others += [_plain(point) for point in points if _is_whole(point)]
            case DeviceWritten(device=device) if device in (BROADCAST, self._device):
                self._trend.note_write(event)


def _plain(point: TrendPoint) -> TrendPoint:
    """Return a point of another program with texts that can be shown."""
    if not point.mark:
        return point
    by, codes = point.by[:MOST_BY], point.codes[:MOST_CODES]
    return replace(
        point,
        by=tuple(readable(text, LONGEST_BY) for text in by),
        codes=tuple(readable(text, LONGEST_BY) for text in codes),
    )


def _is_whole(point: TrendPoint) -> bool:
    """True if the point has all values, and no infinite or undefined one."""
    numbers = [point.time, *(value for value in point.values if value is not None)]
    return len(point.values) == len(TREND_QUANTITIES) and all(map(math.isfinite, numbers))
