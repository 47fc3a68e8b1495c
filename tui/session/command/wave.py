"""The first frames of several stops: sent to every drive before anything is read of any."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from contextlib import suppress

WAVE_TAKES = 10.0
"""Seconds after which a first wave is over, though not every drive was sent its frame."""


class FirstWave:
    """The first frames of several stops; lives in the line's loop."""

    def __init__(self, devices: Iterable[int]) -> None:
        self._left = set(devices)
        self._over = asyncio.Event()

    def passed(self, device: int) -> None:
        """The frame of a drive was sent, or cannot be."""
        self._left.discard(device)
        if not self._left:
            self._over.set()

    async def over(self) -> None:
        """Wait until all were sent: reading and planning would hold up the next frame."""
        with suppress(TimeoutError):
            async with asyncio.timeout(WAVE_TAKES):
                await self._over.wait()
