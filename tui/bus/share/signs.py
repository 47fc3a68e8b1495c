"""The owner's signs of life, and what it does where it gave none for too long."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection

from ..schedule.inside import LineInside
from .attached import Client
from .lease import SILENT_CLIENT, TOO_LATE, Lease, stood_still
from .messages import RollCall, StopGiven
from .stops_past import StopsPast

log = logging.getLogger(__name__)

NEWS_INTERVAL = 0.2
"""Seconds between the owner's signs of life."""
LOOKS_IN_VAIN = int(SILENT_CLIENT / NEWS_INTERVAL)
"""Looks at a client before it counts as frozen."""
ROLL_TAKES_IN, ROLL_TURNS = 0.05, 20
"""Seconds, and turns of the loop, for programs that wait to be taken in."""
ROLL_WITHIN, ROLL_LOOK = 0.5, 0.005
"""Seconds for the answers to a roll call."""


class SignsOfLife:
    """Tells the clients of a line again and again that its owner is well; in the line's loop.

    Nothing but stops goes out while it has not: see Lease.
    """

    def __init__(
        self,
        inside: LineInside,
        clients: Callable[[], Collection[Client]],
        tell: Callable[[], None],
        stopped: Callable[[StopGiven], None],
        stops_past: StopsPast,
    ) -> None:
        self._inside = inside
        self._clients = clients
        self._tell = tell
        self._stopped = stopped
        self._lease = Lease(inside.clock)
        self._stops_past = stops_past
        self._rolls = 0
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to tell."""
        for stop in self._stops_past.take():
            self._stopped(stop)
        self._lease.renew(self._inside.clock())
        self._inside.dispatcher.held_back = lambda: self._lease.lapsed
        self._task = asyncio.get_running_loop().create_task(self._work(), name="signs of life")

    def close(self) -> None:
        """Tell nothing any more."""
        self._inside.dispatcher.held_back = bool
        if self._task is not None:
            self._task.cancel()

    async def _work(self) -> None:
        while True:
            await asyncio.sleep(NEWS_INTERVAL)
            said = self._inside.clock()
            try:
                self._let_silent_go()
                if self._lease.lapsed:
                    await self._call_roll()
                    said = self._inside.clock()
                self._tell()
            except Exception:
                # without signs of life the line would be held back for good
                log.exception("telling the news of the line failed")
            self._lease.renew(said)

    def _let_silent_go(self) -> None:
        """A client that is frozen counts as gone: its motor must not be fed by the others."""
        now = self._inside.clock()
        for client in self._clients():
            if client.is_silent(now, LOOKS_IN_VAIN):
                log.warning("%s gives no sign of life and is let go", client.program.text)
                client.drop()

    async def _call_roll(self) -> None:
        """This program stood still: hear what was stopped meanwhile before anything goes out.

        A moment is left to those that wait to be taken in, then everybody is asked who is there:
        what a program said before comes before its answer. One that does not answer is not waited
        for; a stop that it sent on the port itself is noted in the file.
        """
        stood = self._lease.stood
        log.warning("%s", stood_still(stood))
        if stood > TOO_LATE:
            self._inside.dispatcher.void_older(self._inside.clock() - TOO_LATE, stood_still(stood))
        for _ in range(ROLL_TURNS):
            await asyncio.sleep(ROLL_TAKES_IN / ROLL_TURNS)
        self._rolls += 1
        for client in self._clients():
            client.say(RollCall(self._rolls))
        end = self._inside.clock() + ROLL_WITHIN
        while self._inside.clock() < end and not self._all_present():  # noqa: ASYNC110 - few turns
            await asyncio.sleep(ROLL_LOOK)
        await self._hear_past()

    async def _hear_past(self) -> None:
        """Hear of stops that went past this program; all know that it is well meanwhile."""
        taking = asyncio.ensure_future(asyncio.to_thread(self._stops_past.take))
        while not taking.done():
            await asyncio.wait((taking,), timeout=NEWS_INTERVAL)
            self._tell()
        for stop in taking.result():
            self._stopped(stop)

    def _all_present(self) -> bool:
        return all(one.present >= self._rolls for one in self._clients())
