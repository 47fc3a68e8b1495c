"""Heartbeats: the owner's, its actions after a pause of its own, and those of programs."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
from collections.abc import Awaitable, Callable, Collection
from pathlib import Path
from time import monotonic

from tui.safety import (
    BACK_AT_LATEST,
    BACK_WITHIN,
    BEAT_INTERVAL,
    BEAT_WITHIN,
    COMMAND_TOO_LATE,
    LOOP_HANGS,
    OWNER_BEAT_INTERVAL,
    SENDS_WITHIN,
    SILENT_CLIENT,
)

from ..schedule.inside import LineInside
from .attached import Client, was_suspended
from .messages import Alive, Pulse, packed
from .place import reached

log = logging.getLogger(__name__)

LOOKS_IN_VAIN = int(SILENT_CLIENT / OWNER_BEAT_INTERVAL)
"""Looks at a client before it counts as frozen."""
HEARD_TIME, HEARD_TURNS = 0.05, 20
"""Seconds, and turns of the loop, to receive all that programs have sent in the meantime."""
BACK_LOOK = 0.1
"""Seconds between two checks. A late check counts once: no program was served meanwhile."""
_ALIVE = packed(Alive())


async def programs_back(
    is_greeting: Callable[[], bool],
    now: Callable[[], float] = monotonic,
    pause: Callable[[float], Awaitable[None]] = asyncio.sleep,
) -> None:
    """Wait until every program of the previous holder has had time to attach to this one.

    A computer short of time, for example a container with a quota, may suspend this process for
    long: a program that has connected in the meantime is served first.
    """
    left, latest = BACK_WITHIN, now() + BACK_AT_LATEST
    while (left > 0 or is_greeting()) and now() < latest:
        await pause(BACK_LOOK)
        left -= BACK_LOOK


class HeartbeatSender:
    """Sends the owner's heartbeat to the clients of a line; in the line's loop."""

    def __init__(
        self,
        inside: LineInside,
        clients: Callable[[], Collection[Client]],
        tell: Callable[[], None],
    ) -> None:
        self._inside = inside
        self._clients = clients
        self._tell = tell
        self._beat = inside.clock()
        """When the last sign was given."""
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin the heartbeat."""
        self._beat = self._inside.clock()
        self._inside.dispatcher.held_back = lambda: self._stood > SENDS_WITHIN
        self._task = asyncio.get_running_loop().create_task(self._work(), name="signs of life")

    def close(self) -> None:
        """End the heartbeat."""
        self._inside.dispatcher.held_back = bool
        if self._task is not None:
            self._task.cancel()

    @property
    def _stood(self) -> float:
        return self._inside.clock() - self._beat

    async def _work(self) -> None:
        while True:
            await asyncio.sleep(OWNER_BEAT_INTERVAL)
            beat = self._inside.clock()
            try:
                self._let_silent_go()
                if self._stood > SENDS_WITHIN:
                    await self._hear_stops()
                    beat = self._inside.clock()
                self._tell()
            except Exception:
                # without heartbeats the line would be held back permanently
                log.exception("telling the news of the line failed")
            self._beat = beat

    def _let_silent_go(self) -> None:
        """Disconnect frozen clients: the others must not keep their motors alive."""
        now = self._inside.clock()
        for client in self._clients():
            if client.is_silent(now, LOOKS_IN_VAIN):
                log.warning("%s sends no heartbeat and is disconnected", client.program.text)
                client.drop()

    async def _hear_stops(self) -> None:
        """Receive stops after this program was suspended: they may cancel its waiting requests."""
        stood, why = self._stood, was_suspended(self._stood)
        log.warning("%s", why)
        if stood > COMMAND_TOO_LATE:
            self._inside.dispatcher.void_older(self._inside.clock() - COMMAND_TOO_LATE, why)
        for _ in range(HEARD_TURNS):
            await asyncio.sleep(HEARD_TIME / HEARD_TURNS)


class Heartbeat:
    """The heartbeat of an attached program, sent by a thread on a separate connection.

    It shows that the process runs: a stopped or swapped-out one sends none. A line's loop that is
    busy for a moment does not delay it. One that hangs ends it.
    """

    def __init__(self, holder: str, program: str) -> None:
        """`holder` is the socket of the process that holds the line."""
        self._holder = Path(holder)
        self._greeting = packed(Pulse(program))
        self._turned = monotonic()
        self._ended = threading.Event()
        threading.Thread(target=self._work, name="heartbeat", daemon=True).start()

    def turn(self) -> None:
        """Note that the loop of the line runs."""
        self._turned = monotonic()

    def close(self) -> None:
        """End the heartbeat."""
        self._ended.set()

    def _work(self) -> None:
        connection: socket.socket | None = None
        while not self._ended.is_set():
            if monotonic() - self._turned < LOOP_HANGS:
                connection = self._beat(connection)
            self._ended.wait(BEAT_INTERVAL)
        if connection is not None:
            connection.close()

    def _beat(self, connection: socket.socket | None) -> socket.socket | None:
        """Send one heartbeat; returns the connection for the next one, None if it failed."""
        try:
            if connection is None:
                connection = reached(self._holder, BEAT_WITHIN)
                connection.sendall(self._greeting)
            else:
                connection.sendall(_ALIVE)
        except (OSError, ValueError):
            if connection is not None:
                connection.close()
            return None
        return connection
