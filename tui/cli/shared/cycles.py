"""Cycles of a watched drive for `watch`: good is what was read in that very cycle."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tui.session.monitor.snapshot import Snapshot, as_read

if TYPE_CHECKING:
    from tui.session.drive import DriveSession

SNAPSHOTS_WAITING = 64
"""Snapshots kept for an output that is slower than the line; older ones are dropped."""


class Cycles:
    """Takes snapshots in the line's thread, gives them out in a loop."""

    def __init__(self, session: DriveSession, codes: Sequence[str]) -> None:
        self.session = session
        self._codes = codes
        self._loop = asyncio.get_running_loop()
        self._waiting: asyncio.Queue[Snapshot] = asyncio.Queue(SNAPSHOTS_WAITING)
        self._before = float("-inf")
        """When the cycle before ended (monotonic)."""

    def take(self, snapshot: Snapshot) -> None:
        """Hand a snapshot over; for the line's thread."""
        reported = self.as_read(snapshot)
        self._loop.call_soon_threadsafe(self._put, reported)

    def _put(self, snapshot: Snapshot) -> None:
        if self._waiting.full():
            self._waiting.get_nowait()
        self._waiting.put_nowait(snapshot)

    async def next(self) -> Snapshot:
        """The oldest one that waits, or the next."""
        return await self._waiting.get()

    def as_read(self, snapshot: Snapshot) -> Snapshot:
        """The cycle with all codes; what was not read in it is stale."""
        since, self._before = self._before, snapshot.time
        return as_read(self.session.profile, self._codes, snapshot, since)
