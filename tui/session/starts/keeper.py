"""Motor starts on one line: recorded before the run frame, removed at standstill."""

from __future__ import annotations

import asyncio
import logging
import math
from typing import TYPE_CHECKING, Literal, Protocol

from tui.drive.errors import DriveError
from tui.drive.orders import OrderRefused

from ..clock import REAL_CLOCK, Clock
from .record import StartNotRecorded, StartOvertaken, StartRecord, offer
from .starts import Starts

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine
    from tui.bus.program import ProcessKey
    from tui.bus.shared_state import SharedState
    from tui.drive.profile.profile import Profile

    from ..connect.identify import DriveIdentity
    from ..timeout_report import Timeout
    from ..work import Permit

log = logging.getLogger(__name__)


class Startable(Protocol):
    """The part of a DriveSession that the record of a start needs."""

    device: int
    profile: Profile
    identity: DriveIdentity | None
    starts: StartKeeper | None
    timeout: Timeout | None
    line: ModbusLine
    guessed: bool

    @property
    def line_text(self) -> str:
        """The line as a person types it."""
        ...

    @property
    def known_identity(self) -> DriveIdentity:
        """Identity that the drive reports; with empty fields if it reports none."""
        ...

    @property
    def commanded(self) -> bool:
        """True if this program has sent the drive a command."""
        ...

    def note_command(self) -> None:
        """Remember that this program has sent a command now."""
        ...


