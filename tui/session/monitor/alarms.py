"""The faults of every drive of a line: which came first, and which nobody has looked at yet."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ..clock import REAL_CLOCK
from ..drive_state import DriveState
from ..events import EventLog


@dataclass(frozen=True, slots=True)
class PresentFault:
    """A fault that a drive is in now; `wall` is when it was first seen, in seconds since 1970."""

    device: int
    code: str
    """As the drive's keypad writes it; empty where its code was not read."""
    name: str
    wall: float
    seen: bool = False
    """Whether a person has looked at it."""


class LineAlarms:
    """Follows the faults of the drives of one line, in the order in which they came.

    Belongs to one loop. What came and went is told to the log of events, and by `record` to the
    journal.
    """

    def __init__(
        self,
        events: EventLog,
        record: Callable[[PresentFault, str], None],
        wall: Callable[[], float] = REAL_CLOCK.wall,
    ) -> None:
        self._events = events
        self._record = record
        self._wall = wall
        self._active: dict[int, PresentFault] = {}

    @property
    def active(self) -> tuple[PresentFault, ...]:
        """The faults of now, the first one first."""
        return tuple(self._active.values())

    @property
    def unseen(self) -> bool:
        """Whether there is a fault that nobody has looked at."""
        return any(not fault.seen for fault in self._active.values())

    def take(self, states: Mapping[int, DriveState]) -> bool:
        """Take the newest state of each drive; whether a fault is new.

        A drive whose state is not known now keeps what was known; one that is no longer there has
        no fault any more.
        """
        for device in self._active.keys() - states.keys():
            del self._active[device]
        new = [self._take_one(device, state) for device, state in states.items()]
        return any(new)  # each is looked at, whatever the one before brought

    def _take_one(self, device: int, state: DriveState) -> bool:
        was = self._active.get(device)
        if state.kind == "unknown":
            return False
        if state.kind != "fault":
            if was is not None:
                del self._active[device]
                self._events.add("done", f"{_called(was)} is reset.", device)
                self._record(was, "reset")
            return False
        fault = state.fault
        code, name = (fault.code, fault.name) if fault else ("", "")
        if was is not None and (was.code == code or not code):
            return False
        if was is not None and not was.code:
            # its code comes a moment after the state
            self._active[device] = replace(was, code=code, name=name)
            self._events.add("fault", f"the fault is {_called(self._active[device])}.", device)
            return False
        first = next(iter(self._active.values()), None)
        now = PresentFault(device, code, name, self._wall())
        self._active[device] = now
        self._events.add("fault", f"tripped: {_called(now)}{_behind(first, device)}.", device)
        self._record(now, "tripped")
        return True

    def acknowledge(self, device: int) -> None:
        """A person has looked at the fault of a drive."""
        fault = self._active.get(device)
        if fault is not None and not fault.seen:
            self._active[device] = replace(fault, seen=True)


def _called(fault: PresentFault) -> str:
    return f"{fault.code} {fault.name}".strip() or "a fault whose code was not read"


def _behind(first: PresentFault | None, device: int) -> str:
    if first is None or first.device == device:
        return ""
    at = time.strftime("%H:%M:%S", time.localtime(first.wall))
    return f"; drive {first.device} tripped first, {at}"
