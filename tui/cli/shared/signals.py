"""The end by a signal: the terminal hangs up, or the system asks the panel or a command to go."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol

log = logging.getLogger(__name__)

NAMES = ("SIGHUP", "SIGTERM")
"""Without a handler the process would die with motors running and nothing cleaned up."""
CLEANED_UP = 3.0
"""Seconds that the screen has to end by itself; a terminal that is gone may keep it from that."""


class Stoppable(Protocol):
    """The panel as far as its end needs it."""

    def stop_motors(self) -> bool:
        """Stop every motor that runs by an order from here; False where one runs on."""

    def leave_now(self) -> None:
        """End the screen; may be called in any thread."""


@contextmanager
def ending_by_signal(panel: Stoppable, *, stop: bool) -> Iterator[None]:
    """While inside, SIGHUP and SIGTERM stop the motors first (with `stop`), then end the panel."""
    begun = threading.Lock()

    def end(number: int) -> None:
        log.warning("ended by %s", signal.Signals(number).name)
        if stop and not panel.stop_motors():
            log.error("a motor could not be stopped before the panel ended")
        last_resort = threading.Timer(CLEANED_UP, os._exit, (128 + number,))
        last_resort.daemon = True
        last_resort.start()
        panel.leave_now()

    def handle(number: int, _frame: FrameType | None) -> None:
        # in a thread: the main one may be stuck with a terminal that takes nothing any more
        if begun.acquire(blocking=False):
            threading.Thread(target=end, args=(number,), name="end").start()

    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


LAST_WORDS = 5.0
"""Seconds that a command has to end after a signal; an output that takes nothing may keep it."""


@contextmanager
def cancelled_by_signal(task: asyncio.Task[object]) -> Iterator[list[int]]:
    """While inside, SIGHUP and SIGTERM cancel a task; the number of the signal is handed out.

    A second one ends the process at once, as it would have. A hangup that the person ignores on
    purpose (nohup) stays ignored.
    """
    came: list[int] = []
    loop = task.get_loop()

    def handle(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        signal.signal(number, signal.SIG_DFL)
        last_resort = threading.Timer(LAST_WORDS, os._exit, (128 + number,))
        last_resort.daemon = True
        last_resort.start()
        loop.call_soon_threadsafe(task.cancel)

    if threading.current_thread() is not threading.main_thread():
        yield came
        return
    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {n: signal.getsignal(n) for n in numbers if signal.getsignal(n) != signal.SIG_IGN}
    for number in before:
        signal.signal(number, handle)
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
