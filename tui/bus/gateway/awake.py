"""True if a loop has just come back from standing still: by SIGSTOP, or on a machine that swaps."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from time import monotonic

from tui.safety import GATEWAY_SUSPENDED_AFTER

LOOK_AWAKE = 0.5
"""Seconds between two looks."""
CATCHES_UP = 1.0
"""Seconds after standing still in which a loop takes in what came meanwhile."""


class Awake:
    """Looks at the time again and again; lives in one loop."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._looked = self._stale_until = clock()
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to look."""
        self._looked = self._clock()
        self._task = asyncio.get_running_loop().create_task(self._work(), name="awake")

    def close(self) -> None:
        """Look no more."""
        if self._task is not None:
            self._task.cancel()

    @property
    def just_woke(self) -> bool:
        """True if what comes in now may have come while the loop stood still."""
        now = self._clock()
        # the bytes of a connection are taken in before the look that is due
        return now - self._looked > GATEWAY_SUSPENDED_AFTER or now < self._stale_until

    def look(self) -> None:
        """The loop goes on."""
        now = self._clock()
        if now - self._looked > GATEWAY_SUSPENDED_AFTER:
            self._stale_until = now + CATCHES_UP
        self._looked = now

    async def _work(self) -> None:
        while True:
            await asyncio.sleep(LOOK_AWAKE)
            self.look()
