"""The present faults of all drives of a line, in their order, and which of them were viewed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ..drive_state import DriveState
from ..events import EventLog


@dataclass(frozen=True, slots=True)
class FaultOnset:
    """When a drive's present fault was first read; `wall` in seconds since 1970."""

    wall: float
    tripped: bool
    """True if the read before showed no such fault: `wall` is then the time of the trip."""
    code: str = ""


class FaultOnsets:
    """Keeps the onset of each drive's fault; written in the line's loop, read in any thread."""

    def __init__(self) -> None:
        self._free: frozenset[int] = frozenset()
        """Drives without a fault at their last read."""
        self.by_device: Mapping[int, FaultOnset] = {}
        self._recalled: dict[int, float] = {}
        """Time of the newest state from a record, by device."""

    def recall(self, device: int, state: DriveState, wall: float) -> None:
        """Note a state of a record; one before it that is read later changes nothing."""
        self.note(device, state, wall)
        self._recalled[device] = wall

    def note(self, device: int, state: DriveState, wall: float) -> None:
        """Note a state that was just read; an unknown state changes nothing."""
        if state.kind == "unknown" or wall < self._recalled.get(device, -math.inf):
            return
        onset = self.by_device.get(device)
        if state.kind != "fault":
            self._free |= {device}
            self.by_device = {
                d: fault_onset for d, fault_onset in self.by_device.items() if d != device
            }
            return
        code = state.fault.code if state.fault else ""
        if onset is not None and (onset.code == code or not code):
            return
        if onset is not None and not onset.code:
            now = replace(onset, code=code)  # the code may be read a cycle after the state
        else:
            now = FaultOnset(wall, onset is not None or device in self._free, code)
        self._free -= {device}
        self.by_device = {**self.by_device, device: now}


@dataclass(frozen=True, slots=True)
class PresentFault:
    """A fault that a drive is in; `wall` in seconds since 1970."""

    device: int
    code: str
    """As the drive's keypad shows it; empty if the fault code was not read."""
    name: str
    wall: float
    """Time of the trip if `tripped`, else of the first read that showed the fault."""
    tripped: bool = False
    """True if the trip was observed; False if the first read already showed the fault."""
    seen: bool = False
    """True if a person has viewed it."""

    @property
    def when(self) -> str:
        """The time of day with its meaning: `tripped ...` or `seen since ...`."""
        at = time.strftime("%H:%M:%S", time.localtime(self.wall))
        return f"tripped {at}" if self.tripped else f"seen since {at}"


class LineAlarms:
    """Tracks the faults of the drives of one line, in the order in which they occurred.

    For one loop only. Adds each change to the event log, and passes it to `record` for the journal.
    """

    def __init__(
        self,
        events: EventLog,
        record: Callable[[PresentFault, str], None],
    ) -> None:
        self._events = events
        self._record = record
        self._active: dict[int, PresentFault] = {}
        self._recorded: dict[int, float] = {}
        """Time of the last onset in the journal, by device."""

    @property
    def active(self) -> tuple[PresentFault, ...]:
        """The present faults, oldest first."""
        return tuple(self._active.values())

    @property
    def unseen(self) -> bool:
        """True if there is a fault that no person has viewed."""
        return any(not fault.seen for fault in self._active.values())

    def take(self, states: Mapping[int, DriveState], onsets: Mapping[int, FaultOnset]) -> bool:
        """Update with the latest state and fault onset of each drive; return True for a new fault.

        A drive in an unknown state keeps its fault; a drive missing from `states` loses it.
        """
        for device in self._active.keys() - states.keys():
            del self._active[device]
        new = [self._take_one(device, state, onsets) for device, state in states.items()]
        return any(new)  # from a list: every drive must be updated, also after a new fault

    def _take_one(self, device: int, state: DriveState, onsets: Mapping[int, FaultOnset]) -> bool:
        was = self._active.get(device)
        if state.kind == "unknown":
            return False
        if state.kind != "fault":
            self._recorded.pop(device, None)
            if was is not None:
                del self._active[device]
                self._events.add("done", _reset_text(was), device)
                self._record(was, "reset")
            return False
        fault = state.fault
        code, name = (fault.code, fault.name) if fault else ("", "")
        if was is not None and (was.code == code or not code):
            return False
        if was is not None and not was.code:
            # the code may be read a cycle after the state
            self._active[device] = replace(was, code=code, name=name)
            self._events.add("fault", f"The fault is {_called(self._active[device])}.", device)
            self._record(self._active[device], "code read")
            return False
        first = next(iter(self._active.values()), None)
        onset = onsets.get(device)
        if onset is None or (code and onset.code not in ("", code)):
            return False  # the line's loop has not noted the onset yet; the next call will find it
        now = PresentFault(device, code, name, onset.wall, onset.tripped)
        self._active[device] = now
        if was is None and self._recorded.get(device) == onset.wall:
            return False  # the same trip, of a drive that was lost in the meantime
        self._recorded[device] = onset.wall
        self._events.add("fault", _onset_text(first, now), device, now.wall)
        self._record(now, "tripped" if now.tripped else "seen")
        return True

    def acknowledge(self, device: int) -> None:
        """Note that a person has viewed the fault of a drive."""
        fault = self._active.get(device)
        if fault is not None and not fault.seen:
            self._active[device] = replace(fault, seen=True)


def _called(fault: PresentFault) -> str:
    return f"{fault.code} {fault.name}".strip() or "a fault whose code was not read"


def _reset_text(fault: PresentFault) -> str:
    named = f"{fault.code} {fault.name}".strip()
    return f"{named} is reset." if named else "The fault is reset. Its code was not read."


_TRIPPED = "Tripped on {fault}."
_TRIPPED_AFTER_FAULT = "Tripped on {fault}. Drive {device} was in fault before."
_TRIPPED_AFTER_TRIP = "Tripped on {fault}. Drive {device} tripped first, at {at}."
_SEEN = "Already tripped on {fault} when first seen."


def _onset_text(first: PresentFault | None, now: PresentFault) -> str:
    """Return a new fault, and the earlier fault of the line if there is one."""
    if not now.tripped:
        return _SEEN.format(fault=_called(now))
    if first is None or first.device == now.device:
        return _TRIPPED.format(fault=_called(now))
    text = _TRIPPED_AFTER_TRIP if first.tripped else _TRIPPED_AFTER_FAULT
    at = time.strftime("%H:%M:%S", time.localtime(first.wall))
    return text.format(fault=_called(now), device=first.device, at=at)
