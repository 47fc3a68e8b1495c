"""Drives of an open line: those that were found, their consoles, and stops of all.

Everything may be read from any thread: a mapping is replaced as a whole, never changed.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

from tui.bus.api import ModbusLine
from tui.bus.errors import LineClosed
from tui.bus.line_events import LineEvent, ProgramsChanged
from tui.drive.profile import library
from tui.drive.profile.schema import OrderId

from .clock import REAL_CLOCK, Clock
from .command.access import HalfSent
from .command.stop import Stopper
from .connect.identify import DriveIdentity
from .connect.search import Search
from .console import DriveConsole
from .drive import DriveSession, prepared_stop, replaced_by
from .event_notes import EventNotes
from .events import EventLog
from .journal import FAULT_WHYS, Entry, Journal, entry_time
from .monitor.alarms import LineAlarms, PresentFault
from .monitor.line_health import LineHealth
from .monitor.line_watch import LineWatch
from .monitor.snapshot import Snapshot
from .monitor.unknown_drive_poller import UnknownDrivePoller
from .sharing.handover import Handover
from .sharing.stop_others import request_stops_of_others
from .starts.keeper import StartKeeper
from .work import Outcome, OutcomeKind

log = logging.getLogger(__name__)

PROGRAM_ENDS_WITHIN = 0.3
"""Seconds after which the process of a program that has left the line no longer exists."""

SCAN_AGAIN = "Its values may be wrong, and it is not armed. Press s on Line to scan again."
HALF_SENT = "Drive Panel, after half of a command"
"""Source of a stop after a command of several words that ended before its last one."""

Stamp = Mapping[int, int]
"""The stop count of each drive at the moment when something was typed."""


@dataclass(frozen=True, slots=True)
class FoundDrive:
    """A drive that answered, with its reported identity and its assumed family."""

    identity: DriveIdentity
    console: DriveConsole | None = None

    @property
    def guessed(self) -> bool:
        """True if several profiles may fit, and no person has named one."""
        return self.session is not None and self.session.guessed

    @property
    def session(self) -> DriveSession | None:
        """The session with it; None while its profile is not known."""
        return self.console.session if self.console else None


class Fleet:
    """The drives of one line, with their consoles, alarms, messages and stops."""

    def __init__(
        self,
        line: ModbusLine,
        journal: Journal,
        starts: StartKeeper | None = None,
        events: EventLog | None = None,
        clock: Clock = REAL_CLOCK,
    ) -> None:
        # first of all: a line that is shared tells at once who commands what
        self._lock = threading.Lock()
        self._found: Mapping[int, FoundDrive] = MappingProxyType({})
        self.line = line
        self.clock = clock
        """Clock of the sessions with its drives."""
        self.journal = journal
        self.starts = starts
        """Records of motor starts; None if they are not kept."""
        self.line_watch = LineWatch(line)
        self.line_watch.on_identified = self._note_identity
        self._strangers = UnknownDrivePoller(line)
        self.health = LineHealth()
        self.events = events or EventLog(clock.wall)
        """Messages about the drives."""
        self.event_notes = EventNotes(line.facts, self.events)
        self.stopper = Stopper(line, journal, self.events)
        self.alarms = LineAlarms(self.events, self._record_fault)
        """The faults of all of them."""
        self.handover = Handover(line, self.events, self._session_of, clock)
        """Decides which of two programs commands a drive."""
        self._departed = line.facts.departed
        line.facts.events.subscribe(self._look_for_left)
        self.search: Search | None = None
        """The search for drives in progress, or the last one."""

    @property
    def found(self) -> Mapping[int, FoundDrive]:
        """Every drive that answered, by device, in the order of the devices."""
        return self._found

    @property
    def consoles(self) -> list[DriveConsole]:
        """The drives whose profile is known, in the order of the devices."""
        return [drive.console for drive in self._found.values() if drive.console is not None]

    @property
    def sessions(self) -> list[DriveSession]:
        """Sessions of the drives whose profile is known."""
        return [console.session for console in self.consoles]

    def console(self, device: int) -> DriveConsole | None:
        """The drive at an address, or None."""
        found = self._found.get(device)
        return found.console if found else None

    def note(self, identity: DriveIdentity) -> None:
        """Add a drive that answered, without a profile yet, and keep it polled.

        A known drive stays unchanged: without its session no key would stop it.
        """
        before = self.console(identity.device)
        if before is not None and before.session.known_identity == identity:
            return
        self._put(FoundDrive(identity))
        self._strangers.keep(identity.device)

    def take(
        self, session: DriveSession, identity: DriveIdentity | None = None, *, guessed: bool = False
    ) -> DriveConsole:
        """Add a drive with its profile.

        A known drive stays unchanged, with its commands and staged edits. So does one whose motor
        may run by a command of this program, even if its profile is another one now.
        """
        before = self.console(session.device)
        if before is not None and _same(before.session, session):
            before.session.guessed = guessed
            self._put(FoundDrive(identity or session.known_identity, before))
            return before
        if before is not None and self._runs_as_it_is(before.session, session):
            return before
        session.guessed = guessed
        session.starts = self.starts
        session.work.on_report = partial(self._note_outcome, session)
        session.byte_order.on_swapped = partial(self.events.add, "failed", device=session.device)
        console = DriveConsole(session, self.journal)
        stated = identity or session.known_identity
        self._put(FoundDrive(stated, console))
        if before is not None:
            before.close()
        self._strangers.let_go(session.device)
        self.line_watch.keep(session, console.monitor)
        console.monitor.listen(partial(self._note_fault, session.device))
        # reads files: in a thread that nobody waits for
        threading.Thread(
            target=self._recall, args=(console,), name="last start", daemon=True
        ).start()
        if self.search is not None and self.search.is_stopping:
            with suppress(LineClosed):
                self.stop([session])
        return console

    def _note_identity(self, session: DriveSession, identity: DriveIdentity) -> None:
        """Take the identity of a drive that was gone; report another one. Reads files."""
        console, text = self.console(session.device), replaced_by(session, identity)
        if not text or console is None or console.session is not session:
            return
        self._put(FoundDrive(identity, console))
        self._recall(console)  # a stop is prepared for its own family
        self.events.add("failed", f"{text} {SCAN_AGAIN}", session.device)

    def _runs_as_it_is(self, before: DriveSession, session: DriveSession) -> bool:
        """Return True if a drive gets another family while its motor may run, and report that."""
        runs = any(item is before for item in self.line_watch.under_command())
        if not runs or before.known_identity != session.known_identity:
            return False
        names = before.profile.name, session.profile.name
        reported = (
            f"It runs by a command of this panel: it stays {names[0]}."
            f" Stop it, then name {names[1]}."
        )
        self.events.add("refused", reported, session.device)
        return True

    def _recall(self, console: DriveConsole) -> None:
        """Load what earlier programs have left: a running motor, learned scales.

        If the drive may be of another family, a stop for that is prepared too.
        """
        session, stated = console.session, console.session.known_identity
        if session.guessed or session.contradiction:
            may_be = [stated.profile] if stated.profile else stated.candidates
            others = [library.load(text) for text in may_be if text != session.profile.id]
            families = [session.profile, *others]
            session.prepared = prepared_stop(self.line, session.device, families)
        if self.starts is not None:
            self.starts.look(console.session)
        console.teacher.recall()
        if console.teacher.trouble:
            self.events.add("failed", console.teacher.trouble, console.device)

    def _session_of(self, device: int) -> DriveSession | None:
        console = self.console(device)
        return console.session if console is not None else None

    def _look_for_left(self, event: LineEvent) -> None:
        """Look for motors of programs that have left the line. Reads files."""
        if not isinstance(event, ProgramsChanged):
            return
        before, self._departed = self._departed, self.line.facts.departed
        if self.starts is None or set(self._departed) <= set(before):
            return
        with suppress(LineClosed):
            self.line.spawn(partial(self._find_left, self.starts), "motors left running")

    async def _find_left(self, starts: StartKeeper) -> None:
        await self.clock.sleep(PROGRAM_ENDS_WITHIN)
        for session in self.sessions:
            await asyncio.to_thread(starts.look, session)

    def _note_outcome(self, session: DriveSession, outcome: Outcome) -> None:
        """Report the result of work; after half of a command, see the motor to its standstill."""
        if outcome.kind is not OutcomeKind.WORKING:
            self.events.add(outcome.kind, outcome.text, session.device)
        if isinstance(outcome.error, HalfSent) and outcome.error.needs_stop:
            with suppress(LineClosed):
                self.stopper.stop([session], by=HALF_SENT, quiet=True)

    def _note_fault(self, device: int, latest: Snapshot) -> None:
        """Keep when a drive went into its fault; called in the line's thread."""
        if not latest.error:
            self.line_watch.onsets.note(device, latest.state, latest.wall)

    def _record_fault(self, fault: PresentFault, what: str) -> None:
        """Record a trip, a fault that was present at the first read, or its end in the journal."""
        console = self.console(fault.device)
        if console is None:
            return
        session = console.session
        codes = session.profile.data.faults.codes
        raw = next((code.raw for code in codes if code.code == fault.code), 0)
        when = entry_time(None if what == "reset" else fault.wall)
        self.journal.add(
            Entry(
                when, session.line_text, session.device, session.profile.id, fault.code,
                0, None, "", raw, fault.name, what, None, FAULT_WHYS[what], kind="fault",
            )
        )  # fmt: skip

    def _put(self, drive: FoundDrive) -> None:
        with self._lock:
            drives = {**self._found, drive.identity.device: drive}
            self._found = MappingProxyType(dict(sorted(drives.items())))

    def forget(self) -> None:
        """Close every drive; the line stays open."""
        with self._lock:
            before, self._found = self._found, MappingProxyType({})
        self.line_watch.stop()
        self._strangers.stop()
        for drive in before.values():
            if drive.console is not None:
                drive.console.close()

    def stop(
        self,
        sessions: Iterable[DriveSession],
        order: OrderId = "stop",
        by: str = "the stop key",
    ) -> None:
        """Stop drives; for any thread. Raises LineClosed."""
        self.stopper.stop(sessions, order, by)

    def stop_others(self) -> tuple[int, ...]:
        """Stop the drives that other programs on the line command, except those in this fleet.

        Return their addresses. For any thread; returns at once.
        """
        own = {session.device for session in self.sessions}
        return request_stops_of_others(self.line, own, "the stop key", self.events.add)

    def last_stop(self, error: Exception, only: DriveConsole | None = None) -> None:
        """Stop every drive, or only one, by its prepared frames after an internal error.

        It uses no code of `stop`. For any thread.
        """
        for drive in tuple(self._found.values()):
            console = drive.console
            if console is None or only not in (None, console):
                continue
            try:
                self.stopper.send_prepared(console.session, error)
            except Exception:
                log.exception("the last stop of device %s", console.device)

    @property
    def strangers(self) -> list[int]:
        """Devices that answered, but that no stop reaches, because their stop word is not known."""
        return [device for device, drive in self._found.items() if drive.console is None]

    def left_behind(self, console: DriveConsole) -> str:
        """Describe a motor whose program has exited and that no program commands; empty if none."""
        device, starts = console.device, self.starts
        seen = console.latest is not None or device in self.line_watch.looks
        if starts is None or not seen:
            return ""
        return starts.offered(console.session, runs=self.line_watch.turns(device))

    @property
    def stamp(self) -> Stamp:
        """Return the current stop count of every drive."""
        return {session.device: session.work.stops for session in self.sessions}

    @property
    def commanded(self) -> list[DriveSession]:
        """Return the drives that this program has commanded."""
        return [session for session in self.sessions if session.commanded]


def _same(session: DriveSession, other: DriveSession) -> bool:
    """Return True if two sessions are of one drive, by the identity that it reports."""
    return session.profile.id == other.profile.id and session.known_identity == other.known_identity
