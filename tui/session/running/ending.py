"""The end of a command that would run on: by a signal, after a time, with its reader."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType

from ..signals import handled, signal_name


@dataclass(slots=True)
class Ending:
    """True if the command is to end, and why; belongs to the loop."""

    event: asyncio.Event = field(default_factory=asyncio.Event)
    why: str = ""
    number: int = 0
    """The signal that ended it; 0 where none did."""

    def end(self, why: str, number: int = 0) -> None:
        """End the command; the first reason stays."""
        if not self.why:
            self.why, self.number = why, number
        self.event.set()

    @contextmanager
    def by_signals(self) -> Iterator[None]:
        """While inside, signals end the command and nothing else, however often they come."""
        loop = asyncio.get_running_loop()

        def handle(number: int, _frame: FrameType | None) -> None:
            loop.call_soon_threadsafe(self.end, f"ended by {signal_name(number)}", number)

        with handled(handle):
            yield