class StartKeeper:
    """Motors on one line that this program has started, or that an earlier one left running.

    Only `begin`, `look`, `started_by`, `take_over` and `leave` wait for the disk.
    """

    def __init__(
        self, program: str, starts: Starts | None = None, clock: Clock = REAL_CLOCK
    ) -> None:
        self._clock = clock
        self.unrecorded = False
        """True if a person allows starts that cannot be recorded."""
        self.left_running = False
        """True if motors that are started now must keep running when the program has ended."""
        self._program = program
        self._starts = starts or Starts(clock=clock)
        self._begun: dict[int, StartRecord] = {}
        self._sent: dict[int, float] = {}
        self._left: dict[int, StartRecord] = {}
        self._silent: frozenset[int] = frozenset()
        """Devices whose motor was started by a living program that is not on the line."""
        self._runs_on: frozenset[int] = frozenset()
        """Devices whose motor was already started when the last start began."""

    def begin(self, session: Startable, order: Literal["forward", "reverse"]) -> None:
        """Write a start to the disk and wait for it. Raises StartNotRecorded."""
        watch = session.timeout.watch if session.timeout is not None else None
        record = self._starts.record(
            session.line_text,
            session.known_identity,
            session.profile.id,
            order,
            program=self._program,
            left_running=self.left_running,
            guessed=session.guessed,
            acts_after=watch.timeout if watch is not None else None,
        )
        self._put(session, record)

    def _put(self, session: Startable, record: StartRecord) -> None:
        try:
            self._starts.begin(record)
        except StartOvertaken:
            raise
        except StartNotRecorded as error:
            if not self.unrecorded:
                raise
            log.warning("%s", error)
        if session.device in self._begun and self._sent.get(session.device, math.inf) < math.inf:
            self._runs_on |= {session.device}
        self._sent = {**self._sent, session.device: math.inf}
        self._begun = {**self._begun, session.device: record}

    def sent(self, session: Startable) -> None:
        """Let a standstill that is seen from now on end the record: its run frame was sent."""
        self._runs_on -= {session.device}
        self._sent = {**self._sent, session.device: self._clock.monotonic()}
        self._starts.sent(session.line_text, session.device)

    def standing(self, session: Startable, seen: float) -> None:
        """Remove the record of a motor that was seen at standstill at a time (monotonic)."""
        device = session.device
        if device in self._begun or device in self._left:
            self._left = {d: record for d, record in self._left.items() if d != device}
            if self._sent.get(device, math.inf) < seen:
                self._begun = {d: record for d, record in self._begun.items() if d != device}
            self._starts.end(session.line_text, device, seen)

    def withdraw(self, session: Startable) -> None:
        """Offer the motor of an earlier program no longer, because it was given a stop.

        The record is removed at standstill, not at the stop, because a stop may be lost.
        """
        self._left = {d: record for d, record in self._left.items() if d != session.device}

    def never_sent(self, session: Startable) -> None:
        """Remove the record of a start whose run frame was never sent.

        A motor that was started before keeps its record until standstill.
        """
        if session.device in self._runs_on:
            self.sent(session)
        elif session.device in self._begun:
            self._begun = {d: record for d, record in self._begun.items() if d != session.device}
            self._starts.note_stop(session.line_text, session.device)

    def holds(self, device: int) -> bool:
        """Return True if a motor that this program has started may still run."""
        return device in self._begun

    def stopped_by_others(self, device: int) -> bool:
        """Return True if other programs stop the motor when this program has ended."""
        record = self._begun.get(device)
        return record is not None and not record.left_running

    def started_by(self, session: Startable, process: ProcessKey) -> bool:
        """Return True if a process has recorded the motor as its own. Reads files."""
        return self._starts.is_on_record(session.line_text, session.device, process)

    def give_away(self, session: Startable) -> None:
        """Remove the record of a motor that another program has taken over."""
        if session.device in self._begun:
            self._begun = {d: record for d, record in self._begun.items() if d != session.device}
            self._starts.note_stop(session.line_text, session.device)

    # Motors that an earlier program left running

    def look(self, session: Startable) -> None:
        """Find the start of this drive by an earlier program. Reads files.

        A motor that this program has started, before it closed the line, stays its own.
        """
        if session.device not in self._begun and (
            own := self._starts.own(session.line_text, session.device)
        ):
            self._begun = {**self._begun, session.device: own}
            self._sent = {**self._sent, session.device: self._clock.monotonic()}
            session.note_command()
        absent = pids_absent(session.line.facts)
        found = self._starts.found(session.line_text, session.device, absent)
        if found is not None:
            lives = {session.device} if self._starts.is_alive(found) else set()
            self._silent = self._silent - {session.device} | lives
            self._left = {**self._left, session.device: found}

    def offered(self, session: Startable, *, runs: bool | None) -> str:
        """Describe the motor of an earlier program; empty if a program commands it now.

        `runs` is None if its state is not known.
        """
        record, facts = self._left_of(session), session.line.facts
        if record is None or session.commanded or facts.commander(session.device) is not None:
            return ""
        return offer(record, session.identity, runs, lives=session.device in self._silent)

    def _left_of(self, session: Startable) -> StartRecord | None:
        """Return the start that can be taken over; None once its program is back on the line."""
        record = self._left.get(session.device)
        if record is None or session.device not in self._silent:
            return record
        back = any(program.process == record.process for program in session.line.facts.programs)
        return None if back else record

    def take_over(self, session: Startable) -> None:
        """Record the start of an earlier program as this program's. Raises StartNotRecorded."""
        record = self._left_of(session)
        if record is None:
            raise NothingToTakeOver(
                f"Nothing to take over: no earlier program started drive {session.device}."
            )
        mine = self._starts.taken_over(
            record, session.line_text, program=self._program, left_running=self.left_running
        )
        self._put(session, mine)
        self.sent(session)
        self._left = {d: item for d, item in self._left.items() if d != session.device}

    def leave(self, session: Startable) -> None:
        """Note that a motor is left running on purpose. Raises StartNotRecorded."""
        if session.device in self._begun:
            self.left_running = True
            self.begin(session, self._begun[session.device].order)
            self.sent(session)

    def close(self) -> None:
        """Wait a moment for the disk work."""
        self._starts.close()


def pids_absent(facts: SharedState) -> frozenset[ProcessKey]:
    """Return the processes of programs that have left the line, including frozen ones."""
    here = {program.process for program in facts.programs}
    return frozenset({program.process for program in facts.departed} - here)


class NothingToTakeOver(DriveError):
    """There is no motor of an earlier program to take over."""


async def record_start(
    session: Startable, order: Literal["forward", "reverse"], permit: Permit
) -> None:
    """Record a start before its frame is sent, if this program records starts.

    Raises StartNotRecorded, and Stopped if a stop came in the meantime.
    """
    if session.starts is not None:
        await asyncio.to_thread(session.starts.begin, session, order)
        try:
            permit.check()
        except OrderRefused:
            session.starts.never_sent(session)
            raise
