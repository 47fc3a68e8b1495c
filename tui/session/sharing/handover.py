"""Handover of a drive between two programs: a request to its commander, and the answer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

from tui.bus.api import ModbusLine
from tui.bus.errors import LineClosed
from tui.bus.line_events import (
    ControlAnswered,
    ControlRequested,
    DevicesStopped,
    LineEvent,
    NoticeReceived,
    ProgramsChanged,
)
from tui.drive.errors import DriveError
from tui.safety import LONGEST_GRACE, REQUEST_ANSWERED_WITHIN, STANDSTILL_SEEN_WITHIN

from ..clock import REAL_CLOCK, Clock
from ..events import EventLog

if TYPE_CHECKING:
    from tui.bus.program import Program

    from ..drive import DriveSession
    from ..starts.keeper import StartKeeper

TAKEN_WITHIN, TAKEN_LOOK = 5.0, 0.1
"""Seconds in which a program records a motor that it was given, and between two checks."""
SURELY_STANDING = ("stopped", "ready", "blocked")
"""States in which a motor is known to be at standstill; a tripped one may coast."""


@dataclass(frozen=True, slots=True)
class DriveRequest:
    """A program requests a drive that this one commands; `until` is monotonic."""

    device: int
    program: Program
    until: float


class Handover:
    """Requests for the drives of one line, by this program and by others."""

    def __init__(
        self,
        line: ModbusLine,
        events: EventLog,
        session_of: Callable[[int], DriveSession | None],
        clock: Clock = REAL_CLOCK,
    ) -> None:
        self.person = False
        """True if a person can answer requests; without one they are decided immediately."""
        self.requests: Mapping[int, DriveRequest] = MappingProxyType({})
        """Requests of other programs, by device."""
        self._line = line
        self._events = events
        self._session_of = session_of
        self._clock = clock
        self._names: dict[str, str] = {}
        self._commanders: Mapping[int, str] = MappingProxyType({})
        self._unsubscribe = line.facts.events.subscribe(self._hear)
        self._changed()

    def close(self) -> None:
        """End the subscription."""
        self._unsubscribe()

    def _hear(self, event: LineEvent) -> None:
        match event:
            case ControlRequested(device, program):
                self._requested(device, program)
            case ControlAnswered(device, granted, why):
                self._replied(device, granted, why)
            case DevicesStopped(devices, by, program):
                self._stopped(devices, by, program)
            case NoticeReceived(device, text):
                self._events.add("stop", text, device or None)
            case ProgramsChanged():
                self._changed()

    # Requests by this program

    def ask_for(self, device: int) -> None:
        """Request a drive from the program that commands it."""
        other = self._line.facts.commander(device)
        if other is None:
            self._say(device, "No other program commands this drive. Press a to arm it.")
            return
        self._line.facts.ask_for(device)
        self._say(device, f"Requested this drive from {other.text}. The reply appears here.")

    def _replied(self, device: int, yes: bool, why: str) -> None:
        self._say(device, "This drive is free. Press a to arm it." if yes else why)
        session = self._session_of(device)
        if yes and session is not None and session.starts is not None:
            self._spawn(partial(self._adopt, session, session.starts), f"start of {device}")

    async def _adopt(self, session: DriveSession, starts: StartKeeper) -> None:
        """Record a motor that runs as this program's, so that it is stopped when this one ends."""
        state = session.state(STANDSTILL_SEEN_WITHIN)
        if state.motion in SURELY_STANDING:
            return
        order: Literal["forward", "reverse"] = (
            "reverse" if state.direction == "reverse" else "forward"
        )
        try:
            await asyncio.to_thread(starts.begin, session, order)
        except DriveError as error:
            self._events.add("failed", str(error), session.device)
            return
        starts.sent(session)

    def _spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> None:
        with suppress(LineClosed):
            self._line.spawn(work, name)

    # Requests by other programs

    def _requested(self, device: int, program: Program) -> None:
        """Handle the request of a program for a drive; in the line's thread."""
        if not self.person:
            self._decide(device, program)
            return
        request = DriveRequest(device, program, self._clock.monotonic() + REQUEST_ANSWERED_WITHIN)
        self.requests = MappingProxyType({**self.requests, device: request})
        self._say(device, f"This drive is requested by {program.text}. Press G to reply; without a"
                  " reply it stays here while its motor runs.")  # fmt: skip
        self._spawn(partial(self._expire, request), f"question about {device}")

    async def _expire(self, request: DriveRequest) -> None:
        await self._clock.sleep(REQUEST_ANSWERED_WITHIN)
        if self.requests.get(request.device) is request:
            self._forget(request.device)
            self._decide(request.device, request.program)

    def answer(self, request: DriveRequest, *, yes: bool) -> None:
        """Reply to a request for a person; report if it has expired in the meantime."""
        if self.requests.get(request.device) is request:
            self._forget(request.device)
            self._reply(request.device, request.program, yes=yes)
        elif yes:
            self._say(request.device, f"Not given: {request.program.text} requests it no longer.")

    def _decide(self, device: int, program: Program) -> None:
        """Decide without a person: no while the motor runs, or may run."""
        session = self._session_of(device)
        stands = (
            session is not None and session.state(STANDSTILL_SEEN_WITHIN).motion in SURELY_STANDING
        )
        self._reply(device, program, yes=stands)

    def _reply(self, device: int, program: Program, *, yes: bool) -> None:
        session = self._session_of(device)
        if yes and session is not None:
            session.arming.disarm(f"Given to {program.text}: no longer armed here.")
            starts = session.starts
            if starts is not None and starts.holds(device):
                work = partial(self._hand_over, session, starts, program)
                self._spawn(work, f"motor of {device} to {program.text}")
            else:
                session.note_given()
        self._line.facts.answer(device, program.id, yes=yes)
        self._say(device, f"Given to {program.text}." if yes else f"Not given to {program.text}.")

    async def _hand_over(
        self, session: DriveSession, starts: StartKeeper, program: Program
    ) -> None:
        """Keep the record of a motor until the other program has recorded it as its own.

        If that program ends before, this one must still stop the motor.
        """
        device, end = session.device, self._clock.monotonic() + TAKEN_WITHIN
        while starts.holds(device) and self._clock.monotonic() < end:
            if await asyncio.to_thread(starts.started_by, session, program.process):
                starts.give_away(session)
                session.note_given()
                return
            await self._clock.sleep(TAKEN_LOOK)
        if starts.holds(device):
            self._say(device, f"{program.text} has not taken the motor over. It stays this"
                      " program's to stop: press a to arm it.")  # fmt: skip

    def _forget(self, device: int) -> None:
        rest = {d: request for d, request in self.requests.items() if d != device}
        self.requests = MappingProxyType(rest)

    # Effects of other programs

    def _stopped(self, devices: tuple[int, ...], by: str, program: Program) -> None:
        for device in devices:
            if self._session_of(device) is not None:
                self._events.add("stop", f"Stop from {program.text} ({by}).", device)

    def _changed(self) -> None:
        """Report arrivals, departures, and commanders on the line."""
        facts = self._line.facts
        names = {other.id: other.text for other in facts.others}
        for id, text in names.items():
            if id not in self._names:
                self._say(None, f"The line is shared with {text}.")
        for id, text in self._names.items():
            if id not in names:
                self._say(None, f"The line is no longer shared with {text}.")
                self._void_questions_of(id)
        for device, id in facts.commanders.items():
            if id in names and self._commanders.get(device) != id:
                self._say(device, f"The commander of this drive is now {names[id]}.")
                self._is_anothers(self._session_of(device))
        self._names, self._commanders = names, facts.commanders

    def _void_questions_of(self, id: str) -> None:
        """Drop the requests of a program that has left the line."""
        for device, request in self.requests.items():
            if request.program.id == id:
                self._forget(device)

    def _is_anothers(self, session: DriveSession | None) -> None:
        """Note that another program commands a drive, unless this one must still stop its motor."""
        if session is not None and not (session.starts and session.starts.holds(session.device)):
            session.note_given()

    def _say(self, device: int | None, text: str) -> None:
        self._events.add("told", text, device)


