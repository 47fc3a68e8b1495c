"""The drives whose values are published: found, read cycle by cycle, found again after a loss."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from tui.bus.api import Contact, Priority, contact_of
from tui.bus.errors import DeviceException, LineError
from tui.session.monitor.rates import monitoring_codes

from ..shared.cycles import Cycles
from ..shared.errors import failure_of
from ..shared.options import Target, connect_drive
from ..shared.say import say
from .status import DriveStatus, LineReport, drive_status_of

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.monitor.snapshot import Snapshot

log = logging.getLogger(__name__)

FIRST_LOOK_WITHIN = 15.0
"""Most seconds until the drives that were found are read."""
FIND_AGAIN = 3.0
"""Seconds between two searches for missing drives, one after the other on each line."""
SILENT_FOR_LONG = 60.0
"""Seconds without a good cycle after which the drive is identified again."""
PLANT_LOOK_INTERVAL = 2.0
RATE_LOOK_INTERVAL = 10.0
"""Seconds between two checks of the cycle time of a line."""
_LINE_FULL = "{name}: the line is full. A cycle takes up to {slowest:.1f} s."
_CYCLE_KEPT = "{name}: the cycle time is as requested again."
TIMEOUT_READ_AGAIN = 20.0
"""Seconds after which a drive's communication timeout is read again."""

GATEWAY = "serve"
"""Name of a program on a line whose clients may start motors."""

Sign = Callable[[int], float | None]
"""Time of the last request of the client that started the motor of a device; None if unknown."""


def no_sign(_device: int) -> float | None:
    """Return None: no client is known to have started a motor."""
    return None


@dataclass(frozen=True, slots=True)
class PlantLine:
    """A line with the drives on it that are read for the plant."""

    name: str
    opened: OpenLine
    drives: tuple[PlantDrive, ...]

    def sight(self, now: float) -> LineReport:
        """Return the state of the line; `now` is on the monotonic clock."""
        line = self.opened.line
        drives = tuple(drive.sight(now) for drive in self.drives)
        return LineReport(self.name, self.opened.text, line.state, line.counters, drives)

    async def run(self) -> None:
        """Read the drives until this is canceled.

        All drives are searched for before any is read: on a line full of polls, the search takes
        far longer.
        """
        search = DriveSearch()
        async with asyncio.TaskGroup() as tasks:
            for drive in self.drives:
                tasks.create_task(drive.run(search), name=f"plant {drive.device}")
            with suppress(TimeoutError):
                async with asyncio.timeout(FIRST_LOOK_WITHIN):
                    await self._first_looks()
            search.begin.set()
            await self._first_looks()
            search.retry.set()
            await self.report_rate()

    async def report_rate(self) -> None:
        """Report when the cycle time of --every is exceeded, and when it is met again."""
        full = False
        while True:
            await asyncio.sleep(RATE_LOOK_INTERVAL)
            cycles = [drive.cycle for drive in self.drives if drive.cycle is not None]
            slowest = max((cycle.period for cycle in cycles if not cycle.error), default=0.0)
            if full != any(cycle.too_slow for cycle in cycles if not cycle.error):
                full = not full
                text = _LINE_FULL if full else _CYCLE_KEPT
                say(f"drivepanel: {text.format(name=self.name, slowest=slowest)}", err=True)

    async def _first_looks(self) -> None:
        for drive in self.drives:
            await drive.looked_for.wait()


class DriveSearch:
    """Searches for the drives of one line, one at a time."""

    def __init__(self) -> None:
        self.turn = asyncio.Lock()
        self.begin = asyncio.Event()
        """Set once the drives that were found are read."""
        self.retry = asyncio.Event()
        """Set once each drive was searched for; missing drives may then be searched for again."""


