"""A line for a script: opened by its text or its name, shared as the commands share it."""

from __future__ import annotations

import warnings
from types import TracebackType
from typing import Self

from tui.bus.api import Priority
from tui.drive.errors import DriveError
from tui.drive.profile import library

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
from ..teaching.teacher import Teacher
from .drive import Drive
from .work import waited

CONNECTED_WITHIN = 5.0
"""Seconds in which a line is to be connected."""
ACCEPT_BY_SCRIPT = "If that is right, open it with accept=True."


def open_drives(text: str, *, read_only: bool = False, accept: bool = False) -> DriveLine:
    """The line that a LINE or its name means, connected; shared as the commands share it.

    With `accept` a line that is not as it was is taken as it is now. Raises LineError.
    """
    named = line_named(text)
    place = named.line if named is not None else text
    opened = open_line(place, read_only=read_only, wait=CONNECTED_WITHIN, program="script")
    if opened.simulation is None:
        opened.known = KnownLine(opened.line, way=ACCEPT_BY_SCRIPT)
        if accept:
            opened.known.accept(all_that_comes=True)
    return DriveLine(opened)


def _warn(trouble: str) -> None:
    """Warn about the journal: the script goes on."""
    warnings.warn(trouble, RuntimeWarning, stacklevel=1)


class DriveLine:
    """An open line. Taken drives are kept polled until it is closed."""

    def __init__(self, opened: OpenLine) -> None:
        self._opened = opened
        self._journal = Journal(on_trouble=_warn)
        self._fleet = Fleet(opened.line, self._journal)
        self._guardian = OrphanMotorGuard(opened.line, self._journal)

    def drive(self, address: int = 1, profile: str | None = None) -> Drive:
        """The drive at an address, by its own word for what it is, or by a profile's id.

        Raises DriveError where it does not say what it is, or says that it is another.
        """
        session = waited(self._opened.line, lambda: self._session(address, profile))
        Teacher(session).recall()
        return Drive(self._fleet.take(session).session, self._fleet)

    @property
    def changed(self) -> tuple[str, ...]:
        """Differences from the stored line; while there is one, only stops are written."""
        return self._opened.known.changed if self._opened.known is not None else ()

    async def _session(self, address: int, profile: str | None) -> DriveSession:
        line = self._opened.line
        reported: DriveIdentity | None
        if profile is None:
            reported = identity = await identify_drive(line, address)
            if identity.profile is None:
                fits = ", ".join(identity.candidates) or "any"
                raise DriveError(
                    f"Device {address} does not identify itself; name its profile: {fits}."
                )
            found = library.load(identity.profile)
        else:
            found = library.load(profile)
            reported = await own_words(line, address, found)
        session = DriveSession(line, address, found, reported)
        if session.contradiction:
            raise Contradiction(session.contradiction)
        await check_byte_order(Reader(session), Priority.OPERATOR_READ)
        if self._opened.known is not None:
            self._opened.known.note(reported, address, found.id)
        return session

    def close(self) -> None:
        """Close the line. A drive with a communication timeout acts on it from now on."""
        self._guardian.close()
        self._fleet.forget()
        self._opened.close()
        self._journal.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
