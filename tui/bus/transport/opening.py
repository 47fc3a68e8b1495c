"""Opening and closing a serial port in a thread: the system may take seconds, or never return."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import TypeVar

from ..errors import LineLost

T = TypeVar("T")

OPENS_WITHIN = 10.0
"""Timeout of the system for opening a port, in seconds."""

CLOSES_WITHIN = 0.5
"""Seconds for which a line waits until the system has closed its port, and sent the last bytes."""

_ABANDONED: set[str] = set()
"""Paths of ports that are still being opened or closed, though nothing waits for them."""


async def opened_beside(
    path: str,
    open_port: Callable[[], T],
    drop: Callable[[T], object],
    within: float = OPENS_WITHIN,
) -> T:
    """Open a port or file while the loop goes on; `drop` closes one that nothing waits for.

    Raises LineLost if the system does not open it in time, and what `open_port` raises.
    """
    hangs = f"{path} cannot be opened: the system does not answer. Plug its adapter in again."
    if path in _ABANDONED:
        raise LineLost(hangs)
    opening: Future[T] = Future()
    opening.set_running_or_notify_cancel()
    threading.Thread(target=_open, args=(opening, open_port), name="open", daemon=True).start()
    taken = False
    try:
        async with asyncio.timeout(within):
            port = await asyncio.wrap_future(opening)
        taken = True
    except TimeoutError:
        raise LineLost(hangs) from None
    finally:
        if not taken:
            _ABANDONED.add(path)
            opening.add_done_callback(lambda _: _end(path, opening, drop))
    return port


def closed_beside(path: str, close: Callable[[], object]) -> None:
    """Close a port; if the system takes too long, it goes on alone, and opens no such port yet.

    The loop of the line waits for it, so that the port is usually closed afterwards.
    """

    guard, closed = threading.Lock(), threading.Event()

    def work() -> None:
        with suppress(OSError):
            close()
        with guard:
            closed.set()
            _ABANDONED.discard(path)

    threading.Thread(target=work, name="close", daemon=True).start()
    closed.wait(CLOSES_WITHIN)
    with guard:
        if not closed.is_set():
            _ABANDONED.add(path)


def _open(opening: Future[T], open_port: Callable[[], T]) -> None:
    try:
        opening.set_result(open_port())
    except BaseException as error:
        opening.set_exception(error)


def _end(path: str, opening: Future[T], drop: Callable[[T], object]) -> None:
    _ABANDONED.discard(path)
    if opening.exception() is None:
        drop(opening.result())
