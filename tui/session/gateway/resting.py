"""Keeps drives from tripping on their communication timeout after a client has stopped them.

A controller may stop its motor and disconnect. Without another request the drive would trip. So
the owner of the line reads it, as long as the motor was seen at rest within that timeout.
"""

from __future__ import annotations

import asyncio
import logging

from tui.bus.api import ModbusLine, Priority
from tui.bus.errors import LineClosed, LineError
from tui.drive.chart import read_chart
from tui.drive.orders import chart_codes
from tui.drive.settings.writable import AT_REST
from tui.safety import JUST_SEEN, LOOKS_PER_TIMEOUT, READS_PER_TIMEOUT

from ..drive import DriveSession
from ..monitor.line_watch import LEARN_AGAIN
from ..monitor.timeout import read_timeout
from ..read.presence import UNKNOWN_TIMEOUT, alive_read
from ..read.reader import Reader

log = logging.getLogger(__name__)


class RestingDrives:
    """Sends keep-alive reads to the stopped drives of one line; for the gateway's loop.

    Only while the motor is at rest: otherwise reads would keep it running for a dead controller.
    """

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._tasks: dict[int, asyncio.Task[None]] = {}

    def keep(self, session: DriveSession) -> None:
        """Keep a drive alive that has acknowledged a stop."""
        device = session.device
        before = self._tasks.get(device)
        if before is None or before.done():
            task = asyncio.create_task(self._work(session), name=f"resting {device}")
            self._tasks[device] = task
            task.add_done_callback(_ended)

    def release(self, device: int) -> None:
        """Keep a drive alive no longer, because its controller starts the motor."""
        if (task := self._tasks.pop(device, None)) is not None:
            task.cancel()
        self._line.facts.keep_alives.let_go(device)

    def close(self) -> None:
        """Keep no drive alive any longer."""
        for device in tuple(self._tasks):
            self.release(device)

    async def _work(self, session: DriveSession) -> None:
        clock = session.clock
        begun, rests = clock.monotonic(), False
        learned: float | None = None
        reader = Reader(session)
        while True:
            timeout = _timeout(session) if learned is not None else UNKNOWN_TIMEOUT
            # a motor that turns did not obey, or another source has started it: the drive's own
            # timeout must act
            if timeout is None or not (rests or clock.monotonic() - begun < timeout):
                return
            rest = timeout / READS_PER_TIMEOUT - self._silence(session)
            if not rests and rest > 0:
                await clock.sleep(rest)
                continue
            try:
                rests = await self._is_at_rest(reader)
                if learned is None or clock.monotonic() - learned > LEARN_AGAIN:
                    session.timeout = await read_timeout(reader, Priority.POLL)
                    learned = clock.monotonic()
                self._keep_alive(session, rests=rests)
                if rests:
                    await clock.sleep(timeout / LOOKS_PER_TIMEOUT)
            except LineClosed:
                return
            except LineError as error:
                log.info("device %s is not kept alive: %s", session.device, error)
                await clock.sleep(timeout / READS_PER_TIMEOUT)

    def _keep_alive(self, session: DriveSession, *, rests: bool) -> None:
        alive, timeout = self._line.facts.keep_alives, _timeout(session)
        read = alive_read(session, timeout) if rests and timeout is not None else None
        if read is None:
            alive.let_go(session.device)
        else:
            alive.keep(read, timeout)

    async def _is_at_rest(self, reader: Reader) -> bool:
        profile, image = reader.profile, reader.session.image
        codes = [*profile.data.status_codes, *chart_codes(profile)]
        await reader.read(codes, priority=Priority.FEED)
        return read_chart(profile, image.fresh(JUST_SEEN)).motion in AT_REST

    def _silence(self, session: DriveSession) -> float:
        """Return the seconds since the last reply of the drive to any program."""
        heard = self._line.device_state(session.device).heard
        return session.clock.monotonic() - session.clock.line_time(heard) if heard else 0.0


def _ended(task: asyncio.Task[None]) -> None:
    if not task.cancelled() and (error := task.exception()) is not None:
        log.error("%s ended: %r", task.get_name(), error)


def _timeout(session: DriveSession) -> float | None:
    """Return the drive's communication timeout in seconds; None if it has none."""
    read = session.timeout
    if read is None or not read.known:
        return UNKNOWN_TIMEOUT
    return read.watch.timeout if read.watch is not None else None
