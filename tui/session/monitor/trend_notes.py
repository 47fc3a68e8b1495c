"""The trend of a drive, left for the next program on the line."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec

from tui.bus.line_events import LineEvent, NoteReceived
from tui.bus.notes import LONGEST_KIND, LineNote
from tui.bus.shared_state import SharedState

from .trend import TREND_QUANTITIES, Trend, TrendPoint

NOTED_EVERY = 2.0
"""Seconds of the trend in one note, about: so many are lost with a program that is killed."""
MOST_NOTED = 100
"""Points in one note."""


class TrendNotes:
    """Leaves the points of one trend, and takes those that other programs have left.

    Times are those of the machine's monotonic clock, which all its programs share.
    """

    def __init__(self, facts: SharedState, device: int, trend: Trend) -> None:
        self._notes = facts.notes
        self._events = facts.events
        self._device = device
        self._trend = trend
        self._kind = trend.kind[:LONGEST_KIND]
        self._points: list[TrendPoint] = []
        self._others: list[TrendPoint] = []
        """Points of other programs that are not in the trend yet."""
        self._requested = False
        self._end: Callable[[], None] | None = None

    def ask(self) -> None:
        """Ask for the trend of other programs; once is enough."""
        if self._end is None:
            self._end = self._events.subscribe(self._hear)
        if not self._requested:
            self._requested = True
            self._notes.ask(self._device, self._kind)

    def end(self) -> None:
        """Hear nothing more, until it is asked again."""
        if self._end is not None:
            self._end()
            self._end = None

    def add(self, point: TrendPoint) -> None:
        """Leave a point, together with those around it."""
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
    """True if a trend can be drawn of it."""
    numbers = [point.time, *(value for value in point.values if value is not None)]
    return len(point.values) == len(TREND_QUANTITIES) and all(map(math.isfinite, numbers))
