"""A script waits for what is done in the line's loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any, TypeVar

from tui.bus.api import ModbusLine
from tui.bus.errors import LineClosed

T = TypeVar("T")
LOOK_WHETHER_OPEN = 0.5
"""Seconds between two checks whether the line is open yet, for callers that wait for it."""


def waited(line: ModbusLine, work: Callable[[], Coroutine[Any, Any, T]]) -> T:
    """Do something in the line's loop, and wait for it. Raises what it raises, and LineClosed."""
    done: Future[T] = Future()

    async def carry_out() -> None:
        try:
            done.set_result(await work())
        except asyncio.CancelledError:
            done.set_exception(LineClosed())
            raise
        except Exception as error:
            done.set_exception(error)

    worker = line.spawn(carry_out, "script")
    try:
        while not done.done():
            try:
                return done.result(LOOK_WHETHER_OPEN)
            except TimeoutError:
                if worker.done() and not done.done():
                    raise LineClosed from None  # closed before it began
        return done.result()
    except BaseException:
        worker.cancel()
        raise
