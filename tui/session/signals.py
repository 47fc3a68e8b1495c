"""Signals that end a program, and their handlers."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from types import FrameType

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

HANDLED_WITHIN = 0.5
"""Seconds within which the main thread runs the handler of a signal that another thread took."""

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
    others = signal_numbers((*UNTOUCHED, *SUSPENDING, *OF_ERRORS))
    return frozenset(map(int, signal.valid_signals())) - others


def signal_numbers(names: Collection[str]) -> frozenset[int]:
    """The numbers of those that this system has."""
    return frozenset(int(getattr(signal, name)) for name in names if hasattr(signal, name))


def wait_for(event: threading.Event) -> None:
    """Return once an event is set; until then the main thread runs the handlers of signals.

    Only the main thread runs them. The system may give a signal to another thread, which happens
    on a busy computer. A wait without a timeout does not end then: the signal has no effect.
    """
    while not event.wait(HANDLED_WITHIN):
        pass


@contextmanager
def handled(
    handle: Handler, *, but: str = "", always: str = "", in_script: bool = False
) -> Iterator[None]:
    """While inside, signals that would end the process go to a handler instead.

    A signal that the person ignores on purpose (nohup) stays ignored, unless keys send it or it is
    the one named by `always`. One that other code of this process handles stays with it, and the
    one named by `but`. `in_script`: this also applies to keys. Outside the main thread nothing
    changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {n: signal.getsignal(n) for n in ending_signals() - signal_numbers((but,))}
    if in_script:
        usual = (signal.SIG_DFL, signal.default_int_handler)
        before = {n: h for n, h in before.items() if h in usual}
    else:
        wanted = signal_numbers((*OF_KEYS, always)) | _taken
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
