"""A script waits for work in the line's loop: blocking, or in an asyncio loop of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any, Generic, TypeVar

from tui.bus.api import ModbusLine
from tui.bus.errors import LineClosed

T = TypeVar("T")
LineWork = Callable[[], Coroutine[Any, Any, T]]
"""Makes a coroutine in the line's loop."""
OPEN_CHECK_INTERVAL = 0.5
"""Seconds between two checks if the line is still open, for callers that wait for it."""


class LineCall(Generic[T]):
    """One piece of work in the line's loop. Raises LineClosed."""

    def __init__(self, line: ModbusLine, work: LineWork[T]) -> None:
        self.done: Future[T] = Future()
        """Its result or error; LineClosed if the line was closed first."""
        self.done.set_running_or_notify_cancel()  # a caller that leaves does not cancel it
        self._work = work
        self._worker = line.spawn(self._carry_out, "script")

    async def _carry_out(self) -> None:
        try:
            self.done.set_result(await self._work())
        except asyncio.CancelledError:
            self.done.set_exception(LineClosed())
            raise
        except Exception as error:
            self.done.set_exception(error)

    def check_open(self) -> None:
        """Raise LineClosed if the line was closed before the work began."""
        if self._worker.done() and not self.done.done():
            raise LineClosed

    def cancel(self) -> None:
        """Send nothing more of it; an exchange in flight ends as usual."""
        self._worker.cancel()


def waited(line: ModbusLine, work: LineWork[T]) -> T:
    """Do something in the line's loop, and wait for it. Raises what it raises, and LineClosed."""
    call = LineCall(line, work)
    try:
        while not call.done.done():
            try:
                return call.done.result(OPEN_CHECK_INTERVAL)
            except TimeoutError:
                call.check_open()
        return call.done.result()
    except BaseException:
        call.cancel()
        raise


async def awaited(line: ModbusLine, work: LineWork[T]) -> T:
    """Do the same for a caller in any asyncio loop; its cancellation ends the work as Ctrl-C does.

    The line's loop ends an exchange in flight, so that no late reply is taken for another's.
    """
    call = LineCall(line, work)
    future = asyncio.wrap_future(call.done)
    try:
        while not future.done():
            await asyncio.wait({future}, timeout=OPEN_CHECK_INTERVAL)
            call.check_open()
        return future.result()
    except BaseException:
        future.cancel()
        call.cancel()
        raise


async def uninterrupted(work: Callable[[], T]) -> T:
    """Run blocking work in a thread, to its end; a cancellation in the meantime is raised then."""
    future = asyncio.get_running_loop().run_in_executor(None, work)
    cancelled: asyncio.CancelledError | None = None
    while not future.done():
        try:
            await asyncio.wait({future})
        except asyncio.CancelledError as error:
            cancelled = error
    result = future.result()
    if cancelled is not None:
        raise cancelled
    return result
