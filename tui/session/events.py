"""Messages about the drives of a line, the newest last; for any thread."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
from threading import Lock
from typing import NamedTuple

log = logging.getLogger(__name__)

EVENTS_KEPT = 500


class Event(NamedTuple):
    """One message; `wall` is time.time(), `device` is None for a message about the line."""

    wall: float
    device: int | None
    kind: str
    """`done`, `refused`, `stop`, `failed`, `fault`, `alarm` or `told`."""
    text: str


class EventLog:
    """Keeps the last EVENTS_KEPT messages."""

    def __init__(self, wall: Callable[[], float] = time.time) -> None:
        self.left: Callable[[Event], None] = lambda _: None
        """Called with each new event."""
        self._wall = wall
        self._newest: Event | None = None
        self._lock = Lock()
        self._events: deque[Event] = deque(maxlen=EVENTS_KEPT)

    def add(
        self, kind: str, text: str, device: int | None = None, wall: float | None = None
    ) -> Event | None:
        """Add an event, at the time `wall` (default: now); None if it repeats the last one."""
        with self._lock:
            last = self._newest
            if last is not None and (last.device, last.kind, last.text) == (device, kind, text):
                return None
            at = self._wall() if wall is None else wall
            self._newest = new = Event(at, device, kind, text)
            self._events.append(new)
        try:
            self.left(new)
        except Exception:
            # the message itself is kept: what it reports goes on
            log.exception("a message was not sent to the other programs")
        return new

    def join(self, event: Event) -> None:
        """Add an event of another program at its time, unless it is already there."""
        with self._lock:
            if event not in self._events:
                events = sorted((*self._events, event), key=lambda item: item.wall)
                self._events = deque(events, maxlen=EVENTS_KEPT)

    def __bool__(self) -> bool:
        """True even if empty, because `if log` asks for its existence."""
        return True

    @property
    def newest(self) -> Event | None:
        """The last event of this program; None before the first."""
        with self._lock:
            return self._newest

    @property
    def events(self) -> tuple[Event, ...]:
        """The events, oldest first."""
        with self._lock:
            return tuple(self._events)
