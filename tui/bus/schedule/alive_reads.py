"""The reads that keep devices from their communication timeout, by the holder of the line."""

from __future__ import annotations

import math
from collections.abc import Callable

from tui.safety import READS_PER_TIMEOUT

from ..keep_alive import KeepAlive
from ..master import MonotonicClock
from ..model import Priority
from ..shared_state import SharedState
from .patience import Devices
from .queue import Job

LONGEST_RETRY = 1.0
"""Seconds after which a read that failed is repeated, at most."""


class AliveReads:
    """Queues a read for each device that is kept alive and has not answered for a while.

    Lives in the line's loop, and is used only while this program holds the line.
    """

    def __init__(
        self,
        devices: Devices,
        facts: SharedState,
        clock: MonotonicClock,
        submit: Callable[[Job], None],
    ) -> None:
        self._devices = devices
        self._facts = facts
        self._clock = clock
        self._submit = submit
        self._jobs: dict[int, Job] = {}
        """The last read of each device."""
        self._since: dict[int, float] = {}
        """When each device was first kept alive."""
        self._due = 0.0
        self._seen: object = None

    def put_due(self) -> float:
        """Queue the reads that are due now; returns when to look again, by the line's clock."""
        now, kept = self._clock(), self._facts.keep_alives.kept
        if kept is not self._seen or now >= self._due:
            self._seen = kept
            shortest: dict[int, tuple[str, KeepAlive]] = {}
            for (program, device), alive in kept.items():
                best = shortest.get(device)
                lasts = alive.until is None or now < alive.until
                if lasts and (best is None or alive.timeout < best[1].timeout):
                    shortest[device] = program, alive
            self._since = {device: self._since.get(device, now) for device in shortest}
            self._jobs = {device: job for device, job in self._jobs.items() if device in shortest}
            due = [self._look(program, alive, now) for program, alive in shortest.values()]
            self._due = min(due, default=math.inf)
        return self._due

    def _look(self, program: str, alive: KeepAlive, now: float) -> float:
        """Queue the read of a device if it is due; returns when to look again."""
        period = alive.timeout / READS_PER_TIMEOUT
        retry = min(LONGEST_RETRY, period / 2)
        since = self._since[alive.device]
        heard = max(self._devices[alive.device].heard or since, since)
        due, last = heard + period, self._jobs.get(alive.device)
        if last is not None and last.requested > heard:
            # it waits for the line, or was not answered
            due = max(due, last.requested + retry) if last.answer.done() else now + retry
        if due > now:
            return due
        # beyond its timeout it has acted: it need no longer go before the others
        priority = Priority.FEED if now - heard < alive.timeout else Priority.POLL
        job = Job(alive.request, priority, self._devices[alive.device].limits, keeps_alive=True)
        job.program, job.requested = program, now
        self._jobs[alive.device] = job
        self._submit(job)
        return now + retry
