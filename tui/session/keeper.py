"""Looking after every drive found on a line, watched or not.

Some drives watch the line from the first request on and trip when it falls silent
(communication time-out): once asked, they are asked on, at least three times in each time-out,
as long as the line is open. The same requests tell the state of the drives in a list.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass

from tui.bus.errors import LineError
from tui.bus.line import Line, Priority, Worker
from tui.drive.chart import watched_codes
from tui.drive.profile import Profile

from .drive_session import DriveSession
from .drive_state import DriveState, drive_state
from .reader import Reader
from .readings import Reading

log = logging.getLogger("drivepanel")

GLANCE = 3.0
"""Seconds between two looks at a drive that does not watch the line."""
ASKED_PER_TIMEOUT = 4.0
SHORTEST = 0.2
STEP = 0.05


@dataclass(frozen=True, slots=True)
class Look:
    """What the last look at a drive brought."""

    state: DriveState | None
    error: str
    time: float
    timeout: float | None
    """The drive's communication time-out in seconds, if it is one that runs already."""


@dataclass(slots=True)
class _Kept:
    session: DriveSession
    reader: Reader
    period: float | None = None
    timeout: float | None = None
    due: float = 0.0


class Keeper:
    """Asks each kept drive often enough, in a worker of the line's loop."""

    def __init__(self, line: Line) -> None:
        self._line = line
        self._kept: dict[int, _Kept] = {}
        self._looks: dict[int, Look] = {}
        self._worker: Worker | None = None

    @property
    def looks(self) -> Mapping[int, Look]:
        """The last look at each drive, by device."""
        return dict(self._looks)

    def left_alone(self) -> dict[int, float]:
        """Running drives that act on their communication time-out once nobody asks them.

        By device, with the time-out in seconds.
        """
        return {
            device: look.timeout
            for device, look in self.looks.items()
            if look.timeout is not None and self._runs(device, look)
        }

    def _runs(self, device: int, look: Look) -> bool:
        """Whether a motor runs, by its drive's own monitor where that is the newer."""
        kept = self._kept.get(device)
        latest = kept.session.monitor.latest if kept and kept.session.monitor.running else None
        newer = latest is not None and latest.time > look.time and not latest.error
        state = latest.state if latest is not None and newer else look.state
        return state is not None and state.kind == "running"

    def keep(self, session: DriveSession) -> None:
        """Look after a drive from now on."""
        reader = Reader(self._line, session.device, session.profile)
        kept = dict(self._kept)
        kept[session.device] = _Kept(session, reader)
        self._kept = kept
        if self._worker is None or self._worker.done():
            self._worker = self._line.spawn(self._work, "keeper")

    def stop(self) -> None:
        """Let every drive go."""
        self._kept = {}
        self._looks = {}
        if self._worker is not None:
            self._worker.cancel()
            self._worker = None

    async def _work(self) -> None:
        while True:
            now = time.monotonic()
            for kept in list(self._kept.values()):
                if kept.due <= now and not _watched_enough(kept):
                    await self._guarded(kept)
            await asyncio.sleep(STEP)

    async def _guarded(self, kept: _Kept) -> None:
        """Look at a drive; what goes wrong with one must not leave the others alone."""
        try:
            await self._look_at(kept)
        except Exception:
            log.exception("looking after device %s failed", kept.session.device)
            kept.due = time.monotonic() + GLANCE

    async def _look_at(self, kept: _Kept) -> None:
        profile = kept.session.profile
        state, error = None, ""
        try:
            if kept.period is None:
                await self._learn_period(kept)
            readings = await kept.reader.read(_state_codes(profile), priority=Priority.POLL)
            state = drive_state(profile, readings)
        except LineError as fault:
            error = str(fault)
        now = time.monotonic()
        kept.due = now + (kept.period or GLANCE)
        self._looks[kept.session.device] = Look(state, error, now, kept.timeout)

    async def _learn_period(self, kept: _Kept) -> None:
        watch = kept.session.profile.data.communication_fault
        if watch is None or watch.needs_write or not watch.timeout:
            kept.period = GLANCE
            return
        reading = (await kept.reader.read([watch.timeout], priority=Priority.POLL))[watch.timeout]
        kept.timeout = _seconds(reading, watch.off)
        kept.period = (
            GLANCE
            if kept.timeout is None
            else min(GLANCE, max(SHORTEST, kept.timeout / ASKED_PER_TIMEOUT))
        )


def _seconds(reading: Reading, off: int | None) -> float | None:
    """The time-out in seconds; None where it is off or could not be read."""
    if reading.raw is None or reading.raw == off:
        return None
    number = reading.number
    if number is None:
        return None
    return number / 1000 if reading.unit == "ms" else number


def _watched_enough(kept: _Kept) -> bool:
    """Whether the drive's own monitor asks it often enough already.

    Not before the drive's time-out is known: until then the keeper asks for itself.
    """
    monitor = kept.session.monitor
    return kept.period is not None and monitor.running and monitor.period <= kept.period


def _state_codes(profile: Profile) -> list[str]:
    codes = watched_codes(profile)
    if profile.data.faults.parameter:
        codes.append(profile.data.faults.parameter)
    return list(dict.fromkeys(codes))
