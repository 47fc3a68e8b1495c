"""Signals to a program: one ends its motors first, and none suspends it."""

from __future__ import annotations

import itertools
import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Protocol

from tui.session.signals import (
    BY_SIGNAL,
    OF_ERRORS,
    SUSPENDING,
    handled,
    signal_name,
    signal_numbers,
)

if TYPE_CHECKING:
    import asyncio

log = logging.getLogger(__name__)

CLEANED_UP = 3.0
"""Seconds that the screen has to close; a closed terminal may prevent it."""
A_MOMENT = 0.2
"""Seconds that a thread has to end, and until the screen is closed again: it may open late."""
SUSPENDED = (
    "{} is ignored: while suspended, this program would hold the line and could not stop a motor."
)
PRESS_CTRL_C = "Press Ctrl-C to end it."


@contextmanager
def never_suspended(tell: Callable[[str], None] | None = None) -> Iterator[None]:
    """While inside, nothing but SIGSTOP suspends the program; The callback gets a sentence for it.

    To be entered before threads start that belong to the line: what the main thread holds back
    here, they hold back too. Signals of errors that another program sends become SIGTERM.
    """
    held = signal_numbers((*SUSPENDING, *OF_ERRORS))
    main = threading.current_thread() is threading.main_thread()
    if not main or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    over, suspending = threading.Event(), signal_numbers(SUSPENDING)

    def wait() -> None:
        while (number := signal.sigwait(held)) and not over.is_set():
            name = signal_name(number)
            log.warning("%s arrived", name)
            if number in suspending:
                (tell or _complain)(SUSPENDED.format("Ctrl-Z" if name == "SIGTSTP" else name))
            else:
                os.kill(os.getpid(), signal.SIGTERM)

    before = signal.pthread_sigmask(signal.SIG_BLOCK, held)
    waiting = threading.Thread(target=wait, name="signals", daemon=True)
    waiting.start()
    try:
        yield
    finally:
        over.set()
        signal.pthread_kill(waiting.ident or 0, min(held))
        waiting.join(A_MOMENT)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _complain(text: str) -> None:
    from .say import say_beside  # the panel does without click

    say_beside(f"drivepanel: {text} {PRESS_CTRL_C}", err=True)


class Arrivals:
    """Numbers of the signals that have come, and which of them was the first.

    A handler may be interrupted by the next signal between any two of its steps: two programs that
    see the end of one terminal send two signals at once. To count in one step, and to decide by
    that count, keeps one of them the first.
    """

    def __init__(self) -> None:
        self.numbers: list[int] = []
        self._order = itertools.count()

    def note(self, number: int) -> bool:
        """Note a signal; True for the first one."""
        first = next(self._order) == 0
        self.numbers.insert(0, number) if first else self.numbers.append(number)
        return first


class Stoppable(Protocol):
    """The panel as far as its end needs it."""

    @property
    def failed(self) -> bool:
        """True if an error of its own ends it."""

    def stop_motors(self) -> bool:
        """Stop every motor that runs by an order from here; False where one runs on."""

    def leave_now(self) -> None:
        """End the screen; may be called in any thread."""


@contextmanager
def ending_by_signal(panel: Stoppable, *, stop: bool) -> Iterator[list[int]]:
    """While inside, a signal stops the motors first (with `stop`), then ends the panel.

    The number of the first signal is handed out. A hangup ends the panel even if it is ignored: a
    panel without its terminal commands nothing. After an internal error SIGINT changes nothing.
    """
    came = Arrivals()
    ended = threading.Event()

    def end(number: int) -> None:
        log.warning("ended by %s", signal_name(number))
        try:
            stopped = not stop or panel.stop_motors()
        except BaseException:
            # a panel that stays without its terminal would keep its drives alive unseen
            log.exception("the stops of a panel that ends")
            stopped = False
        if not stopped:
            log.error("a motor could not be stopped before the panel ended")
        last_resort = threading.Timer(CLEANED_UP, os._exit, (BY_SIGNAL + number,))
        last_resort.daemon = True
        last_resort.start()
        while True:
            try:
                panel.leave_now()
            except Exception:
                log.exception("the end of the panel")
            if ended.wait(A_MOMENT):
                return

    def handle(number: int, _frame: FrameType | None) -> None:
        if number == signal.SIGINT and panel.failed:
            return
        if came.note(number):
            # in a thread: the main one may be stuck with a terminal that takes nothing any more
            threading.Thread(target=end, args=(number,), name="end").start()

    with handled(handle, always="SIGHUP"):
        try:
            yield came.numbers
        finally:
            ended.set()


LAST_WORDS = 5.0
"""Seconds that a command has to end after a signal; an output that takes nothing may keep it."""


@contextmanager
def cancelled_by_signal(task: asyncio.Task[object]) -> Iterator[list[int]]:
    """While inside, a signal cancels a task; its number is handed out. Ctrl-C does as ever.

    The same signal a second time ends the process at once, as it would have; others that follow
    the first one change nothing.
    """
    came = Arrivals()
    loop = task.get_loop()

    def handle(number: int, _frame: FrameType | None) -> None:
        first = came.note(number)
        signal.signal(number, signal.SIG_DFL)
        if not first:
            return
        last_resort = threading.Timer(LAST_WORDS, os._exit, (BY_SIGNAL + number,))
        last_resort.daemon = True
        last_resort.start()
        loop.call_soon_threadsafe(task.cancel)

    with handled(handle, but="SIGINT"):
        yield came.numbers


@contextmanager
def interrupted_by_signal() -> Iterator[list[int]]:
    """While inside, the first signal is a KeyboardInterrupt, like Ctrl-C; yields its number.

    Raises Failure if the block lets it through.
    """
    from .errors import Failure

    came = Arrivals()

    def handle(number: int, _frame: FrameType | None) -> None:
        if came.note(number):
            raise KeyboardInterrupt

    try:
        with handled(handle, but="SIGINT"):
            yield came.numbers
    except KeyboardInterrupt:
        if not (numbers := came.numbers):
            raise
        raise Failure(f"Ended by {signal_name(numbers[0])}.", BY_SIGNAL + numbers[0]) from None
