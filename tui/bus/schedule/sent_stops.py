"""Stops that are repeated: what was just sent must not keep the line from everything else."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tui.safety import JUST_SENT, MOST_UNACKNOWLEDGED

from ..model import Priority
from ..requests import BROADCAST

if TYPE_CHECKING:
    from .queue import Job


class SentStop(NamedTuple):
    """One stop word that was sent to a device."""

    when: float
    tries: int
    """Number of unacknowledged attempts; 0 once acknowledged."""


class SentStops:
    """Says which stops take turns with what else waits. Lives in the line's loop.

    A stop is the first unless the same request was acknowledged just before, and nothing else has
    changed its device since. A repeat waits for one other exchange at most.
    """

    def __init__(self) -> None:
        self._sent: dict[tuple[int, bytes], SentStop] = {}
        self._stopped_last = False

    def yields(self, job: Job, now: float) -> bool:
        """True if one other request goes before this stop."""
        if job.priority is not Priority.STOP or not self._stopped_last:
            return False
        sent = self._sent.get((job.request.device, job.pdu))
        return (
            sent is not None
            and now - sent.when < JUST_SENT
            and sent.tries in (0, MOST_UNACKNOWLEDGED)
        )

    def count(self, job: Job, now: float, *, acknowledged: bool) -> None:
        """A request was sent, and its exchange is over."""
        request = job.request
        self._stopped_last = job.priority is Priority.STOP
        if job.commands:
            # the same stop means something again
            self._sent = {
                which: sent
                for which, sent in self._sent.items()
                if request.device not in (BROADCAST, which[0])
            }
        elif request.changes:
            self._sent = {
                which: sent for which, sent in self._sent.items() if now - sent.when < JUST_SENT
            }
            which = request.device, job.pdu
            before = self._sent.get(which, SentStop(now, 0))
            tries = 0 if acknowledged else min(before.tries + 1, MOST_UNACKNOWLEDGED)
            self._sent[which] = SentStop(now, tries)
