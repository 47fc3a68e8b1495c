"""Takes requests from the queue one at a time, sends them, and hands back what became of them."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from contextlib import suppress

from ..errors import LineClosed, LineError, LineFailed, LineLost, NoAnswer, RequestRefused
from ..master import Master, MonotonicClock, Sending
from ..model import Priority, Timing
from ..requests import Diagnose
from ..result import ExchangeResult, Piece, ResultKind
from ..shared_facts import SharedFacts
from ..tally import Tally
from .alive_reads import AliveReads
from .back_to_back import BackToBack
from .echo import resolve_echo
from .last_way import LastWay
from .outcomes import Outcomes, with_fate
from .patience import Devices
from .queue import Job, JobQueue
from .step_proof import StepProof

HELD_LOOK = 0.01
"""Seconds between two looks whether requests are held back still."""


class Dispatcher:
    """Serves one line; lives in its loop."""

    def __init__(
        self,
        devices: Devices,
        tally: Tally,
        timing: Timing,
        clock: MonotonicClock,
        *,
        gateway: bool,
        facts: SharedFacts | None = None,
    ) -> None:
        self.facts = facts or SharedFacts()
        """What the programs that share the line must know of each other."""
        self._devices = devices
        self._clock = clock
        self._queue = JobQueue(timing.queue_length, tally.use)
        self._back_to_back = BackToBack()
        self._wake = asyncio.Event()
        self._outcomes = Outcomes(devices, tally, timing, clock, self.facts, gateway=gateway)
        self.proof = StepProof(devices, self._outcomes, clock, self.submit)
        """Decides which replies are trusted after another process has used the line."""
        self._alive_reads = AliveReads(devices, self.facts, clock, self.submit)
        self.in_flight = False
        """True if a request was sent whose end is not known yet."""
        self.held_back: Callable[[], bool] = bool
        """True if nothing but stops may go out now: others may have sent stops meanwhile."""
        self.last_way: LastWay | None = None
        """Where stops wait that go around the queue."""

    def wake(self) -> None:
        """Something changed: a request came, a late reply came, or the line was lost."""
        self._wake.set()

    def submit(self, job: Job) -> None:
        """Queue a request, or fail it at once when its device is being left alone."""
        if self._left_alone(job) or self._is_answered(job):
            return
        try:
            self._queue.put(job)
        except LineError as error:
            job.fail(error)
        self._wake.set()

    def fail_all(self, reason: str, kind: type[LineError]) -> None:
        """Fail everything that waits."""
        for job in self._queue.drain():
            job.fail(kind(with_fate(job, reason) if job.begun else reason))

    async def all_waiting(self) -> list[Job]:
        """Take out all that waits, once something does."""
        while not len(self._queue):
            self._wake.clear()
            await self._wake.wait()
        return self.take_all()

    def take_all(self) -> list[Job]:
        """Take out all that waits."""
        return self._queue.drain()

    def put_back(self, job: Job) -> None:
        """Queue a job that was taken out and came to nothing, at its old place."""
        self._queue.put_back(job)
        self._wake.set()

    def void(self) -> None:
        """A stop was given: what waits to change its device is refused at once."""
        self._refuse(self.refusal)

    def void_older(self, than: float, why: str) -> None:
        """Refuse what waits to change anything since before a moment, but for stops."""
        self._refuse(lambda job: why if job.commands and job.asked < than else "")

    def _refuse(self, reason: Callable[[Job], str]) -> None:
        for job in self._queue.waiting():
            if why := reason(job):
                self._queue.remove(job)
                job.fail(RequestRefused(why))

    def stray(self, piece: Piece, time: float) -> None:
        """A whole frame came that nobody waited for; it may be what others were held back for."""
        self._outcomes.note_stray(piece, time)
        self._wake.set()

    async def serve(self, master: Master) -> None:
        """Send requests until the line is lost. Raises LineLost."""
        while True:
            self._wake.clear()
            if self.last_way is not None and self.last_way.waits:
                await self.last_way.send_waiting()
            due = self._alive_reads.put_due()
            if master.failure is not None:
                raise LineLost(str(master.failure))
            if len(self._queue):
                # the choice is made after the silence, so that a stop that comes in meanwhile
                # goes first
                await master.quiet()
                now = self._clock()
                job, ready = self._queue.take(self._not_before, now)
                if job is not None:
                    await self._run(master, job)
                    continue
                due = due if ready is None else min(due, ready)
            await self._sleep(max(0.0, due - self._clock()))

    async def _sleep(self, pause: float) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(None if pause == math.inf else pause):
                await self._wake.wait()

    def _not_before(self, job: Job) -> float:
        now = self._clock()
        if job.priority is not Priority.STOP and self.held_back():
            return now + HELD_LOOK
        if (trusted := self.proof.not_before(job, now)) > now:
            return trusted
        if (free := self._back_to_back.not_before(job)) > now:
            return free
        if self._devices.backed_off(job.request.device, job.priority, now, job.within) is not None:
            # taken out at once, to be told
            return 0.0
        return self._devices.not_before(
            job.request.device, job.expectation, job.priority, now, job.tries
        )

    def _left_alone(self, job: Job) -> bool:
        """Fail a poll of a silent device that is not asked again yet."""
        device = job.request.device
        rest = self._devices.backed_off(device, job.priority, self._clock(), job.within)
        if rest is None:
            return False
        text = f"Device {device} does not answer."
        job.fail(NoAnswer(device, job.request.function, job.request.register, text, retry_in=rest))
        return True

    def _is_answered(self, job: Job) -> bool:
        """Answer a read from what was read for another program, where that is young enough."""
        if not job.max_age or job.begun:
            return False
        reply = self._outcomes.values.find(job.request, self._clock() - job.max_age)
        if reply is None or not job.answer.set_running_or_notify_cancel():
            return False
        job.begun = True
        job.answer.set_result(reply)
        return True

    def refusal(self, job: Job) -> str:
        """Why a write must not go out: a stop came after it, or another program commands."""
        if job.priority is Priority.STOP or not job.program:
            return ""
        if hushed := self.facts.hushed.get(job.request.device):
            return hushed[1]
        if not job.commands:
            return ""
        writes = job.request.function != Diagnose.function
        return self.facts.refusal(job.program, job.request.device, job.stamp, writes=writes)

    def forbidden(self, job: Job) -> str:
        """Why a request must not go out, by all, and by the one who asks."""
        return self.refusal(job) or (job.forbidden() if job.forbidden is not None else "")

    def _begins(self, job: Job) -> bool:
        """Take a job up; False if nothing is to be sent for it, or not yet."""
        if self._left_alone(job) or self._is_answered(job):
            return False
        if why := self.forbidden(job):
            job.fail(RequestRefused(why))
            return False
        return True

    async def _run(self, master: Master, job: Job) -> None:
        if not self._begins(job):
            return
        if self.proof.is_due(job):
            self._queue.put_back(job)
            await self.proof.prove(master, job)
            return
        if not job.begun and not job.answer.set_running_or_notify_cancel():
            return
        job.begun = True
        if job.request.changes:
            self._outcomes.values.drop(job.request.device)
        begun = self._clock()
        self.in_flight = True
        try:
            result = await master.exchange(self._sending(job))
            if result.kind is ResultKind.UNSURE:
                await resolve_echo(master, job, result, self._devices, self._outcomes)
            if self._is_repeat(job, result):
                result = await self._ask_again(master, job, result)
        except _NotSent as reason:
            self._not_sent(job, str(reason))
            return
        except LineLost:
            # failed with the others, once the line's state says that it is lost
            self._queue.put_back(job)
            self.in_flight = False
            if job.expectation is not None:
                now = self._clock()
                self._devices.may_come(job.request.device, job.expectation, begun, now)
            raise
        except asyncio.CancelledError:
            job.fail(LineClosed(with_fate(job, "The line was closed during the request.")))
            raise
        except BaseException as error:
            job.fail(LineFailed(with_fate(job, f"The request failed: {error!r}.")))
            raise
        self.in_flight = False
        acknowledged = result.kind is ResultKind.REPLY
        self._queue.count(job, begun, self._clock(), acknowledged=acknowledged)
        self._conclude(job, result, begun)

    def _conclude(self, job: Job, result: ExchangeResult, begun: float) -> None:
        self._back_to_back.count(job, begun, self._clock())
        self.proof.sent(job, begun)
        if self._outcomes.waited_for_us(job, result):
            self.put_back(job)
        elif self._outcomes.conclude(job, result):
            # one drive that went away must not keep the others waiting for several time-outs
            missed = job.priority is Priority.POLL and result.kind is ResultKind.NOTHING
            self._queue.put_back(job, behind=missed)
            self._wake.set()

    def _not_sent(self, job: Job, why: str) -> None:
        self.in_flight = False
        if why:
            job.fail(RequestRefused(why))
        else:
            self._queue.put_back(job)

    def _sending(self, job: Job) -> Sending:
        request = job.request

        def look() -> None:
            # what came in during the silence before it, or while this program stood still
            if job.priority is not Priority.STOP and self.held_back():
                raise _NotSent
            if why := self.refusal(job):
                raise _NotSent(why)

        if job.expectation is None:
            return Sending(request.device, job.pdu, None, 0.0, look=look)
        now = self._clock()
        sure, skip = self._devices.doubts(request.device, job.expectation, now, job.tries)
        return Sending(
            request.device,
            job.pdu,
            job.expectation,
            self._devices.time_out(request.device, request.function, job.priority, job.within),
            sure and not self.proof.doubts_refusal(request.device),
            skip,
            look,
        )

    def _is_repeat(self, job: Job, result: ExchangeResult) -> bool:
        """Whether a reply may be a copy of the one before."""
        return result.kind is ResultKind.REPLY and self._devices.is_repeat(
            job.request.device, job.pdu, result.pdu, result.turnaround
        )

    async def _ask_again(self, master: Master, job: Job, doubted: ExchangeResult) -> ExchangeResult:
        """The same once more: whichever of its two replies comes first, it is the right one."""
        await master.quiet()
        result = await master.exchange(self._sending(job))
        self._outcomes.count_beside(job.request.device, doubted)
        if result.pdu != doubted.pdu and job.expectation is not None:
            # it was a copy: one more reply to this request is on its way
            device, now = job.request.device, self._clock()
            self._devices.may_come(device, job.expectation, result.sent, now)
        self._outcomes.note_strays(doubted.strays, doubted.end)
        return result


class _NotSent(Exception):
    """A request was held back at the last moment, for a reason or for a while."""
