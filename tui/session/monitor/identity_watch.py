"""Identification of a drive again after it was gone: another one may answer at its address."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from tui.bus.api import LineStatus
from tui.bus.errors import ChecksumFault, WrongReply

from ..connect.contradiction import own_words
from ..connect.identify import DriveIdentity
from ..drive import DriveSession

GONE_FOR = 2.0
"""Seconds without an answer from which on another drive may have been connected."""
CHECK_INTERVAL = 0.3
DAMAGED_AGAIN_AFTER = 3.0
"""Seconds to the next attempt if the reply was damaged."""


class IdentityWatch:
    """Checks of one drive, in the line's loop; `found` gets what it reports, in a thread."""

    def __init__(
        self, session: DriveSession, found: Callable[[DriveSession, DriveIdentity], None]
    ) -> None:
        self._session, self._found = session, found
        self._line_since: float | None = None
        """Since when the line has its state; None before the first check."""
        self._was_gone = False

    async def step(self, _: object = None) -> float:
        """Identify the drive if it answers again; return the seconds to the next check.

        Raises the line's errors.
        """
        session, line = self._session, self._session.line
        drive, state = line.device_state(session.device), line.state
        if state.since != self._line_since:
            self._was_gone = self._was_gone or self._line_since is not None
            self._line_since = state.since
        if drive.silent_since is not None:
            silent = session.clock.monotonic() - session.clock.line_time(drive.silent_since)
            self._was_gone = self._was_gone or silent > GONE_FOR
        if self._was_gone and drive.answers and state.status is LineStatus.CONNECTED:
            try:
                identity = await own_words(line, session.device, session.family)
            except (ChecksumFault, WrongReply):
                return DAMAGED_AGAIN_AFTER
            self._was_gone = False
            if identity is not None:
                await asyncio.to_thread(self._found, session, identity)
        return CHECK_INTERVAL
