"""Signals to a script that runs motors: the motors are stopped first, then the script ends."""

from __future__ import annotations

import asyncio
import signal
import threading
from contextlib import ExitStack, suppress
from types import FrameType
from typing import Any

from ..signals import BY_SIGNAL, handled, signal_name
from .guarded_run import GuardedRun

_guards: list[EndBySignal] = []
"""Those of the blocks that run a motor, the latest last."""
_handlers = ExitStack()
"""Puts the handlers back that were there before the first block of the main thread."""


class EndBySignal:
    """Lets a signal that would end the script stop its motors first.

    Handlers are set for blocks of the main thread only: without one, the signal ends the process,
    and the keeper of the line stops the motors.
    """

    def __init__(self, run: GuardedRun, task: asyncio.Task[Any] | None = None) -> None:
        """The signal cancels the `task` of a block; without one it raises inside the block."""
        self.run = run
        self.is_main = threading.current_thread() is threading.main_thread()
        self.is_leaving = False
        """True while the block ends: a signal must not interrupt the wait for standstill."""
        self._task = task
        self._late = 0

    def begin(self) -> None:
        """Handle signals from now on."""
        _forget(None)
        if self.is_main and not _main_guards():
            _handlers.enter_context(handled(_handle, in_script=True))
        _guards.append(self)

    def close(self) -> None:
        """Leave signals to what handled them before, unless another block runs a motor."""
        _forget(self)
        if self.is_main and not _main_guards():
            _handlers.close()

    def check(self) -> None:
        """Raise what a signal has to raise that came too late for that, or to a task."""
        number, self._late = self._late, 0
        if number:
            for guard in _guards:
                guard._late = 0
            raise _ending_of(number)

    @property
    def is_awaited(self) -> bool:
        """True until all motors are at rest, if a signal ends the script: asyncio waits for none
        of the other tasks."""
        return self._late != 0 and any(not guard.run.is_over.is_set() for guard in _guards)

    @property
    def is_over(self) -> bool:
        """True if the loop of the block was closed before the block could end."""
        return self._task is not None and self._task.get_loop().is_closed()

    def end_block(self, number: int, *, is_last: bool) -> None:
        """End this block; raises if it is of no task and the last one."""
        if self._task is not None:
            self._late = self._late or number
            with suppress(RuntimeError):  # its loop is closed
                self._task.get_loop().call_soon_threadsafe(self._task.cancel)
        elif is_last and self.is_leaving:
            self._late = self._late or number
        elif is_last:
            raise _ending_of(number)


def _forget(guard: EndBySignal | None) -> None:
    _guards[:] = [each for each in _guards if each is not guard and not each.is_over]


def _main_guards() -> list[EndBySignal]:
    return [guard for guard in _guards if guard.is_main]


def _handle(number: int, _frame: FrameType | None) -> None:
    for guard in tuple(_guards):
        guard.run.end(f"ended by {signal_name(number)}")
    blocks = [guard for guard in _main_guards() if not guard.is_over]
    if not blocks:
        raise _ending_of(number)
    for guard in blocks:
        guard.end_block(number, is_last=guard is blocks[-1])


def _ending_of(number: int) -> BaseException:
    if number == signal.SIGINT:
        return KeyboardInterrupt()
    return SystemExit(BY_SIGNAL + number)
