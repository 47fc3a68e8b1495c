"""`with drive.running(...)`: a motor that runs for a block, and is stopped at its every end."""

from __future__ import annotations

import asyncio
import math
import signal
import threading
import time
from contextlib import ExitStack, suppress
from types import FrameType
from typing import Any, Self

from tui.drive.chart import Direction

from ..running.ending import NotStopped
from ..signals import BY_SIGNAL, handled, signal_name
from .drive_calls import DriveCalls
from .guarded_run import GuardedRun

END_OF_BLOCK = "the block has ended"
ENDED_CHECK_INTERVAL = 0.5
"""Seconds between two checks if the line is still open; a thread can be interrupted in between."""
WAIT_INTERVAL = 0.05
"""Seconds between two looks of a task at a run."""


class GuardedMotor:
    """A motor that runs for a block, and how the block ends."""

    def __init__(self, calls: DriveCalls, direction: Direction, reference: str | None) -> None:
        self._calls = calls
        self._signals: EndBySignal
        self._run: GuardedRun = calls.run(direction, reference)

    @property
    def ended(self) -> str:
        """Why the motor was stopped before the end of the block; empty while it runs."""
        return str(self._run.error or "") if self._run.is_over.is_set() else ""

    def _begin(self) -> None:
        self._run.begin(self._calls.permit("Run it"))

    def _raise_end(self, error: BaseException | None) -> None:
        """Raise what the script has to know; `error` is what ends the block, if not its end.

        A motor that runs on replaces every error. One that was stopped early is a note to it.
        """
        found = self._run.error
        if found is None or found is error:
            return
        if error is None or isinstance(found, NotStopped):
            raise found
        error.add_note(str(found))


class RunningMotor(GuardedMotor):
    """A motor that runs until the block ends."""

    def wait(self, seconds: float = math.inf) -> None:
        """Let the motor run for so many seconds. Raises MotorStopped as soon as it stops early."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0 and not self._run.is_over.is_set():
            self._run.is_over.wait(min(left, ENDED_CHECK_INTERVAL))
        if self._run.error is not None:
            raise self._run.error

    def __enter__(self) -> Self:
        self._signals = EndBySignal(self._run)
        self._signals.begin()
        try:
            self._begin()
            while not self._run.is_started.wait(ENDED_CHECK_INTERVAL):
                self._run.settle()
            if self._run.error is not None:
                raise self._run.error
        except BaseException as error:
            self._leave(error)
            raise
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        self._leave(error)

    def _leave(self, error: BaseException | None) -> None:
        """Bring the motor to rest; what interrupts that is raised afterwards."""
        self._signals.is_leaving = True
        interruption: BaseException | None = None
        while not self._run.is_over.is_set():
            try:
                self._run.end(END_OF_BLOCK)
                self._run.settle()
                self._run.is_over.wait(ENDED_CHECK_INTERVAL)
            except BaseException as late:
                interruption = interruption or late
        self._signals.close()
        self._raise_end(error or interruption)
        if interruption is not None:
            raise interruption
        self._signals.check()


class AsyncRunningMotor(GuardedMotor):
    """A motor that runs until the `async with` block ends."""

    async def wait(self, seconds: float = math.inf) -> None:
        """As `RunningMotor.wait`."""
        end = time.monotonic() + seconds
        while not self._run.is_over.is_set():
            if (left := end - time.monotonic()) <= 0:
                break
            await asyncio.sleep(min(left, WAIT_INTERVAL))
        if self._run.error is not None:
            raise self._run.error

    async def __aenter__(self) -> Self:
        self._signals = EndBySignal(self._run, asyncio.current_task())
        self._signals.begin()
        try:
            self._begin()
            while not self._run.is_started.is_set():
                self._run.settle()
                await asyncio.sleep(WAIT_INTERVAL)
            if self._run.error is not None:
                raise self._run.error
        except BaseException as error:
            await self._leave(error)
            raise
        return self

    async def __aexit__(self, _: object, error: BaseException | None, __: object) -> None:
        await self._leave(error)

    async def _leave(self, error: BaseException | None) -> None:
        """Bring the motor to rest; a cancellation in the meantime is raised afterwards."""
        self._signals.is_leaving = True
        cancelled: asyncio.CancelledError | None = None
        while not self._run.is_over.is_set() or self._signals.is_awaited:
            try:
                self._run.end(END_OF_BLOCK)
                self._run.settle()
                await asyncio.sleep(WAIT_INTERVAL)
            except asyncio.CancelledError as late:
                cancelled = cancelled or late
        self._signals.close()
        self._raise_end(error or cancelled)
        self._signals.check()
        if cancelled is not None:
            raise cancelled


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
