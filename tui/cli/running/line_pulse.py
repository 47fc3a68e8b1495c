"""True if the thread of a line still turns, as seen from outside of it."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine

PULSE_INTERVAL = 0.5
STILL_AFTER = 5.0
"""Seconds without a beat after which a line counts as standing still."""


class LinePulse:
    """Beats in the loop of a line; `alive` may be asked in any thread."""

    def __init__(self, line: ModbusLine) -> None:
        self._last = time.monotonic()
        self._worker = line.spawn(self._beat, "pulse")

    @property
    def alive(self) -> bool:
        """True if it beat a moment ago."""
        return not self._worker.done() and time.monotonic() - self._last < STILL_AFTER

    async def _beat(self) -> None:
        while True:
            self._last = time.monotonic()
            await asyncio.sleep(PULSE_INTERVAL)
