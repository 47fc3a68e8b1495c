"""The starts of one line on record: put there before the run frame, taken away at standstill."""

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
    """Facts about a drive that the record of its start needs."""

    device: int
    profile: Profile
    identity: DriveIdentity | None
    starts: StartKeeper | None
    timeout: Timeout | None
    line: ModbusLine
    guessed: bool

    @property
    def line_text(self) -> str:
        """The line as it was named."""
        ...

    @property
    def known_identity(self) -> DriveIdentity:
        """Identity of the drive, as far as it is known."""
        ...

    @property
    def commanded(self) -> bool:
        """True if this program has commanded it."""
        ...

    def note_command(self) -> None:
        """A command was sent from here."""
        ...


class StartKeeper:
    """Knows which motors this program has started, and which an earlier one left running.

    None of its methods but `begin`, `found` and `take_over` waits for the disk.
    """

    def __init__(
        self, program: str, starts: Starts | None = None, clock: Clock = REAL_CLOCK
    ) -> None:
        self._clock = clock
        self.unrecorded = False
        """True if a start that cannot be put on record is let through; a person's word."""
        self.left_running = False
        """True if what is started or taken over now is to go on when the program is gone."""
        self._program = program
        self._starts = starts or Starts(clock=clock)
        self._begun: dict[int, StartRecord] = {}
        self._sent: dict[int, float] = {}
        self._left: dict[int, StartRecord] = {}
        self._silent: frozenset[int] = frozenset()
        """Devices of which a program that lives, but is not on the line, has started the motor."""
        self._runs_on: frozenset[int] = frozenset()
        """Devices whose motor was started before the start that was begun last."""

    def begin(self, session: Startable, order: Literal["forward", "reverse"]) -> None:
        """Put a start on the disk. Raises StartNotRecorded."""
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
        """The run frame went out: a standstill seen from now on ends the record."""
        self._runs_on -= {session.device}
        self._sent = {**self._sent, session.device: self._clock.monotonic()}
        self._starts.sent(session.line_text, session.device)

    def standing(self, session: Startable, seen: float) -> None:
        """The motor was seen at rest at a time on the monotonic clock."""
        device = session.device
        if device in self._begun or device in self._left:
            self._left = {d: record for d, record in self._left.items() if d != device}
            if self._sent.get(device, math.inf) < seen:
                self._begun = {d: record for d, record in self._begun.items() if d != device}
            self._starts.end(session.line_text, device, seen)

    def withdraw(self, session: Startable) -> None:
        """A stop was given: what an earlier program started is no longer offered.

        The record of a start goes with the standstill, not with the stop: that may be lost.
        """
        self._left = {d: record for d, record in self._left.items() if d != session.device}

    def never_sent(self, session: Startable) -> None:
        """The start was refused before its run frame went out.

        A motor that was started before runs on: its standstill ends the record, not this.
        """
        if session.device in self._runs_on:
            self.sent(session)
        elif session.device in self._begun:
            self._begun = {d: record for d, record in self._begun.items() if d != session.device}
            self._starts.note_stop(session.line_text, session.device)

    def holds(self, device: int) -> bool:
        """Return True if a motor that was started here is not yet known to be at standstill."""
        return device in self._begun

    def stopped_by_others(self, device: int) -> bool:
        """Return True if a motor started here is not meant to go on where this program is gone."""
        record = self._begun.get(device)
        return record is not None and not record.left_running

    def started_by(self, session: Startable, process: ProcessKey) -> bool:
        """Return True if a program has the motor on record as its own; reads files."""
        return self._starts.is_on_record(session.line_text, session.device, process)

    def give_away(self, session: Startable) -> None:
        """Another program looks after the motor from now on."""
        if session.device in self._begun:
            self._begun = {d: record for d, record in self._begun.items() if d != session.device}
            self._starts.note_stop(session.line_text, session.device)

    # What an earlier program left

    def look(self, session: Startable) -> None:
        """Find what an earlier program has started of this drive; reads files.

        A motor that this very program has started stays its own: its line was closed since.
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
        """Describe a motor that an earlier program has started; empty if any commands it now.

        Not known if it `runs`: None.
        """
        record, facts = self._left_of(session), session.line.facts
        if record is None or session.commanded or facts.commander(session.device) is not None:
            return ""
        return offer(record, session.identity, runs, lives=session.device in self._silent)

    def _left_of(self, session: Startable) -> StartRecord | None:
        """The start that is offered; None once its program is back on the line."""
        record = self._left.get(session.device)
        if record is None or session.device not in self._silent:
            return record
        back = any(program.process == record.process for program in session.line.facts.programs)
        return None if back else record

    def take_over(self, session: Startable) -> None:
        """Put an earlier program's start on record as this program's. Raises StartNotRecorded."""
        record = self._left_of(session)
        if record is None:
            raise NothingToTakeOver("No start of an earlier program is known of this drive.")
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
        """Wait a moment for what is still to be written."""
        self._starts.close()


def pids_absent(facts: SharedState) -> frozenset[ProcessKey]:
    """The processes of programs that have left the line, frozen ones among them."""
    here = {program.process for program in facts.programs}
    return frozenset({program.process for program in facts.departed} - here)


class NothingToTakeOver(DriveError):
    """There is no motor that an earlier program has started."""


async def record_start(
    session: Startable, order: Literal["forward", "reverse"], permit: Permit
) -> None:
    """Put a start on record before its frame goes out, where starts are recorded.

    Raises StartNotRecorded, and Stopped where a stop came meanwhile.
    """
    if session.starts is not None:
        await asyncio.to_thread(session.starts.begin, session, order)
        try:
            permit.check()
        except OrderRefused:
            session.starts.never_sent(session)
            raise
