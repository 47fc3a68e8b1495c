"""Drives that answered and of which nothing is known: asked on, as any of them may watch the line.

What they do when they are asked no more is in no profile, so they are taken for the strictest.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from functools import partial

from tui.bus.api import LineWorker, ModbusLine, Priority
from tui.bus.errors import DeviceException, LineClosed, LineError
from tui.drive.finding import PresenceProbe, presence_probes

from ..clock import REAL_CLOCK, Clock
from ..connect.strangers import known_profiles
from .line_watch import ASKED_PER_TIMEOUT, UNKNOWN_TIMEOUT

STRANGER_PERIOD = UNKNOWN_TIMEOUT / ASKED_PER_TIMEOUT
"""Seconds from one question to the next."""


class StrangersAsked:
    """Asks each of them by the question that finds drives; whatever it answers, it was asked."""

    def __init__(self, line: ModbusLine, clock: Clock = REAL_CLOCK) -> None:
        self._line, self._clock = line, clock
        self._workers: dict[int, LineWorker] = {}

    def keep(self, device: int) -> None:
        """Ask a drive on from now on."""
        self.let_go(device)
        work = partial(self._again, device)
        with suppress(LineClosed):  # nobody is asked any more
            self._workers[device] = self._line.spawn(work, f"stranger {device}")

    def let_go(self, device: int) -> None:
        """Its profile is known: somebody else looks after it."""
        if (worker := self._workers.pop(device, None)) is not None:
            worker.cancel()

    def stop(self) -> None:
        """Let all of them go."""
        for device in tuple(self._workers):
            self.let_go(device)

    async def _again(self, device: int) -> None:
        probe = presence_probes(await asyncio.to_thread(known_profiles))[0]
        priority = Priority.FEED
        while True:
            await self._clock.sleep(STRANGER_PERIOD)
            try:
                await self._ask(device, probe, priority)
                priority = Priority.FEED
            except DeviceException:
                priority = Priority.FEED  # it answered
            except LineError:
                priority = Priority.POLL  # one that is gone need not go before the others

    async def _ask(self, device: int, probe: PresenceProbe, priority: Priority) -> None:
        if probe.register is None:
            await self._line.identify(device, priority=priority)
        else:
            await self._line.read(device, probe.register, 1, priority=priority)
