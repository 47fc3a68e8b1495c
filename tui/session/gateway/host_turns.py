"""Shares a line out among the hosts that Modbus TCP clients come from."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Coroutine, Hashable
from contextlib import asynccontextmanager
from typing import Any, TypeVar

T = TypeVar("T")

READS_EACH_HOST = 8
"""Reads of the clients of one host that wait for the line at once."""


READING, DECIDING, STOPPING = "read", "read before a stop", "stop"
SLOTS = {READING: READS_EACH_HOST, DECIDING: 1, STOPPING: 1}
MOST_IN_VAIN, IN_VAIN_LASTS = 5, 10.0
"""Words of a host that turned out to be no stop, in so many seconds, until its reads wait."""


class HostTurns:
    """One stop of each host at a time, and few reads; for one line and one loop.

    So a host that floods the line with requests does not hold up a stop of another one. A stop
    waits for no read before another stop: it goes out as soon as its own read has come.
    """

    def __init__(self) -> None:
        self._slots: dict[tuple[str, str], tuple[asyncio.Semaphore, int]] = {}
        """By host and kind of request, with the count of those that use or want one."""
        self._waiting: dict[tuple[str, Hashable], asyncio.Future[Any]] = {}
        """Stops, and reads before them, that have not been sent yet."""
        self._in_vain: dict[str, deque[float]] = {}
        """By host, when something was read for words that turned out to be no stop."""

    @asynccontextmanager
    async def reading(self, host: str) -> AsyncIterator[None]:
        """Wait for the turn of a read."""
        async with self._slot(host, READING):
            yield

    @asynccontextmanager
    async def _slot(self, host: str, kind: str) -> AsyncIterator[None]:
        which = host, kind
        slots, users = self._slots.get(which, (asyncio.Semaphore(SLOTS[kind]), 0))
        self._slots[which] = slots, users + 1
        try:
            async with slots:
                yield
        finally:
            slots, users = self._slots.pop(which)
            if users > 1:
                self._slots[which] = slots, users - 1

    def may_hurry(self, host: str) -> bool:
        """False if reads before stops of this host were often in vain: they go as commands do."""
        last = self._in_vain.get(host, deque[float]())
        now = asyncio.get_running_loop().time()
        return len(last) < MOST_IN_VAIN or now - last[0] > IN_VAIN_LASTS

    def note_in_vain(self, host: str) -> None:
        """Count a read before a command of this host."""
        now = asyncio.get_running_loop().time()
        self._in_vain = {h: t for h, t in self._in_vain.items() if now - t[-1] <= IN_VAIN_LASTS}
        self._in_vain.setdefault(host, deque(maxlen=MOST_IN_VAIN)).append(now)

    async def deciding(
        self, host: str, codes: Hashable, read: Callable[[], Coroutine[Any, Any, T]]
    ) -> T:
        """Read what decides about a stop in the turn of its host; a like one does for both."""
        return await self._shared(host, DECIDING, codes, read)

    async def stopping(
        self, host: str, word: Hashable, send: Callable[[], Coroutine[Any, Any, T]]
    ) -> T:
        """Send a stop in the turn of its host; one like it that waits already does for both."""
        return await self._shared(host, STOPPING, word, send)

    async def _shared(
        self, host: str, kind: str, what: Hashable, send: Callable[[], Coroutine[Any, Any, T]]
    ) -> T:
        which = host, (kind, what)
        while (first := self._waiting.get(which)) is not None:
            try:
                shared: T = await asyncio.shield(first)
                return shared
            except asyncio.CancelledError:
                task = asyncio.current_task()
                if not first.cancelled() or (task is not None and task.cancelling()):
                    raise
        mine = self._waiting[which] = asyncio.get_running_loop().create_future()
        try:
            async with self._slot(host, kind):
                del self._waiting[which]  # one that comes from here on is sent, too
                mine.set_result(await send())
        except Exception as error:
            mine.set_exception(error)
            mine.exception()  # perhaps no other one waits
            raise
        finally:
            if self._waiting.get(which) is mine:
                del self._waiting[which]
            mine.cancel()
        done: T = mine.result()
        return done
