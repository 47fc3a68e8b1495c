"""Trend of a drive, shared with other programs on the line and kept for the next one."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec

from tui.bus.line_events import LineEvent, NoteReceived
from tui.bus.notes import LONGEST_KIND, LineNote
from tui.bus.shared_state import SharedState

from .trend import TREND_QUANTITIES, Trend, TrendPoint

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
