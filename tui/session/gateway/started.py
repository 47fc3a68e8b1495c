"""Motors that clients have started: recorded before the frame, stopped when the gateway ends.

If this program is killed, the owner of the line stops the motors by these records.
"""

from __future__ import annotations

import asyncio
import logging

from tui.bus.api import ModbusLine
from tui.bus.errors import LineClosed, LineError
from tui.bus.line_events import DevicesStopped, LineEvent
from tui.drive.foreign_write import StartDirection
from tui.safety import CLIENT_MOTORS_STOP_WITHIN

from ..command.stop import Stopper
from ..command.stop_report import StopSummary
from ..drive import DriveSession
from ..journal import Journal
from ..read.reader import Reader
from ..starts.keeper import StartKeeper

log = logging.getLogger(__name__)

STANDSTILL_LOOK = 0.5
LONGEST_LOOK = 300.0
"""Seconds after a stop for which the motor is read, to see its standstill."""


class StartedMotors:
    """Motors of one line that clients have started; for the gateway's loop.

    A drive is read only after a stop. Earlier reads would hide the loss of its controller from it.
    """

    def __init__(self, line: ModbusLine, journal: Journal) -> None:
        self._line = line
        self._journal = journal
        self._keeper = StartKeeper("serve")
        self._sessions: dict[int, DriveSession] = {}
        self._looks: dict[int, asyncio.Task[None]] = {}
        self._loop = asyncio.get_running_loop()
        self._unsubscribe = line.facts.events.subscribe(self._hear)

    def holds(self, device: int) -> bool:
        """Return True if a motor that a client has started may still run. For any thread."""
        return self._keeper.holds(device)

    async def begin(self, session: DriveSession, order: StartDirection) -> bool:
        """Record a start before its frame; return False if it is already recorded.

        Raises StartNotRecorded.
        """
        session.starts = self._keeper
        self._sessions[session.device] = session
        look = self._looks.pop(session.device, None)
        if look is not None:
            # the standstill before this start must not end its record
            look.cancel()
        elif self._keeper.holds(session.device):
            # a controller repeats its word, so only the first is written to the disk
            return False
        await asyncio.to_thread(self._keeper.begin, session, order)
        return True

    def sent(self, session: DriveSession, *, sent: bool) -> None:
        """Note that the frame was sent, or was refused before."""
        (self._keeper.sent if sent else self._keeper.never_sent)(session)

    def _hear(self, event: LineEvent) -> None:
        if isinstance(event, DevicesStopped):
            self.stopped(*event.devices)

    def stopped(self, *devices: int) -> None:
        """Follow motors to standstill after a stop by any program. For any thread."""
        for device in devices:
            if self._keeper.holds(device):
                self._loop.call_soon_threadsafe(self._look_at, device)

    def given(self, device: int) -> None:
        """Remove the record of a drive that another program commands now."""
        if (session := self._sessions.get(device)) is not None:
            self._keeper.give_away(session)

    def _look_at(self, device: int) -> None:
        if device not in self._looks:
            task = self._loop.create_task(self._until_standing(device), name=f"standstill {device}")
            self._looks[device] = task
            task.add_done_callback(lambda done: self._looked(device, done))

    def _looked(self, device: int, task: asyncio.Task[None]) -> None:
        if self._looks.get(device) is task:
            del self._looks[device]
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("standstill of device %s was not seen: %r", device, error)

    async def _until_standing(self, device: int) -> None:
        session = self._sessions[device]
        codes = session.profile.data.status_codes
        end = self._loop.time() + LONGEST_LOOK
        while self._keeper.holds(device) and self._loop.time() < end:
            try:
                await Reader(session).read(codes)
            except LineClosed:
                return
            except LineError as error:
                log.info("standstill of device %s was not seen: %s", device, error)
            await session.clock.sleep(STANDSTILL_LOOK)

    async def end(self) -> StopSummary | None:
        """Stop the motors that still run; None if there are none."""
        self._unsubscribe()
        left = [session for device, session in self._sessions.items() if self._keeper.holds(device)]
        summary = None
        if left:
            stopper = Stopper(self._line, self._journal)
            try:
                stopper.stop(left, by="the end of serve")
                summary = await asyncio.to_thread(stopper.wait, left, CLIENT_MOTORS_STOP_WITHIN)
            except LineClosed as error:
                log.error("motors were not stopped: %s", error)
        for task in tuple(self._looks.values()):
            task.cancel()
        await asyncio.to_thread(self._keeper.close)
        return summary
