"""Shares a line out among the hosts that Modbus TCP clients come from."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine, Hashable
from contextlib import asynccontextmanager
from typing import Any, TypeVar

T = TypeVar("T")

READS_EACH_HOST = 8
"""Reads of the clients of one host that wait for the line at once."""


class HostTurns:
    """One stop of each host at a time, and few reads; for one line and one loop.

    So a host that floods the line with requests does not hold up a stop of another one.
    """

    def __init__(self) -> None:
        self._slots: dict[tuple[str, int], tuple[asyncio.Semaphore, int]] = {}
        """By host and number of slots, with the count of those that use or want one."""
        self._waiting: dict[tuple[str, Hashable], asyncio.Future[Any]] = {}
        """Stops that have not been sent yet."""

    @asynccontextmanager
    async def reading(self, host: str) -> AsyncIterator[None]:
        """Wait for the turn of a read."""
        async with self._slot(host, READS_EACH_HOST):
            yield

    @asynccontextmanager
    async def _slot(self, host: str, most: int) -> AsyncIterator[None]:
        which = host, most
        slots, users = self._slots.get(which, (asyncio.Semaphore(most), 0))
        self._slots[which] = slots, users + 1
        try:
            async with slots:
                yield
        finally:
            slots, users = self._slots.pop(which)
            if users > 1:
                self._slots[which] = slots, users - 1

    async def urgent(
        self, host: str, word: Hashable, send: Callable[[], Coroutine[Any, Any, T]]
    ) -> T:
        """Send a stop in the turn of its host; one like it that waits already does for both.

        So does the read before it.
        """
        which = host, word
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
            async with self._slot(host, 1):
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
