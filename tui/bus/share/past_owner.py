"""What a client does past an owner that is frozen: its stops go out on the port itself."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress

from ..errors import OWNER_SILENT
from ..model import Priority
from ..program import Program
from ..requests import BROADCAST
from ..schedule.inside import LineInside
from ..schedule.queue import Job
from .direct import DirectStops
from .messages import StopGiven
from .stops_past import StopsPast
from .turn import Turn


class PastOwner:
    """The stops of one client past one owner; lives in the line's loop."""

    def __init__(
        self, inside: LineInside, stops_past: StopsPast, turn: Turn, owner: Program
    ) -> None:
        self.at_work = False
        """Whether the owner is frozen."""
        self._inside = inside
        self._stops_past = stops_past
        self._turn = turn
        self._owner = owner
        self._direct: DirectStops | None = None
        self._ending: asyncio.Task[None] | None = None
        self._remedy = ""
        self._noted: dict[int, tuple[int, ...]] = {}

    @property
    def told(self) -> str:
        """What becomes of the line while its owner is frozen, for a person."""
        if self._direct is not None and self._direct.trouble:
            return self._direct.trouble
        remedy = f" {self._remedy}" if self._remedy else ""
        return f"{self._owner.text} {OWNER_SILENT}. Stops go out past it; all else waits.{remedy}"

    def begin(self) -> None:
        """The owner does not answer: take stops from now on."""
        self.at_work = True

    def owner_stays(self, remedy: str) -> None:
        """The owner hangs and cannot be ended by this program; `remedy` is who can, for a person.

        Called again and again: a stop that finds no way past it fails as soon as that is known.
        """
        self._remedy = remedy
        if self._direct is not None:
            self._direct.owner_stays(remedy)

    def leave(self) -> None:
        """The owner answers again: what is left goes its usual way."""
        self.at_work, self._remedy = False, ""
        direct, self._direct = self._direct, None
        if direct is not None:
            self._ending = asyncio.get_running_loop().create_task(direct.end())

    def when_ended(self, call: Callable[[], None]) -> None:
        """Call when nothing goes out past the owner any more."""
        if self._ending is None or self._ending.done():
            call()
        else:
            self._ending.add_done_callback(lambda _: call())

    async def end(self) -> None:
        """The owner is gone, or this program leaves it."""
        self.leave()
        if self._ending is not None:
            with suppress(asyncio.CancelledError):
                await self._ending

    def take(self, job: Job) -> bool:
        """Send what belongs to a stop directly; False where the job does not."""
        if not self.at_work:
            return False
        if self._direct is None:
            if job.priority is not Priority.STOP:
                return False
            self._direct = DirectStops(self._inside, self._turn, self._owner)
        if job.priority is Priority.STOP and job.request.changes:
            self._note(job.request.device)
        return self._direct.take(job)

    def _note(self, device: int) -> None:
        """Let the owner find that a stop went past it, before the stop goes out."""
        facts = self._inside.facts
        mine = {one: counts.get(facts.me.id, 0) for one, counts in facts.stops.given.items()}
        devices = tuple(one for one, n in mine.items() if n and device in (one, BROADCAST))
        counts = tuple(mine[one] for one in devices)
        if devices and self._noted.get(device) != counts:
            self._noted[device] = counts
            by = facts.stops.by.get(devices[0], "")
            when = max(facts.stops.times.get(one, 0.0) for one in devices)
            self._stops_past.note(StopGiven(devices, counts, by, facts.me, when))
