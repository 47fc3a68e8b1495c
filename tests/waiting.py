"""Wait in a test's own loop; `wait_until` of `programs` waits in a thread."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable


async def until(holds: Callable[[], object], seconds: float = 60.0) -> None:
    """Wait for a condition, which a slow machine meets later; fail after `seconds`."""
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, f"still false after {seconds:g} s"
        await asyncio.sleep(0.005)
