"""Requests that wait for the line, and the order in which they go out."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import NamedTuple

from tui.safety import JUST_SENT, MOST_UNACKNOWLEDGED

from ..errors import LineBusy, LineError, LineFailed, RequestRefused, Superseded
from ..expectation import Expectation
from ..limits import Limits
from ..model import Priority, Reply
from ..program_use import ProgramUse
from ..requests import BROADCAST, Read, Request


@dataclass(eq=False, slots=True)
class Job:
    """One request with all that is needed to send it and to return its reply."""

    request: Request
    priority: Priority
    limits: Limits
    answer: Future[Reply] = field(default_factory=Future)
    repeats: int = 0
    """Number of retries."""
    first_sent: float | None = None
    """When it was first sent, if it is a repeat: a reply may be to that first request."""
    pdu: bytes = b""
    form: Read | None = None
    """The longer read that is sent for it."""
    probes: int = 0
    """Requests that were sent before it so that its drive proves its step."""
    keeps_alive: bool = False
    """True if nothing of its reply is used: it only keeps its drive from a timeout."""
    mistakable: bool = False
    """True if it was sent when a reply to an earlier request could be taken for its own."""
    begun: bool = False
    """True if it was taken from the queue once: then it can no longer be withdrawn."""
    expectation: Expectation | None = None
    order: int = 0
    """Place among the jobs of its priority; kept when it is sent again."""
    replaceable: bool = False
    """True if a newer write of the same register may take its place while it waits."""
    forbidden: Callable[[], str] | None = None
    """Called just before it is sent; returns the reason if it must not be, else nothing."""
    program: str = ""
    """Id of the requesting program."""
    stamp: int = 0
    """The count of stops of the device that it knew of."""
    requested: float = 0.0
    """When it was handed over, by the line's clock."""
    max_age: float = 0.0
    """A reply to the same request of any program is used, up to this age in seconds."""

    within: float | None = None
    """Timeout in seconds, if the requester sets it; else it follows from the device's state."""

    def __post_init__(self) -> None:
        # made in the caller's thread: the line's thread must keep the inter-frame gap
        self.pdu = self.request.pdu()
        if self.request.device != BROADCAST:
            self.expectation = self.request.expectation()

    def take_form(self, form: Read | None) -> None:
        """Have a longer read sent for it, or itself again."""
        self.form, sent = form, form or self.request
        self.pdu, self.expectation = sent.pdu(), sent.expectation()

    def own_part(self, pdu: bytes) -> bytes:
        """The reply as it would be if the request itself had been sent."""
        if not isinstance(self.request, Read) or self.form is None:
            return pdu
        return self.request.pdu_of(self.form.words(pdu)[: self.request.count])

    @property
    def tries(self) -> tuple[bytes, float | None]:
        """The request, and when it was first sent, if it is sent again."""
        return self.pdu, self.first_sent

    @property
    def commands(self) -> bool:
        """True if it changes anything, except a stop: a stop discards it."""
        return self.request.changes and self.priority is not Priority.STOP

    def fail(self, error: LineError) -> None:
        """Return an error to the caller, unless it no longer waits."""
        if self.begun or self.answer.set_running_or_notify_cancel():
            self.begun = True
            self.answer.set_exception(error)

    def break_off(self, error: Exception) -> None:
        """Fail it with an internal error of the line."""
        self.fail(LineFailed(f"The line failed: {error!r}."))

    def reply(self, pdu: bytes, time: float) -> Reply:
        """The reply in the form of the request; `pdu` is checked, without device and checksum."""
        own = self.own_part(pdu)
        return Reply(self.request.words(own), time, own)

    def finish(self, reply: Reply) -> None:
        """Return a checked reply to the caller."""
        self.answer.set_result(reply)


