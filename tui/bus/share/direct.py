"""Stops past an owner that is frozen: on the port itself, and only what belongs to a stop."""

from __future__ import annotations

import asyncio
import logging
from concurrent.futures import Future
from contextlib import suppress

from ..errors import LineError, LineLost, NoAnswer
from ..link import RtuTcpLink, SerialLink, TcpLink
from ..model import Priority, Reply
from ..program import Program
from ..requests import BROADCAST
from ..schedule.connection import open_master
from ..schedule.dispatcher import Dispatcher
from ..schedule.inside import LineInside
from ..schedule.queue import Job
from .keeper_process import BY_HAND
from .turn import Turn

log = logging.getLogger(__name__)

PORT_AGAIN = 0.5
GATEWAY_HELD = " A gateway that takes one connection only is held by it."
GIVEN_UP = 3.0
"""Seconds after which a stop that finds no way past the owner is told so, and fails."""
NO_WAY = 1.0
"""The same, once it is known that the owner stays."""


class DirectStops:
    """Sends the stops of this program, and the reads that see their motors stop."""

    def __init__(self, inside: LineInside, turn: Turn, owner: Program) -> None:
        self.trouble = ""
        """Why no stop gets past the owner, and what to do; empty while nothing is known of it."""
        self._failing_since: float | None = None
        self._owner = owner
        self._taken: list[Job] = []
        """Requests that have not ended."""
        self._why = "the line does not open."
        self._remedy = BY_HAND.format(pid=owner.pid)
        self._worked = inside.clock()
        """When an exchange ended last, or the first that waits was taken."""
        self._inside = inside
        self._turn = turn
        self._echo: bool | None = None
        """What was found out of the adapter."""
        self._stops: dict[int, dict[bytes, Job]] = {}
        """What was sent to stop each device, each frame once."""
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
            sent = self._stops.setdefault(device, {})
            if job.request.changes:
                sent[job.pdu] = job
        elif (
            job.request.changes
            or job.priority > Priority.OPERATOR_READ
            or (device not in self._stops and BROADCAST not in self._stops)
        ):
            return False
        job.answer.add_done_callback(self._note_end)
        self._taken = [one for one in self._taken if not one.answer.done()]
        if not self._taken:
            self._worked = self._inside.clock()
        self._taken.append(job)
        self._dispatcher.submit(job)
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._serve(), name="direct stops")
        return True

    async def _serve(self) -> None:
        """Serve in turns with other programs that do the same, until it is left.

        The port is open in a turn only: of two that have it open, each hears a part of an answer.
        """
        while True:
            await self._dispatcher.some_wait()
            try:
                async with self._turn.taken():
                    pause = await self._serve_some()
            except LineError as error:
                log.error("a stop past the owner: %s", error)
                self._note_failure(error)
                pause = PORT_AGAIN
            if self._dispatcher.left:
                return
            await asyncio.sleep(pause)

    def _note_failure(self, error: LineError) -> None:
        """There is no way past the owner just now: say so, and after a while fail what waits."""
        now = self._inside.clock()
        self._failing_since = self._failing_since or now
        self._note_no_way(str(error))
        if now - self._failing_since > GIVEN_UP:
            self._dispatcher.fail_all(self.trouble, LineLost)

    def _note_end(self, answer: Future[Reply]) -> None:
        """What became of a request; over a network the gateway may be silent, not the drive."""
        if answer.cancelled():
            return
        error = answer.exception()
        if not isinstance(error, LineError):
            self.trouble, self._failing_since = "", None
            self._worked = self._inside.clock()
        elif isinstance(error, NoAnswer) and not isinstance(self._inside.link, SerialLink):
            self._note_no_way(str(error))

    def _note_no_way(self, why: str) -> None:
        self._why = why
        self.trouble = no_way_past(self._owner, self._inside.link, why, self._remedy)

    def owner_stays(self, remedy: str) -> None:
        """The owner cannot be ended by this program, but by `remedy`: fail what finds no way."""
        self._remedy = remedy
        waits = not all(one.answer.done() for one in self._taken)
        if waits and self._inside.clock() - self._worked > NO_WAY:
            self._note_no_way(self._why)
            self._dispatcher.fail_all(self.trouble, LineLost)

    async def _serve_some(self) -> float:
        inside = self._inside
        master = await open_master(inside.link, inside.around, self._dispatcher.wake, alone=False)
        master.echo = self._echo
        try:
            return await self._dispatcher.serve_some(master)
        finally:
            self._echo = master.echo
            master.close()

    async def end(self) -> None:
        """The owner answers again: what is left goes its usual way, each stop once more.

        A frame that the owner was just sending as it froze may have gone out behind the stop.
        """
        self._dispatcher.leave()
        if self._task is not None:
            if not self._dispatcher.in_flight:
                self._task.cancel()
            with suppress(asyncio.CancelledError):
                await self._task
        for frames in self._stops.values():
            for job in frames.values():
                again = Job(job.request, job.priority, job.limits)
                again.program, again.asked = job.program, self._inside.clock()
                self._inside.dispatcher.submit(again)
        for job in self._dispatcher.take_all():
            self._inside.dispatcher.put_back(job)


def no_way_past(
    owner: Program, link: SerialLink | TcpLink | RtuTcpLink, why: str, remedy: str
) -> str:
    """That stops do not get past an owner which is frozen, and what to do, for a person."""
    gateway = "" if isinstance(link, SerialLink) else GATEWAY_HELD
    return (
        f"No stop gets past {owner.text}, which owns the line and does not answer: {why}{gateway}"
        f" {remedy}"
    )
