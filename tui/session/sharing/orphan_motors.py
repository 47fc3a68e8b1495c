"""Stops the motors of programs that have ended; runs in the program that owns the line.

The records of starts show which motors they are. Other programs keep polling the drive, so its own
communication timeout would not stop a motor whose commander has died.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable, Coroutine
from contextlib import suppress
from functools import partial
from typing import Any

from tui.bus.api import LineStatus, LineWorker, ModbusLine
from tui.bus.errors import LineClosed
from tui.bus.line_events import LineEvent, ProgramLost, StopDue
from tui.bus.link import label
from tui.bus.program import Program
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.safety import LINE_BACK_WITHIN, LONGEST_GRACE, SILENT_CLIENT, TAKEN_OVER_WITHIN

from ..clock import REAL_CLOCK, Clock
from ..command.stop import Stopper
from ..command.stop_report import Phase, message_text
from ..connect.line_key import line_key
from ..drive import DriveSession
from ..events import EventLog
from ..journal import Journal
from ..starts.keeper import pids_absent
from ..starts.record import StartRecord
from ..starts.starts import Starts
from .care import DrivesInCare

log = logging.getLogger(__name__)

EXITED, ABSENT = "has exited", "is no longer on the line"
"""States of a program that has ended, and of one that lives: frozen, or detached."""
LINE_STAYS_LOST = "NOT STOPPED: the line is still lost. Stop the motor at the machine."
ENDS_WITHIN = 0.5
"""Seconds in which a program that ends disappears from the list of processes."""
LOOK_INTERVAL = 0.05


class OrphanMotorGuard:
    """Stops motors on one line whose program has ended, and carries out stops without a program."""

    def __init__(
        self,
        line: ModbusLine,
        journal: Journal,
        *,
        clock: Clock = REAL_CLOCK,
        session_of: Callable[[int], DriveSession | None] = lambda _: None,
        events: EventLog | None = None,
        starts: Starts | None = None,
    ) -> None:
        self._line = line
        self._clock = clock
        self._session_of = session_of
        self._starts = starts or Starts()
        self._stopper = Stopper(line, journal, events)
        self._key = line_key(label(line.link))
        """The line by the name of its adapter, kept while that is unplugged."""
        self._care = DrivesInCare(line, journal, session_of)
        self._lost: dict[int, float] = {}
        """By device, when the line was first lost during its stop (monotonic)."""
        self._followed: set[int] = set()
        """Devices whose stop for other programs is followed to standstill."""
        self._workers: list[LineWorker] = []
        self._changing = threading.Lock()
        self._unsubscribe = line.facts.events.subscribe(self._hear)

    @property
    def busy(self) -> bool:
        """True until all motors of programs that have ended are stopped or taken over."""
        with self._changing:
            self._workers = [worker for worker in self._workers if not worker.done()]
            return bool(self._workers)

    def close(self) -> None:
        """End the subscriptions; wait a moment for records that are being removed."""
        self._unsubscribe()
        self._care.close()
        self._starts.close()

    def _hear(self, event: LineEvent) -> None:
        match event:
            case ProgramLost(program):
                self._spawn(partial(self._look_after, program), f"motors of {program.text}")
            case StopDue(devices, by):
                self._spawn(partial(self._stop, devices, by), f"stop for {by}")

    def _spawn(self, work: Callable[[], Coroutine[Any, Any, None]], name: str) -> None:
        with suppress(LineClosed), self._changing:
            self._workers.append(self._line.spawn(work, name))

    async def _look_after(self, program: Program) -> None:
        """Stop each motor that a program has started, unless a person takes it over in time."""
        left = self._clock.monotonic()
        records = await self._left_by(program)
        if not records:
            return
        takers = any(item.name == "panel" for item in self._line.facts.programs)
        await asyncio.gather(
            *(
                self._stop_unless_taken(record, program, takers=takers, left=left)
                for record in records
            )
        )

    async def _stop_unless_taken(
        self, record: StartRecord, program: Program, *, takers: bool, left: float
    ) -> None:
        """Stop a motor, unless a panel takes it over within the drive's timeout.

        `takers` is True if there is a panel. Then a frozen program may also return in that time.
        """
        device, frozen = record.device, self._starts.is_alive(record)
        grace = min(record.acts_after or TAKEN_OVER_WITHIN, LONGEST_GRACE)
        # a frozen program had sent nothing for a while before it was disconnected
        begun = left - SILENT_CLIENT if frozen else self._clock.monotonic()
        end = begun + grace if takers else begun
        self._announce(device, program, end, frozen=frozen, takers=takers)
        while self._clock.monotonic() < end:
            if frozen and self._is_back(program):
                self._tell(device, f"{program.text} is back: its motor keeps running.")
                return
            if not await self._is_left(device, program):
                self._tell(device, f"The motor that {program.text} started was taken over.")
                return
            await self._clock.sleep(LOOK_INTERVAL)
        session, why = await self._session(record), ABSENT if frozen else EXITED
        while session is not None and await self._is_left(device, program):
            self._stopper.stop([session], by=f"{program.text} {why}")
            if not await self._ended_by_loss(session):
                return
            if frozen and self._is_back(program):
                self._tell(device, f"{program.text} is back: its motor keeps running.")
                return

    async def _stop(self, devices: tuple[int, ...], by: str) -> None:
        """Carry out a stop that all programs already know of.

        Only drives that a program has armed are stopped, and motors that were started by a
        program which has left the line: if it is frozen, it does not arm them again for the next
        holder of the line. An older record is not enough: its stop word might start a drive of
        another family at the same address.
        """
        sessions = list(filter(None, map(self._known, devices)))
        if unknown := set(devices) - {session.device for session in sessions}:
            found = await asyncio.to_thread(started_by_absent, self._line, self._starts)
            records = [record for record in found if record.device in unknown]
            sessions += filter(None, [await self._session(record) for record in records])
            if unknown := unknown - {record.device for record in records}:
                log.warning(
                    "drives %s are not stopped for %s: no program has armed them",
                    sorted(unknown), by,
                )  # fmt: skip
        if sessions:
            self._stopper.stop(sessions, by=by, given=True)
        new = [session for session in sessions if session.device not in self._followed]
        self._followed |= {session.device for session in new}
        await asyncio.gather(*(self._follow(session, by) for session in new))

    async def _follow(self, session: DriveSession, by: str) -> None:
        """Follow a stop to its end, and repeat it after each loss of the line."""
        try:
            while await self._ended_by_loss(session):
                self._stopper.stop([session], by=by, given=True)
        finally:
            self._followed.discard(session.device)

    async def _ended_by_loss(self, session: DriveSession) -> bool:
        """Wait for the end of a stop; return True if the line was lost, and is connected again.

        The motor was not seen at standstill then, so it must be stopped once more.
        """
        await self._until_ended(session)
        if self._is_connected():
            self._lost.pop(session.device, None)
            return False
        lost = self._lost.setdefault(session.device, self._clock.monotonic())
        while not self._is_connected():
            if self._clock.monotonic() - lost > LINE_BACK_WITHIN:
                self._lost.pop(session.device, None)
                self._tell(session.device, LINE_STAYS_LOST)
                return False
            await self._clock.sleep(LOOK_INTERVAL)
        return True

    def _is_connected(self) -> bool:
        return self._line.state.status is LineStatus.CONNECTED

    def _announce(
        self, device: int, program: Program, end: float, *, frozen: bool, takers: bool
    ) -> None:
        state = f"{program.text} {ABSENT if frozen else EXITED}"
        seconds = max(0.0, end - self._clock.monotonic())
        if not takers or not seconds:
            self._tell(device, f"{state}: its motor is stopped.")
            return
        # one line of 80 columns shows the first words of a message
        back = " If it comes back, the motor keeps running." if frozen else ""
        self._tell(
            device,
            f"The motor is stopped in {seconds:.2g} s, unless you take it over (a, then T):"
            f" {state}.{back}",
        )

    def _is_back(self, program: Program) -> bool:
        return any(item.process == program.process for item in self._line.facts.programs)

    async def _is_left(self, device: int, program: Program) -> bool:
        """Return True if no other living program has recorded the motor's start."""
        found = await asyncio.to_thread(self._found, program)
        return any(record.device == device for record in found)

    async def _left_by(self, program: Program) -> list[StartRecord]:
        """Return the starts by a program, except motors left running on purpose.

        A program that has not ended after a while is frozen, or has closed the line. Empty if it
        is back on the line.
        """
        end = self._clock.monotonic() + ENDS_WITHIN
        while True:
            found = await asyncio.to_thread(self._found, program)
            mine = [
                record
                for record in found
                if self._is_of(record, program) and not record.left_running
            ]
            late = self._clock.monotonic() > end
            if late and self._is_back(program):
                return []
            if not any(self._starts.is_alive(record) for record in mine) or late:
                return mine
            await self._clock.sleep(LOOK_INTERVAL)

    def _is_of(self, record: StartRecord, program: Program) -> bool:
        """Return True for a start by a program; a PID from before a reboot does not count."""
        same = record.process == program.process
        return same and self._starts.processes.is_same_boot(record.boot_id)

    def _found(self, program: Program) -> list[StartRecord]:
        absent = pids_absent(self._line.facts) | {program.process}
        text = label(self._line.link)
        if self._is_connected():
            self._key = line_key(text)
        # an adapter that is unplugged is found only by the name that it had
        return self._starts.all_found(text, absent) or self._starts.all_found(self._key, absent)

    async def _until_ended(self, session: DriveSession) -> None:
        """Wait for the end of a stop; remove the record if the motor is at standstill."""
        device = session.device
        while True:
            await self._clock.sleep(LOOK_INTERVAL)
            report = self._stopper.reports[device]
            if report.phase is Phase.STOPPED:
                self._starts.end(session.line_text, device)
            if report.phase in (Phase.STOPPED, Phase.FAILED):
                self._tell(device, message_text(report.phase, report.text))
                return

    def _tell(self, device: int, text: str) -> None:
        """Show a text in every program on the line."""
        self._line.facts.tell_all(device, text)

    def _known(self, device: int) -> DriveSession | None:
        """Return the session of a drive that this program has open, or another one has armed."""
        return self._session_of(device) or self._care.session(device)

    async def _session(self, record: StartRecord) -> DriveSession | None:
        session = self._known(record.device)
        if session is not None:
            return session
        try:
            profile = await asyncio.to_thread(library.load, record.profile)
        except DriveError as error:
            log.error("drive %s cannot be stopped: %s", record.device, error)
            self._tell(record.device, f"Not stopped: {error} Stop it at the machine.")
            return None
        session = DriveSession(self._line, record.device, profile)
        session.guessed = record.guessed
        return session


def started_by_absent(line: ModbusLine, starts: Starts) -> list[StartRecord]:
    """Return the starts by programs that have left the line, dead or frozen. Reads files."""
    absent = pids_absent(line.facts)
    found = starts.all_found(label(line.link), absent)
    return [record for record in found if record.process in absent]
