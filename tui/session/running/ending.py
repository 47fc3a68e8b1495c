"""End of a command that would continue, and errors of a run that ended early.

A signal ends it, a time, or a reader that closes.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType

from tui.drive.errors import DriveError

from ..signals import handled, signal_name


class MotorStopped(DriveError):
    """A motor was stopped, but not by the end of its run; it is not started again."""


class MotorTripped(MotorStopped):
    """A motor was stopped by a fault of its drive."""


class NotStopped(DriveError):
    """A motor could not be stopped by this program: stop it at the machine."""


@dataclass(slots=True)
class Ending:
    """End of a command, with its reason; for one loop."""

    event: asyncio.Event = field(default_factory=asyncio.Event)
    why: str = ""
    number: int = 0
    """The signal that ended it; 0 if none did."""

    def end(self, why: str, number: int = 0) -> None:
        """End the command; the first reason is kept."""
        if not self.why:
            self.why, self.number = why, number
        self.event.set()

    @contextmanager
    def by_signals(self) -> Iterator[None]:
        """While inside, every signal only ends the command, however often it arrives."""
        loop = asyncio.get_running_loop()

        def handle(number: int, _frame: FrameType | None) -> None:
            loop.call_soon_threadsafe(self.end, f"ended by {signal_name(number)}", number)

        with handled(handle):
            yield
