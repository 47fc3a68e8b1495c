"""Keeps the line free for a moment if a program that reads continuously will soon send again."""

from __future__ import annotations

from collections import deque

from ..model import Priority
from .queue import Job

LONGEST_PAUSE = 0.02
"""Seconds from an answer to the next request up to which a program asks back to back."""
PAUSES = 4
"""Pauses of a program that count."""
MARGIN, TRIP = 1.25, 0.003
"""Share of the longest pause, and seconds for its way to here, for which the line is kept free."""
POLLS_SHARE = 0.15
"""Share of the time that polls get in addition."""
REST_AT_MOST = 2.0
"""Seconds from an answer to the next request up to which a program asks again and again."""
GAP, LONGEST_GAP = 0.85, 0.1
"""Share of a poll's time for which the line is then left to such a program; in seconds at most."""


class BackToBack:
    """Holds polls back until the next read of a program is there, if that is a moment only.

    A poll that is begun just before that read would make it wait for a whole exchange. So would
    any request that is begun between what is read for a stop and its word. In the line's loop.

    A program that pauses for longer may ask at any moment. On a line that is full of polls it
    would wait for half of one on average. While it asks again and again, gaps between polls
    make that less.
    """

    def __init__(self) -> None:
        self._program = ""
        self._ended = 0.0
        """When the last read of that program was over."""
        self._free_until = self._stop_until = 0.0
        self._pauses = deque[float](maxlen=PAUSES)
        self._polled = self._read = 0.0
        """Seconds that the last poll took, and all reads since."""
        self._rests = deque[float](maxlen=PAUSES)
        """Pauses before the last reads of any program."""
        self._gap_until = 0.0

    def count(self, job: Job, begun: float, now: float) -> None:
        """A request has had the line from then until now."""
        if job.priority is Priority.STOP:
            # the stop word that a read decides about is on its way to here
            self._stop_until = 0.0 if job.request.changes else now + LONGEST_PAUSE
        if job.priority >= Priority.POLL:
            self._polled, self._read = now - begun, 0.0
        if job.priority is Priority.OPERATOR_READ:
            self._count_read(job, begun, now)
        if job.priority is Priority.OPERATOR_READ or job.priority >= Priority.POLL:
            self._gap_until = now + self._gap(now)

    def _count_read(self, job: Job, begun: float, now: float) -> None:
        self._read += now - begun
        pause = job.requested - self._ended
        if pause > REST_AT_MOST:
            self._rests.clear()
        else:
            self._rests.append(pause)
        if job.program != self._program or pause > LONGEST_PAUSE:
            self._pauses.clear()
        else:
            self._pauses.append(max(0.0, pause))
        self._program, self._ended = job.program, now
        hold = MARGIN * max(self._pauses) + TRIP if self._pauses else 0.0
        self._free_until = now + hold

    def _gap(self, now: float) -> float:
        """Seconds for which no poll begins, as a program may ask."""
        if len(self._rests) < PAUSES:
            return 0.0
        longest = max(self._rests)
        if longest <= LONGEST_PAUSE or now > self._ended + 2 * longest:
            return 0.0
        return min(GAP * self._polled, LONGEST_GAP)

    def not_before(self, job: Job) -> float:
        """When a request may go out at the earliest."""
        if job.priority <= Priority.FEED:
            return 0.0
        owed = self._read * POLLS_SHARE > self._polled * (1 - POLLS_SHARE)
        free_until = max(self._free_until, self._gap_until)
        free_until = 0.0 if job.priority < Priority.POLL or owed else free_until
        return max(free_until, self._stop_until)
