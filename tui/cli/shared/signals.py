"""The end of the panel by a signal: the terminal hangs up, or the system asks it to go."""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
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


class _Ended(BaseException):
    """A signal ends the command."""


@contextmanager
def cleaned_up(clean_up: Callable[[], object]) -> Iterator[None]:
    """Clean up whatever ends what is inside, SIGHUP and SIGTERM too, which then end the program.

    Others on the line would else take a program that was ended for one that was killed.
    """

    def end(number: int, _frame: FrameType | None) -> None:
        raise _Ended(number)

    before = {}
    if threading.current_thread() is threading.main_thread():
        numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
        # what the program was started to ignore (nohup) stays ignored
        ours = [one for one in numbers if signal.getsignal(one) == signal.SIG_DFL]
        before = {number: signal.signal(number, end) for number in ours}
    ended_by: int | None = None
    try:
        yield
    except _Ended as ended:
        (ended_by,) = ended.args
    finally:
        # a second one ends the program at once
        for number, handler in before.items():
            signal.signal(number, handler)
        clean_up()
    if ended_by is not None:
        os.kill(os.getpid(), ended_by)
