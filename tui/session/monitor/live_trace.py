"""Values of some parameters of a drive as they are read, until they are in its record."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from threading import Lock

from ..drive import DriveSession
from ..record.decoding import NO_GOOD_REPLY, UNKNOWN_SCALE, HistoryPoint, curve_number
from ..shown import Shown
from .monitor import Monitor
from .snapshot import Snapshot

SET_BACK = 1.0
"""Seconds by which the time must go back to be another time."""
MOST_TRACED = 40_000
"""Points of one parameter: an hour of ten a second."""


class LiveTrace:
    """Has a monitor read some codes in each cycle, and keeps their values. For any thread."""

    def __init__(self, monitor: Monitor, codes: Sequence[str], period: float) -> None:
        """`period` is the cycle in seconds, unless the monitor runs already."""
        self.codes = tuple(codes)
        self._session: DriveSession = monitor.session
        self._lock = Lock()
        self._points = {code: deque[HistoryPoint](maxlen=MOST_TRACED) for code in self.codes}
        self._leave = monitor.listen(self._take)
        self._end = monitor.also_read(self.codes, period)

    def close(self) -> None:
        """Read them no longer."""
        self._leave()
        self._end()

    def points(self, code: str, since: float) -> list[HistoryPoint]:
        """Return the values of a code after a time in seconds since 1970."""
        found = []
        with self._lock:
            for point in reversed(self._points[code]):
                if point.time <= since:
                    break
                found.append(point)
        return found[::-1]

    def _take(self, snapshot: Snapshot) -> None:
        """Add what a cycle has read. In the line's thread."""
        with self._lock:
            for code, points in self._points.items():
                reading = snapshot.readings.get(code)
                if reading is None:
                    continue
                at = self._session.clock.wall_of(reading.time)
                if points and snapshot.wall < points[-1].time - SET_BACK:
                    points.clear()  # the clock was set back, or a replay
                if points and at <= points[-1].time:
                    if not snapshot.error:
                        continue
                    at = snapshot.wall
                points.append(self._point(reading, at, failed=bool(snapshot.error)))

    def _point(self, reading: Shown, at: float, *, failed: bool) -> HistoryPoint:
        session, raw, value = self._session, reading.raw, None
        why = reading.error or NO_GOOD_REPLY
        if raw is not None and not failed:
            image = session.image
            raws, absent = image.trusted, image.lacking
            value = curve_number(session.profile, reading.parameter, raw, raws, absent)
            why = UNKNOWN_SCALE
        if value is None:
            return HistoryPoint(at, at, None, None, None, why, 0, 1)
        return HistoryPoint(at, at, value, value, value, raw=raw)
