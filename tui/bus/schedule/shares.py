"""Minimum shares of the line's time, so that no kind of request waits for good."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from ..model import Priority

if TYPE_CHECKING:
    from .queue import Job

MINIMUM_SHARES: Mapping[Priority, float] = {
    Priority.OPERATOR_READ: 0.25,
    Priority.POLL: 0.15,
    Priority.BACKGROUND: 0.05,
}
"""Of the time of a full line, by kind of request; stops and commands take all that they need."""
MOST_OWED = 0.3
"""Seconds of the line that a kind may be owed: what it could not use is not made up for."""
OVERDUE = 0.1
"""Seconds owed from which a kind goes before those above it: a few commands pass undivided."""
LEAST_COUNTED = 0.001
"""Seconds that an exchange is counted for at least."""


class LineShares:
    """Order of requests: stops, then kinds below their share, then by priority.

    Within a kind, programs take turns by the time that each has had. Lives in the line's loop.
    """

    def __init__(self) -> None:
        self._owed = dict.fromkeys(MINIMUM_SHARES, 0.0)
        self._had: dict[tuple[Priority, str], float] = {}
        """Seconds by kind and program; of a program that comes back, at least the others' least."""

    def rank(self, job: Job) -> tuple[float, ...]:
        """The place of a job that waits; the smallest goes out first."""
        kind = kind_of(job.priority)
        owed = self._owed.get(kind, 0.0)
        had = self._had.get((kind, job.program), 0.0)
        if job.priority is Priority.STOP:
            return 0.0, 0.0, 0.0, 0.0, job.order
        if owed > OVERDUE:
            return 1.0, -owed, had, job.priority, job.order
        return 2.0, kind, had, job.priority, job.order

    def come(self, job: Job, waiting: Iterable[Job]) -> None:
        """A job joins those that wait: its program makes up for no time in which it had none."""
        kind = kind_of(job.priority)
        if kind not in self._owed:
            return
        others = [item.program for item in waiting if kind_of(item.priority) is kind]
        if not others:
            self._had = {which: had for which, had in self._had.items() if which[0] is not kind}
        elif job.program not in others:
            least, mine = (
                min(self._had.get((kind, other), 0.0) for other in others),
                (kind, job.program),
            )
            self._had[mine] = max(least, self._had.get(mine, 0.0))

    def count(self, job: Job, seconds: float, waiting: Iterable[Job]) -> None:
        """A job has taken so many seconds of the line, while these waited.

        The time of stops is not shared: nothing is made up for after it.
        """
        if job.priority is Priority.STOP:
            return
        seconds = max(seconds, LEAST_COUNTED)
        kinds = {kind_of(item.priority) for item in waiting}
        kind = kind_of(job.priority)
        for priority, share in MINIMUM_SHARES.items():
            due = self._owed[priority] + share * seconds
            if priority is kind:
                # what it takes beyond its share while nothing else waits is no debt
                due = max(due - seconds, -seconds)
            self._owed[priority] = min(
                due, MOST_OWED if priority is kind or priority in kinds else 0.0
            )
        if kind in self._owed:
            mine = kind, job.program
            self._had[mine] = self._had.get(mine, 0.0) + seconds


def kind_of(priority: Priority) -> Priority:
    """The kind of request that shares its minimum share of the line."""
    if priority is Priority.PATIENT:
        return Priority.BACKGROUND
    return priority
