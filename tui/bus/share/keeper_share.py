"""A line in its keeper: open while a program is attached, and closed with the last one."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from tui.safety import ALARM_AFTER, LINGERS

from ..model import LineStatus
from ..program import KEEPER, Program, pid_namespace
from ..schedule.inside import LineInside, Say
from .client import LEAVE_WITHIN
from .messages import VERSION
from .place import STARTING, Owner, SharePlace
from .sharing import Sharing

ALARM_RENEWED = 0.25
"""Seconds between two renewals of the alarm that ends a keeper whose loop hangs."""
PROCESS_ENDS_WITHIN = 20.0
"""Seconds in which the process must end after that loop."""
CARE_INTERVAL = 0.005
"""Seconds between two looks whether a motor is still to be stopped."""


@dataclass(frozen=True, slots=True)
class Keeping:
    """The part of a keeper that its line needs."""

    lock: int
    """Descriptor of the lock file, which it has inherited."""
    before: tuple[Program, ...]
    """Programs that were on the line until now."""
    end: Callable[[], None]
    """Called in the line's thread when no program needs this keeper."""
    cares: Callable[[], bool]
    """True while a motor is still to be stopped."""
    alarm: Callable[[float], object]
    """Ends this process after so many seconds, unless it is called again."""


class KeeperShare(Sharing):
    """The sharing of a line by its keeper; lives in the line's loop."""

    def __init__(self, keeping: Keeping, place: SharePlace, inside: LineInside) -> None:
        super().__init__(place, inside)
        self._keeping = keeping
        self._moved = asyncio.Event()
        self._arrived = asyncio.Event()
        self._ending: asyncio.TimerHandle | None = None
        self._say: Say = lambda _status, _text, _error: None
        self._open = False
        self._alarm: asyncio.Task[None] | None = None
        self._lock.adopt(keeping.lock)

    async def own(self, say: Say) -> None:
        """Return once a program needs the line."""
        self._say = say
        if self._server is None:
            self._inside.facts.set_programs(self._keeping.before)
            if not await self._listen():
                # the program that has started this process gets the lock back, and counts a death
                me = Program(STARTING, KEEPER, os.getpid(), space=pid_namespace())
                with suppress(OSError):
                    self._lock.tell(Owner(VERSION, me, ""))
                self._lock.hand_over()
                self._keeping.end()
                await asyncio.Event().wait()
            self._alarm = asyncio.create_task(self._renew_alarm(), name="alarm")
        await self._until(lambda: self._needed)
        self._doubt_replies()
        self._open = True

    async def _renew_alarm(self) -> None:
        """Renew the alarm that ends this process if its loop hangs: its requests would be too
        old."""
        try:
            while True:
                self._keeping.alarm(ALARM_AFTER)
                await asyncio.sleep(ALARM_RENEWED)
        finally:
            self._keeping.alarm(PROCESS_ENDS_WITHIN)

    async def unwanted(self) -> None:
        """Return once no program is attached and no motor must be stopped."""
        await self._until(lambda: not self._here)
        while self._needed:
            await asyncio.sleep(CARE_INTERVAL)
            await self._until(lambda: not self._here)

    async def pause(self, seconds: float) -> None:
        """Wait before the next attempt on a lost line; a program that attaches ends the wait."""
        self._open = False
        self._moved.set()
        self._arrived.clear()
        with suppress(TimeoutError):
            await asyncio.wait_for(self._arrived.wait(), seconds)

    def rest(self, quiet: float) -> None:
        """Note that the port is closed; a reply may still come for `quiet` seconds."""
        super().rest(quiet)
        self._open = False
        self._moved.set()

    # What the server reports

    def moved(self, *, arrived: bool) -> None:
        """Note that a program has attached or left."""
        self._moved.set()
        if self._ending is not None:
            self._ending.cancel()
            self._ending = None
        if not self._here:
            # of a port that cannot be opened nothing is kept: another user may have the right to
            lingers = 0.0 if self._inside.state().status is LineStatus.LOST else LINGERS
            self._ending = asyncio.get_running_loop().call_later(lingers, self._end_unneeded)
        if arrived:
            self._arrived.set()
            if self._inside.state().status is LineStatus.LOST:
                # it is tried at once
                self._say(LineStatus.CONNECTING, "", None)

    async def port_left(self) -> None:
        """Return once the port is closed, or another program needs it."""
        with suppress(TimeoutError):
            async with asyncio.timeout(LEAVE_WITHIN):
                await self._until(lambda: not self._open or self._here)

    async def makes_way(self) -> bool:
        """End if no program is attached; True then. Waits a moment for a check of the motors."""
        end = self._inside.clock() + LEAVE_WITHIN
        while self._needed and not self._here and self._inside.clock() < end:  # noqa: ASYNC110
            await asyncio.sleep(CARE_INTERVAL)
        if self._needed:
            return False
        self._keeping.end()
        return True

    @property
    def _here(self) -> bool:
        """True while a program is attached."""
        return self._server is not None and self._server.serves

    @property
    def _needed(self) -> bool:
        stops = self._server is not None and self._server.stops_wait
        stops = stops or self._inside.dispatcher.proof.repeats_wait
        return self._here or stops or self._keeping.cares()

    async def _until(self, holds: Callable[[], bool]) -> None:
        while not holds():
            self._moved.clear()
            await self._moved.wait()

    def _end_unneeded(self) -> None:
        self._ending = None
        if self._needed:
            loop = asyncio.get_running_loop()
            self._ending = loop.call_later(LINGERS, self._end_unneeded)
        else:
            self._keeping.end()
