"""The end of a command that would run on: by a signal, after a time, with its reader."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from types import FrameType

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


@dataclass(slots=True)
class Ending:
    """Whether the command is to end, and why; belongs to the loop."""

    event: asyncio.Event = field(default_factory=asyncio.Event)
    why: str = ""

    def end(self, why: str) -> None:
        """End the command; the first reason stays."""
        self.why = self.why or why
        self.event.set()

    @contextmanager
    def by_signals(self) -> Iterator[None]:
        """While inside, signals end the command and nothing else, however often they come."""
        loop = asyncio.get_running_loop()
        numbers = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
        # a hangup that the person has ignored on purpose (nohup) stays ignored
        numbers = [
            number
            for number in numbers
            if number == signal.SIGINT or signal.getsignal(number) != signal.SIG_IGN
        ]
        before = {number: signal.getsignal(number) for number in numbers}
        for number in numbers:
            self._handle(loop, number)
        try:
            yield
        finally:
            for number, handler in before.items():
                with suppress(NotImplementedError):
                    loop.remove_signal_handler(number)
                signal.signal(number, handler)

    def _handle(self, loop: asyncio.AbstractEventLoop, number: int) -> None:
        why = f"ended by {signal.Signals(number).name}"
        try:
            loop.add_signal_handler(number, self.end, why)
        except NotImplementedError:  # Windows

            def handle(_number: int, _frame: FrameType | None) -> None:
                loop.call_soon_threadsafe(self.end, why)

            signal.signal(number, handle)