SHARED_BY_SEVERAL = "The line is shared with other programs."
STOPPED_UNLESS = (
    f"The motor is stopped on its ramp within {LONGEST_GRACE:g} s, unless the line is opened here"
    " again."
)
STOPPED_UNLESS_TAKEN = (
    f"The motor is stopped on its ramp within {LONGEST_GRACE:g} s, unless it is taken over there,"
    " or the line is opened here again."
)
POLLED_BY_SEVERAL = "As long as other programs on the line poll this drive, the motor runs."


def peer_effect_text(session: DriveSession, *, on_purpose: bool) -> str:
    """Describe the effect of other programs on a motor that this one leaves; empty if none.

    `on_purpose` is True if it is recorded as left running. Otherwise the OrphanMotorGuard of the
    line's owner stops a motor that this program has started.
    """
    others, starts = session.line.facts.others, session.starts
    if not others:
        return ""
    alone = others[0].text if len(others) == 1 else ""
    if not on_purpose and starts is not None and starts.stopped_by_others(session.device):
        shared = f"The line is shared with {alone}." if alone else SHARED_BY_SEVERAL
        end = STOPPED_UNLESS_TAKEN if any(o.name == "panel" for o in others) else STOPPED_UNLESS
        return f"{shared} {end}"
    if session.device not in session.line.pace.others:
        return ""
    return f"As long as {alone} polls this drive, the motor runs." if alone else POLLED_BY_SEVERAL