class JobQueue:
    """Bounded queue, ordered by shares and priority, then first come first served.

    It skips requests that must wait.
    """

    def __init__(self, length: int, use: ProgramUse | None = None) -> None:
        """`use` counts the time that each program has."""
        self._length = length
        self._use = use or ProgramUse()
        self._shares = LineShares()
        self._stops = SentStops()
        self._orders = itertools.count()
        self._jobs: list[Job] = []

    def __len__(self) -> int:
        return len(self._jobs)

    def put(self, job: Job) -> None:
        """Queue a job. Raises LineBusy if the queue is full.

        Each program that shares the line has the same number of places. A stop always has one;
        polls and background work leave half of the places to the operator.
        """
        if job.replaceable and (older := self._replaced_by(job)) is not None:
            self._jobs.remove(older)
            older.fail(Superseded(job.request.device, job.request.register))
            job.order = older.order
            self._jobs.append(job)
            return
        room = self._length if job.priority < Priority.POLL else self._length // 2
        waiting = sum(item.program == job.program for item in self._jobs)
        if job.priority is not Priority.STOP and waiting >= room:
            raise LineBusy(f"{waiting} requests wait for the line already; try again.")
        job.order = next(self._orders)
        self._shares.come(job, self._jobs)
        self._jobs.append(job)

    def _replaced_by(self, job: Job) -> Job | None:
        """A waiting write that this one may replace.

        Only if no other change of the device waits after it, so that every command meets the same
        reference as without the replacement.
        """
        request = job.request
        behind = [
            other
            for other in sorted(self._jobs, key=lambda other: (other.priority, other.order))
            if other.request.device in (request.device, BROADCAST) and other.request.changes
        ]
        older = behind[-1] if behind else None
        if older is None or older.begun or not older.replaceable:
            return None
        same = (older.priority, type(older.request), older.request.register)
        return older if same == (job.priority, type(request), request.register) else None

    def put_back(self, job: Job, *, behind: bool = False) -> None:
        """Queue a job again, at its old place or after all others."""
        if behind:
            job.order = next(self._orders)
        self._jobs.append(job)

    def keep(self, stop: Job) -> None:
        """Queue a stop whose reply has no receiver, unless an equal one waits."""
        if not any(stop.request == job.request for job in self._jobs):
            self._jobs.append(stop)

    def take(
        self, not_before: Callable[[Job], float], now: float
    ) -> tuple[Job | None, float | None]:
        """The job to send now, or the time when one may be sent; both None if nothing waits."""
        earliest: float | None = None
        self._jobs = [job for job in self._jobs if not self._withdrawn(job)]

        def place(job: Job) -> tuple[float, ...]:
            return self._stops.yields(job, now), *self._shares.rank(job)

        for job in sorted(self._jobs, key=place):
            ready = not_before(job)
            if ready <= now:
                self._jobs.remove(job)
                return job, None
            earliest = ready if earliest is None else min(earliest, ready)
        return None, earliest

    @property
    def stops(self) -> bool:
        """True if a stop waits."""
        return any(job.priority is Priority.STOP and job.request.changes for job in self._jobs)

    def count(self, job: Job, begun: float, now: float, *, acknowledged: bool) -> None:
        """Count a job that has kept the line since `begun`."""
        seconds = now - begun
        self._stops.count(job, now, acknowledged=acknowledged)
        self._shares.count(job, seconds, self._jobs)
        self._use.count(job.program, seconds)

    @staticmethod
    def _withdrawn(job: Job) -> bool:
        return not job.begun and job.answer.cancelled()

    def waiting(self) -> tuple[Job, ...]:
        """The waiting jobs, in the order of their arrival."""
        return tuple(self._jobs)

    def remove(self, job: Job) -> None:
        """Take out a job that waits."""
        self._jobs.remove(job)

    def refuse(self, reason: Callable[[Job], str]) -> None:
        """Remove and fail the waiting jobs that have a reason not to be sent."""
        for job in self.waiting():
            if why := reason(job):
                self.remove(job)
                job.fail(RequestRefused(why))

    def drain(self) -> list[Job]:
        """Take out everything that waits."""
        jobs, self._jobs = self._jobs, []
        return jobs


class SentStop(NamedTuple):
    """One stop word that was sent to a device."""

    when: float
    tries: int
    """Number of unacknowledged attempts; 0 once acknowledged."""


class SentStops:
    """Decides which stops take turns with other requests. Lives in the line's loop.

    A stop is first, unless the same request was acknowledged just before and no other command to
    its device followed. A repeat waits for one other exchange at most.
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
            # the same stop is needed again
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


MINIMUM_SHARES: Mapping[Priority, float] = {
    Priority.OPERATOR_READ: 0.25,
    Priority.POLL: 0.15,
    Priority.BACKGROUND: 0.05,
}
"""Shares of a full line's time, by kind of request; stops and commands take all they need."""
MOST_OWED = 0.3
"""Most seconds of the line that a kind may be owed: unused time is not kept."""
OVERDUE = 0.1
"""Seconds owed at which a kind precedes higher ones: short series of commands pass undivided."""
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
                # use above its share is no debt while nothing else waits
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
