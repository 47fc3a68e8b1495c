"""Another master on a simulated line: its requests, and the drives' replies."""

from __future__ import annotations

from .frames import seal
from .line import SimulatedLine

PAUSE = 0.01
"""Least time in s from a master's request to the reply."""
READ = 3


class PollingMaster:
    """Master that polls one drive after another; `period` in s between two requests, 0 for
    never."""

    def __init__(self, line: SimulatedLine, period: float) -> None:
        self._line = line
        self._period = period
        self._polls = 0
        self.due: float | None = 0.0 if period and line.drives else None
        """Time of its next request, on a monotonic clock."""

    def talk(self, now: float) -> list[tuple[float, bytes]]:
        """Return its due request and the reply to it: delays in s, and bytes."""
        if self.due is None or now < self.due:
            return []
        self.due = now + self._period
        drive = self._line.drives[self._polls % len(self._line.drives)]
        self._polls += 1
        status = drive.profile.quantity("status_word")
        place = status.address if status is not None else 0
        request = seal(bytes([drive.address, READ, *place.to_bytes(2, "big"), 0, 1]))
        reply = self._line.receive(request)
        sent = [(0.0, request)]
        if reply is not None:
            time = len(request) * self._line.timing.character
            sent.append((max(PAUSE, time + reply.turnaround), reply.data))
        return sent
