"""The cycles of a watched drive, for one reader."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Mapping
from datetime import UTC, datetime

from tui.drive.errors import DriveError

from ..drive import DriveSession
from ..monitor.monitor import Monitor
from ..monitor.snapshot import Snapshot, as_read
from ..reading import reading_of
from .values import Sample, value_from

SHORTEST_CYCLE, LONGEST_CYCLE = 0.05, 86400.0
"""Seconds of a cycle of `Drive.watch`."""
SAMPLES_WAITING = 64
"""Cycles kept for a script that is slower than the line; older ones are dropped."""


class SampleFeed:
    """Watches a drive until it is closed. Raises DriveError for an impossible cycle time."""

    def __init__(self, session: DriveSession, named: Mapping[str, str], every: float) -> None:
        """`named` maps each code, as requested, to the drive's own."""
        if not SHORTEST_CYCLE <= every <= LONGEST_CYCLE:
            raise DriveError(f"every={every} is not a cycle time. Use 0.05 to 86400 seconds.")
        self._session = session
        self._named = named
        self._waiting: deque[Snapshot] = deque(maxlen=SAMPLES_WAITING)
        self._arrived = asyncio.Event()
        self._since = -math.inf
        self._monitor = Monitor(session)
        self._monitor.listen(self._take)
        self._monitor.start(list(named.values()), every)

    async def next(self) -> Sample:
        """Wait for the next cycle; runs in the line's loop."""
        while not self._waiting:
            self._arrived.clear()
            await self._arrived.wait()
        snapshot = self._waiting.popleft()
        sample = self._sample(snapshot)
        self._since = snapshot.time
        return sample

    def close(self) -> None:
        """Stop watching; any thread may call."""
        self._monitor.stop()

    def _take(self, snapshot: Snapshot) -> None:
        self._waiting.append(snapshot)
        self._arrived.set()

    def _sample(self, snapshot: Snapshot) -> Sample:
        profile, clock = self._session.profile, self._session.clock
        cycle = as_read(profile, list(dict.fromkeys(self._named.values())), snapshot, self._since)
        values = {
            requested: value_from(reading_of(cycle.readings[code]), clock)
            for requested, code in self._named.items()
        }
        time = datetime.fromtimestamp(snapshot.wall, UTC)
        return Sample(time, values, cycle.state.headline, snapshot.error)