class PlantDrive:
    """One drive, also while it is not found; for one loop."""

    def __init__(
        self,
        opened: OpenLine,
        target: Target,
        codes: Sequence[str],
        every: float,
        changed: Callable[[], None],
        sign: Sign = no_sign,
    ) -> None:
        self.device = target.device
        self._opened = opened
        self._target = target
        self._codes = codes
        self._every = every
        self._changed = changed
        self._sign = sign
        self.looked_for = asyncio.Event()
        """Set after its identity was requested, with any result."""
        self._session: DriveSession | None = None
        self.cycle: Snapshot | None = None
        self._error = f"Device {self.device} was not polled yet."
        self._contact: Contact = "not_polled"
        self._good = 0.0

    def sight(self, now: float) -> DriveStatus:
        """Return the state of the drive; `now` is on the monotonic clock."""
        if self.cycle is None:
            return DriveStatus(self.device, self._session, None, self._error, self._contact)
        return drive_status_of(self.device, self._session, self.cycle, now)

    async def run(self, search: DriveSearch) -> None:
        """Find the drive, read it until it is lost, and repeat; ends only if it is canceled."""
        while True:
            session = await self._found(search)
            await search.begin.wait()
            if self._session is None or session.profile.id != self._session.profile.id:
                self.cycle = None
            self._session = session
            await self._read(session)

    # Identification

    async def _found(self, search: DriveSearch) -> DriveSession:
        while True:
            async with search.turn:
                if self.looked_for.is_set():
                    await asyncio.sleep(FIND_AGAIN)
                session = await self._requested()
                self.looked_for.set()
                if session is not None:
                    return session
            await search.retry.wait()

    async def _requested(self) -> DriveSession | None:
        """Return the drive; None if it is not found, and report the reason when it changes."""
        if self._sign(self.device) is not None:
            # not identified before: never keep a motor alive whose client may have exited
            self._error = f"Device {self.device} was not identified: a client runs its motor."
            return None
        try:
            await self._answers()
            session = await connect_drive(self._opened, self._target)
        except Exception as error:
            self._contact = contact_of(error)
            self._tell(failure_of(error).message)
            return None
        self._contact = "not_polled"  # it answered, and no cycle was read yet
        if self._codes:
            try:
                self._shown(session)
            except Exception as error:
                self._tell(failure_of(error).message)
                return None
        self._tell("")
        return session

    async def _answers(self) -> None:
        """Send one request with a short timeout, because others use the line. Raises NoAnswer."""
        from tui.drive.profile import library
        from tui.session.connect.contradiction import read_status
        from tui.session.connect.identify import identify_drive

        line, named = self._opened.line, self._target.profile_id
        with suppress(DeviceException):
            # a read of the status word gets a reply even if function 43 gets none
            if named is None or not await read_status(
                line, self.device, library.load(named), Priority.BACKGROUND
            ):
                await identify_drive(line, self.device, priority=Priority.BACKGROUND)

    def _tell(self, error: str) -> None:
        if error and error != self._error:
            who = "" if error.startswith(f"Device {self.device}") else f"Device {self.device}: "
            say(f"drivepanel: {who}{error} Retrying.", err=True)
        self._error = error
        self._changed()

    def _shown(self, session: DriveSession) -> list[str]:
        profile = session.profile
        return [profile.find(code).code for code in self._codes] or monitoring_codes(profile)

    # Cycles

    async def _read(self, session: DriveSession) -> None:
        """Pass its cycles on until it was silent for long."""
        from tui.session.monitor.monitor import Monitor
        from tui.session.sharing.observer_poller import ObserverPoller

        codes, loop = self._shown(session), asyncio.get_running_loop()
        monitor = Monitor(session)
        looks_on = ObserverPoller(session, partial(self._sign, self.device), lambda: monitor.latest)
        looks_on.orphan = await asyncio.to_thread(_is_orphan, session)
        monitor.pause_reason, monitor.freely = looks_on.pause_reason, looks_on.freely
        leave = monitor.listen(partial(self._take, Cycles(session, codes), loop))
        self._good, learned = loop.time(), loop.time()
        monitor.start(codes, self._every)
        try:
            while loop.time() - self._good < SILENT_FOR_LONG:
                await asyncio.sleep(PLANT_LOOK_INTERVAL)
                if any(other.name == GATEWAY for other in session.line.facts.others):
                    looks_on.orphan |= await asyncio.to_thread(_is_orphan, session)
                if self.cycle is not None and not self.cycle.error:
                    self._good = loop.time()
                    due = loop.time() - learned > TIMEOUT_READ_AGAIN
                    if due and not looks_on.pause_reason():
                        learned = loop.time()
                        await _learn_timeout(session)
                elif self.cycle is not None and looks_on.waits:
                    self._good = loop.time()
        finally:
            leave()
            monitor.stop()

    def _take(self, cycles: Cycles, loop: asyncio.AbstractEventLoop, snapshot: Snapshot) -> None:
        """Keep a cycle as it was read; in the line's thread."""
        self.cycle = cycles.as_read(snapshot)
        loop.call_soon_threadsafe(self._changed)


async def _learn_timeout(session: DriveSession) -> None:
    """Read the communication timeout of the drive again; after an error, it is read again later."""
    from tui.session.monitor.timeout import read_timeout
    from tui.session.read.reader import Reader

    try:
        session.timeout = await read_timeout(Reader(session), Priority.POLL)
    except LineError as error:
        log.info("the timeout of device %s was not read: %s", session.device, error)


def _is_orphan(session: DriveSession) -> bool:
    """Return True if the program that started the motor has ended without leaving it running.

    Also if a client of another program's gateway started it, and no longer commands it. Reads
    files.
    """
    from tui.session.starts.keeper import pids_absent
    from tui.session.starts.starts import Starts

    facts = session.line.facts
    commander = facts.commanders.get(session.device)
    others = (other for other in facts.others if other.name == GATEWAY and other.id != commander)
    gateways = {other.process for other in others}
    absent = pids_absent(facts) | gateways
    record = Starts().found(session.line_text, session.device, absent)
    return record is not None and not record.left_running
