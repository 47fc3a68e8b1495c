"""Everything that was said about the drives of a line, newest last; for any thread."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from threading import Lock
from typing import NamedTuple

EVENTS_KEPT = 500


class Event(NamedTuple):
    """One thing that was said; `wall` is time.time(), `device` None where it is about none."""

    wall: float
    device: int | None
    kind: str
    """`done`, `refused`, `stop`, `failed`, `fault`, `alarm` or `told`."""
    text: str


class EventLog:
    """Keeps the last events."""

    def __init__(self, wall: Callable[[], float] = time.time) -> None:
        self._wall = wall
        self._lock = Lock()
        self._events: deque[Event] = deque(maxlen=EVENTS_KEPT)

    def add(
        self, kind: str, text: str, device: int | None = None, wall: float | None = None
    ) -> None:
        """Keep an event, of the time `wall` if given; a repetition in a row is kept once."""
        with self._lock:
            last = self._events[-1] if self._events else None
            if last is not None and (last.device, last.kind, last.text) == (device, kind, text):
                return
            at = self._wall() if wall is None else wall
            self._events.append(Event(at, device, kind, text))

    def __bool__(self) -> bool:
        """A log is there however empty it is."""
        return True

    @property
    def newest(self) -> Event | None:
        """The last event; None where nothing was said yet."""
        with self._lock:
            return self._events[-1] if self._events else None

    @property
    def events(self) -> tuple[Event, ...]:
        """The events, oldest first."""
        with self._lock:
            return tuple(self._events)
