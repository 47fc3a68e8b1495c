"""`with drive.running(...)`: a motor that runs for a block, and is stopped at its every end."""

from __future__ import annotations

import asyncio
import math
import time
from types import TracebackType
from typing import Self

from tui.drive.chart import Direction

from ..running.errors import NotStopped
from .drive_calls import DriveCalls
from .end_by_signal import EndBySignal
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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
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

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
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
