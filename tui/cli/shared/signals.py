"""Signals: those that end a program, its motors first, and those that may not suspend it."""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import asyncio

log = logging.getLogger(__name__)

BY_SIGNAL = 128
"""The exit status of a program that a signal ended, less the signal's number."""

UNTOUCHED = (
    "SIGKILL", "SIGSTOP", "SIGCHLD", "SIGCONT", "SIGINFO", "SIGPIPE", "SIGURG", "SIGWINCH",
)  # fmt: skip
"""No program catches the first two. The others end no process, SIGPIPE not in Python."""
SUSPENDING = ("SIGTSTP", "SIGTTIN", "SIGTTOU")
"""A suspended program still holds its line, and does not stop its motor."""
OF_ERRORS = ("SIGSEGV", "SIGBUS", "SIGFPE", "SIGILL")
"""A handler would return to the instruction that failed, forever: sent by another program they
end this one in order, caused by an error of its own they end it immediately."""
OF_KEYS = ("SIGINT", "SIGQUIT")
"""Ctrl-C and Ctrl-\\: a script ignores them for what it starts in the background."""

CLEANED_UP = 3.0
"""Seconds that the screen has to close; a terminal that is gone may keep it from that."""
A_MOMENT = 0.2
"""Seconds that a thread has to end, and until the screen is closed again: it may open late."""
SUSPENDED = (
    "{} is ignored: while suspended, this program would hold the line and could not stop a motor."
)
PRESS_CTRL_C = "Press Ctrl-C to end it."

_taken: set[int] = set()
"""Signals that are handled here now."""

Handler = Callable[[int, FrameType | None], object]


def signal_name(number: int) -> str:
    """The name of a signal; a real-time signal has none of its own."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"SIGRTMIN+{number - signal.SIGRTMIN}"


def ending_signals() -> frozenset[int]:
    """Every signal that ends a process by default and that a handler can take."""
    others = _numbers((*UNTOUCHED, *SUSPENDING, *OF_ERRORS))
    return frozenset(map(int, signal.valid_signals())) - others


def _numbers(names: Collection[str]) -> frozenset[int]:
    return frozenset(int(getattr(signal, name)) for name in names if hasattr(signal, name))


@contextmanager
def handled(handle: Handler, *, but: str = "", always: str = "") -> Iterator[None]:
    """While inside, signals that would end the process go to a handler instead.

    A signal that the person ignores on purpose (nohup) stays ignored, unless keys send it or it is
    the one named by `always`. One that other code of this process handles stays with it, and the
    one named by `but`. Outside the main thread nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    kept, wanted = _numbers((but,)), _numbers((*OF_KEYS, always)) | _taken
    before = {number: signal.getsignal(number) for number in ending_signals() - kept}
    before = {n: h for n, h in before.items() if h == signal.SIG_DFL or (n in wanted and h)}
    new = before.keys() - _taken
    _taken.update(new)
    for number in before:
        signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        _taken.difference_update(new)


@contextmanager
def never_suspended(tell: Callable[[str], None] | None = None) -> Iterator[None]:
    """While inside, nothing but SIGSTOP suspends the program; The callback gets a sentence for it.

    To be entered before threads start that belong to the line: what the main thread holds back
    here, they hold back too. Signals of errors that another program sends become SIGTERM.
    """
    held = _numbers((*SUSPENDING, *OF_ERRORS))
    main = threading.current_thread() is threading.main_thread()
    if not main or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    over, suspending = threading.Event(), _numbers(SUSPENDING)

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
    came: list[int] = []
    ended = threading.Event()

    def end(number: int) -> None:
        log.warning("ended by %s", signal_name(number))
        if stop and not panel.stop_motors():
            log.error("a motor could not be stopped before the panel ended")
        last_resort = threading.Timer(CLEANED_UP, os._exit, (BY_SIGNAL + number,))
        last_resort.daemon = True
        last_resort.start()
        panel.leave_now()
        while not ended.wait(A_MOMENT):
            panel.leave_now()

    def handle(number: int, _frame: FrameType | None) -> None:
        if number == signal.SIGINT and panel.failed:
            return
        came.append(number)
        if len(came) == 1:
            # in a thread: the main one may be stuck with a terminal that takes nothing any more
            threading.Thread(target=end, args=(number,), name="end").start()

    with handled(handle, always="SIGHUP"):
        try:
            yield came
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
    came: list[int] = []
    loop = task.get_loop()

    def handle(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        signal.signal(number, signal.SIG_DFL)
        if len(came) > 1:
            return
        last_resort = threading.Timer(LAST_WORDS, os._exit, (BY_SIGNAL + number,))
        last_resort.daemon = True
        last_resort.start()
        loop.call_soon_threadsafe(task.cancel)

    with handled(handle, but="SIGINT"):
        yield came


@contextmanager
def interrupted_by_signal() -> Iterator[list[int]]:
    """While inside, the first signal is a KeyboardInterrupt, like Ctrl-C; yields its number.

    Raises Failure if the block lets it through.
    """
    from .errors import Failure

    came: list[int] = []

    def handle(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        if len(came) == 1:
            raise KeyboardInterrupt

    try:
        with handled(handle, but="SIGINT"):
            yield came
    except KeyboardInterrupt:
        if not came:
            raise
        raise Failure(f"Ended by {signal_name(came[0])}.", BY_SIGNAL + came[0]) from None
