"""Clock of a replay: its time is that of the record, and does not go on while it is paused."""

from __future__ import annotations

import asyncio
import heapq
import threading
import time
from itertools import count
from typing import NamedTuple

from ..clock import Clock

SPEEDS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
REPLAY_TICK = 0.02
"""Real seconds between two steps of the time."""
STEP_TAKES = 0.02
"""Seconds of processor time in one step; with more to do, the replay is slower than its speed."""
WAKING_TURNS = 3
"""Turns of the loop in which the work that was woken does its part."""


class _Sleeper(NamedTuple):
    wake: float
    number: int
    loop: asyncio.AbstractEventLoop
    woken: asyncio.Future[None]


class ReplayClock(Clock):
    """Seconds since 1970 as they were in the record. For any thread.

    Its time goes from sleeper to sleeper, so that all that was due happens, at its time.
    """

    def __init__(self, begin: float, end: float, now: float) -> None:
        self.begin, self.end = begin, end
        self._now = now
        self._speed = 1.0
        self._playing = False
        self._since = (0.0, now)
        """Real monotonic seconds, and the time of the record then."""
        self._sleepers: list[_Sleeper] = []
        self._numbers = count()
        self._lock = threading.Lock()
        self.least_sleep = 0.0
        """Least seconds of each sleep, to pass a long time with little work."""

    def monotonic(self) -> float:
        """Return the time of the record."""
        return self._now

    def wall(self) -> float:
        """Return the time of the record."""
        return self._now

    def wall_of(self, moment: float) -> float:
        """Return the same: both are times of the record."""
        return moment

    @property
    def speed(self) -> float:
        """Its speed: 2 plays a second of the record in half a second."""
        return self._speed

    @property
    def playing(self) -> bool:
        """True while the time goes on."""
        return self._playing and self._now < self.end

    def play(self) -> None:
        """Let the time go on."""
        with self._lock:
            self._since, self._playing = (time.monotonic(), self._now), True

    def hold(self) -> None:
        """Stop the time."""
        with self._lock:
            self._playing = False

    def set_speed(self, speed: float) -> None:
        """Change the speed, whether it plays or not."""
        with self._lock:
            self._speed, self._since = speed, (time.monotonic(), self._now)

    async def sleep(self, seconds: float) -> None:
        """Sleep for seconds of the record."""
        if seconds <= 0:
            await asyncio.sleep(0)
            return
        loop = asyncio.get_running_loop()
        woken: asyncio.Future[None] = loop.create_future()
        wake = self._now + max(seconds, self.least_sleep)
        with self._lock:
            heapq.heappush(self._sleepers, _Sleeper(wake, next(self._numbers), loop, woken))
        await woken

    # In the line's loop

    async def follow(self) -> None:
        """Let the time go on as it is played; never returns."""
        while True:
            await asyncio.sleep(REPLAY_TICK)
            if not self.playing:
                continue
            real, then = self._since
            target = min(self.end, then + (time.monotonic() - real) * self._speed)
            if not await self.run_to(target, STEP_TAKES):
                with self._lock:
                    self._since = time.monotonic(), self._now

    async def run_to(self, target: float, takes: float = float("inf")) -> bool:
        """Go on to a time, waking what sleeps on the way; False if it takes too long.

        `takes` is in seconds of processor time of this thread.
        """
        begun = time.thread_time()
        while (sleepers := self._due(target)) is not None:
            here = asyncio.get_running_loop()
            for sleeper in sleepers:
                if sleeper.loop is here:
                    _wake(sleeper.woken)
                elif not sleeper.loop.is_closed():
                    sleeper.loop.call_soon_threadsafe(_wake, sleeper.woken)
            for _ in range(WAKING_TURNS):
                await asyncio.sleep(0)
            if time.thread_time() - begun > takes:
                return False
        with self._lock:
            self._now = max(self._now, target)
        return True

    def skip_to(self, time: float) -> None:
        """Go on to a time; what sleeps is late."""
        with self._lock:
            self._now = max(self._now, time)

    def _due(self, target: float) -> list[_Sleeper] | None:
        """Go to the time of the next sleeper; None if none is due by a time."""
        with self._lock:
            if not self._sleepers or self._sleepers[0].wake > target:
                return None
            self._now = max(self._now, self._sleepers[0].wake)
            due = []
            while self._sleepers and self._sleepers[0].wake <= self._now:
                due.append(heapq.heappop(self._sleepers))
            return due


def _wake(woken: asyncio.Future[None]) -> None:
    if not woken.done():
        woken.set_result(None)
