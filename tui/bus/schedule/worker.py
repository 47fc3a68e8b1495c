"""Coroutines at work in the line's loop, with a handle for any thread."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any

log = logging.getLogger(__name__)

ThreadWork = Callable[[], Coroutine[Any, Any, object]]


class Worker:
    """A coroutine at work in the line's loop; made by Line.spawn()."""

    def __init__(self, work: ThreadWork, name: str, loop: asyncio.AbstractEventLoop) -> None:
        self.name = name
        self.error: BaseException | None = None
        """Error that ended the worker."""
        self._work = work
        self._loop = loop
        self._task: asyncio.Task[object] | None = None
        self._cancelled = False
        self._ended: Future[None] = Future()

    def start(self) -> asyncio.Task[object] | None:
        """Begin the work; called in the line's loop. None when it was cancelled before."""
        if self._cancelled:
            self._ended.set_result(None)
            return None
        self._task = self._loop.create_task(self._run(), name=self.name)
        self._task.add_done_callback(self._done)
        return self._task

    async def _run(self) -> object:
        # called here, so that an error in making the coroutine ends the work like any other
        return await self._work()

    def abandon(self) -> None:
        """The line closed before the work could begin."""
        if not self._ended.done():
            self._ended.set_result(None)

    def break_off(self, error: Exception) -> None:
        """An internal error kept the work from being begun."""
        self.error = error
        self.abandon()

    def _done(self, task: asyncio.Task[object]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            self.error = error
            log.error("%s ended by an error", self.name, exc_info=error)
        self._ended.set_result(None)

    def cancel(self) -> None:
        """Ask the work to end; may be called from any thread, and more than once."""
        self._cancelled = True
        try:
            self._loop.call_soon_threadsafe(self._cancel)
        except RuntimeError:
            # the loop has ended, and the work with it
            return

    def _cancel(self) -> None:
        if self._task is not None:
            self._task.cancel()

    def done(self) -> bool:
        """Return True if the work has ended: completed, by cancel() or by an error."""
        return self._ended.done()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait from another thread until the work has ended; False when the time is up."""
        try:
            self._ended.result(timeout)
        except TimeoutError:
            return False
        return True
