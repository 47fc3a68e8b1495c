"""The last raw values of a drive that anybody read, for decisions that cannot wait for a read."""

from __future__ import annotations

import time
from collections.abc import Mapping

from .readings import Quality, Reading


class Known:
    """Raw values by code with the time they were on the wire; written in the line's loop.

    Read from any thread: a value is replaced as a whole.
    """

    def __init__(self) -> None:
        self._raws: dict[str, tuple[float, int]] = {}

    def note(self, readings: Mapping[str, Reading]) -> None:
        """Keep what was read."""
        found = {
            code: (reading.time, reading.raw)
            for code, reading in readings.items()
            if reading.raw is not None and reading.quality is Quality.GOOD
        }
        self._raws = {**self._raws, **found}

    def put(self, code: str, raw: int) -> None:
        """Keep a raw value read just now."""
        self._raws = {**self._raws, code: (time.monotonic(), raw)}

    def forget(self) -> None:
        """Another drive may answer now."""
        self._raws = {}

    def raws(self, longest: float = float("inf")) -> dict[str, int]:
        """Raw values no older than so many seconds."""
        oldest = time.monotonic() - longest
        return {code: raw for code, (read, raw) in self._raws.items() if read >= oldest}
