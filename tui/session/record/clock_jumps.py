"""Jumps of the computer's clock, as events between the rows of a record."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .reduction import CLOCK_JUMP
from .schema import EventRow, ReplyRow


class ClockJumps:
    """Compares the time of day of rows with their monotonic time."""

    def __init__(self, report: Callable[[str], object]) -> None:
        """`report` is called with a text for each jump."""
        self._report = report
        self._offset: int | None = None

    def noted(self, rows: Sequence[ReplyRow | EventRow]) -> list[ReplyRow | EventRow]:
        """Return the rows, and an event before each that follows a jump of the time of day."""
        found: list[ReplyRow | EventRow] = []
        for row in rows:
            offset, before = row.utc - row.mono, self._offset
            self._offset = offset
            if before is not None and abs(offset - before) > CLOCK_JUMP:
                text = f"The computer's clock jumped by {(offset - before) / 1e6:+.3f} s."
                found.append(EventRow(row.utc, row.mono, None, "clock", text))
                self._report(text)
            found.append(row)
        return found
