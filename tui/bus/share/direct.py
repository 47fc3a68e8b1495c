"""Stops past an owner that is frozen: on the port itself, and only what belongs to a stop."""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress

from ..errors import LineError
from ..link import TcpLink
from ..model import Priority
from ..requests import BROADCAST
from ..schedule.connection import open_master
from ..schedule.dispatcher import Dispatcher
from ..schedule.inside import LineInside
from ..schedule.queue import Job

log = logging.getLogger(__name__)

TRY_AGAIN = 0.5


class DirectStops:
    """Sends the stops of this program, and the reads that see their motors stop."""

    def __init__(self, inside: LineInside) -> None:
        self._inside = inside
        self._devices: set[int] = set()
        self._dispatcher = Dispatcher(
            inside.devices,
            inside.around.tally,
            inside.timing,
            inside.clock,
            gateway=isinstance(inside.link, TcpLink),
            facts=inside.facts,
        )
        self._task: asyncio.Task[None] | None = None

    def take(self, job: Job) -> bool:
        """Take a job that belongs to a stop; False for any other."""
        device = job.request.device
        if job.priority is Priority.STOP:
            self._devices.add(device)
        elif (
            job.request.changes
            or job.priority > Priority.OPERATOR_READ
            or (device not in self._devices and BROADCAST not in self._devices)
        ):
            return False
        self._dispatcher.submit(job)
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._serve(), name="direct stops")
        return True

    async def _serve(self) -> None:
        """Open the port beside its owner and serve, again and again."""
        inside = self._inside
        while True:
            try:
                master = await open_master(
                    inside.link, inside.around, self._dispatcher.wake, alone=False
                )
            except LineError as error:
                log.error("a stop past the owner: %s", error)
                await asyncio.sleep(TRY_AGAIN)
                continue
            try:
                await self._dispatcher.serve(master)
            except LineError as error:
                log.error("a stop past the owner: %s", error)
                await asyncio.sleep(TRY_AGAIN)
            finally:
                master.close()

    def end(self) -> None:
        """The owner answers again: what is left goes its usual way."""
        if self._task is not None:
            self._task.cancel()
        for job in self._dispatcher.take_all():
            self._inside.dispatcher.put_back(job)

    async def close(self) -> None:
        """End, and wait for the port to be given back."""
        self.end()
        if self._task is not None:
            with suppress(asyncio.CancelledError):
                await self._task
