"""A line for a script, opened by its text or its name; blocking, or in an asyncio loop."""

from __future__ import annotations

import asyncio
import warnings
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Self

from tui.bus.api import ModbusLine, Priority
from tui.drive.errors import DriveError
from tui.drive.profile import library

from ..connect.addresses import FIRST, LAST
from ..connect.contradiction import Contradiction, own_words
from ..connect.identify import DriveIdentity, identify_drive
from ..connect.known_line import KnownLine
from ..connect.named_lines import line_named
from ..connect.open_line import OpenLine, open_line
from ..drive import DriveSession
from ..fleet import Fleet
from ..journal import Journal
from ..read.order_check import check_byte_order
from ..read.reader import Reader
from ..sharing.orphan_motors import OrphanMotorGuard
from ..starts.keeper import StartKeeper
from ..teaching.teacher import Teacher
from .drive import AsyncDrive, Drive
from .drive_calls import STANDS_WITHIN, DriveCalls
from .guarded_run import GuardedRuns
from .work import awaited, uninterrupted, waited

CONNECTED_WITHIN = 5.0
"""Seconds in which a line is to be connected."""
ACCEPT_BY_SCRIPT = "If that is right, open it with accept=True."


def open_for_script(text: str, *, read_only: bool, accept: bool) -> OpenLine:
    """Open the line that a LINE or its name means, connected. Waits; raises LineError."""
    named = line_named(text)
    place = named.line if named is not None else text
    opened = open_line(place, read_only=read_only, wait=CONNECTED_WITHIN, program="script")
    if opened.simulation is None:
        opened.known = KnownLine(opened.line, way=ACCEPT_BY_SCRIPT)
        if accept:
            opened.known.accept(all_that_comes=True)
    return opened


def _warn(trouble: str) -> None:
    """Warn about the journal: the script goes on."""
    warnings.warn(trouble, RuntimeWarning, stacklevel=1)


class LineCalls:
    """An open line. Coroutines run in its loop, the rest in any thread."""

    def __init__(self, opened: OpenLine) -> None:
        self._opened = opened
        self._journal = Journal(on_trouble=_warn)
        # the motors of a simulated line end with it
        self._starts = None if opened.simulation else StartKeeper("script")
        self.fleet = Fleet(opened.line, self._journal, self._starts)
        self._runs = GuardedRuns()
        self._orphan_guard = OrphanMotorGuard(opened.line, self._journal)

    @property
    def line(self) -> ModbusLine:
        """The line itself."""
        return self._opened.line

    @property
    def changed(self) -> tuple[str, ...]:
        """Differences from the stored line; while there is one, only stops are written."""
        return self._opened.known.changed if self._opened.known is not None else ()

    async def drive(self, address: int, profile: str | None) -> DriveCalls:
        """Find a drive and keep polling it. Raises as `DriveLine.drive`."""
        if not isinstance(address, int) or not FIRST <= address <= LAST:
            raise DriveError(
                f"{address!r} cannot be the address of a drive: use {FIRST} to {LAST}."
            )
        session = await self._session(address, profile)
        await asyncio.to_thread(Teacher(session).recall)
        return DriveCalls(self.fleet.take(session), self.fleet, self._runs)

    async def _session(self, address: int, profile: str | None) -> DriveSession:
        line = self._opened.line
        reported: DriveIdentity | None
        if profile is None:
            reported = identity = await identify_drive(line, address)
            known = identity.profile or self._opened.profiles.get(address)
            if known is None:
                fits = identity.candidates or [item.id for item in library.listings()]
                text = f"Device {address} does not identify itself."
                if identity.reference:
                    text = f"Device {address} answers as {identity.reference!r}."
                raise DriveError(f"{text} Name its profile: {', '.join(fits)}.")
            found = library.load(known)
        else:
            found = library.load(profile)
            reported = await own_words(line, address, found)
        session = DriveSession(line, address, found, reported)
        if session.contradiction:
            raise Contradiction(session.contradiction)
        if self._opened.simulation is not None and session.is_unconfirmed:
            session.confirm_profile()
        await check_byte_order(Reader(session), Priority.OPERATOR_READ)
        if self._opened.known is not None:
            self._opened.known.note(reported, address, found.id)
        return session

    def close(self) -> None:
        """Close the line; waits until motors of blocks are at rest and its thread has ended."""
        self._runs.close(STANDS_WITHIN)
        self._orphan_guard.close()
        self.fleet.forget()
        self._opened.close()
        self._journal.close()
        if self._starts is not None:
            self._starts.close()


def open_drives(text: str, *, read_only: bool = False, accept: bool = False) -> DriveLine:
    """The line that a LINE or its name means, connected; shared as the commands share it.

    With `accept` a line that is not as it was is taken as it is now. Raises LineError.
    """
    return DriveLine(open_for_script(text, read_only=read_only, accept=accept))


class ScriptedLine:
    """State of an open line; nothing here waits."""

    def __init__(self, opened: OpenLine) -> None:
        self._calls = LineCalls(opened)

    @property
    def changed(self) -> tuple[str, ...]:
        """Differences from the stored line; while there is one, only stops are written."""
        return self._calls.changed


class DriveLine(ScriptedLine):
    """An open line. Taken drives are kept polled until it is closed."""

    def drive(self, address: int = 1, profile: str | None = None) -> Drive:
        """Return the drive at an address (1 to 247), by its identification or by a profile's ID.

        Raises DriveError for another address, and if the drive does not identify itself, or as
        another one; UnknownProfile; and the line's errors.
        """
        return Drive(waited(self._calls.line, lambda: self._calls.drive(address, profile)))

    def close(self) -> None:
        """Close the line. A drive with a communication timeout acts on it from now on."""
        self._calls.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class AsyncDriveLine(ScriptedLine):
    """An open line, as `DriveLine`; tasks of any asyncio loop may call."""

    async def drive(self, address: int = 1, profile: str | None = None) -> AsyncDrive:
        """As `DriveLine.drive`."""
        calls = self._calls
        return AsyncDrive(await awaited(calls.line, lambda: calls.drive(address, profile)))

    async def close(self) -> None:
        """As `DriveLine.close`; closed to the end even if this task is cancelled."""
        await uninterrupted(self._calls.close)


@asynccontextmanager
async def open_drives_async(
    text: str, *, read_only: bool = False, accept: bool = False
) -> AsyncIterator[AsyncDriveLine]:
    """Open a line for a block, as `open_drives` does. Raises LineError."""
    opened: list[AsyncDriveLine] = []

    def work() -> None:
        opened.append(AsyncDriveLine(open_for_script(text, read_only=read_only, accept=accept)))

    try:
        await uninterrupted(work)
        yield opened[0]
    finally:
        for line in opened:
            await line.close()
