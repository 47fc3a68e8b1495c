"""Takes requests from the queue one at a time, sends them, and returns their results."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from contextlib import suppress

from ..coils import single_read
from ..errors import LineBehind, LineClosed, LineError, LineFailed, LineLost, RequestRefused
from ..master import ExchangeResult, Master, MonotonicClock, Piece, ResultKind, Sending
from ..model import Priority, Reply, Timing
from ..requests import Request
from ..shared_state import SharedState
from ..tally import Tally
from .alive_reads import AliveReads
from .back_to_back import BackToBack
from .in_step import UNANSWERED, InStep
from .last_way import LastWay
from .outcomes import Next, Outcomes, with_fate
from .patience import Devices
from .probes import may_be_silent
from .queue import Job, JobQueue
from .step_proof import StepProof
from .unsent import ends_unsent, fail_lost, refusal_of

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
        buffers: bool = False,
        facts: SharedState | None = None,
    ) -> None:
        self.facts = facts or SharedState()
        """State shared by the programs on the line."""
        self._devices = devices
        self._clock = clock
        self._queue = JobQueue(timing.queue_length, tally.use)
        self._back_to_back = BackToBack()
        self._wake = asyncio.Event()
        self._outcomes = Outcomes(devices, tally, timing, clock, self.facts, gateway=gateway)
        self.steps = InStep(devices, self._outcomes, clock, timing, buffers, gateway)
        """Decides which replies belong to the requests that they follow."""
        self.proof = StepProof(devices, self._outcomes, clock, self.submit, self.steps)
        """Decides which replies are trusted after another process has used the line."""
        self._alive_reads = AliveReads(devices, self.facts, clock, self.submit)
        self.in_flight = False
        """True while an exchange is in progress."""
        self.held_back: Callable[[], bool] = bool
        """True if only stops may be sent now, because other programs may have sent stops
        meanwhile."""
        self.last_way: LastWay | None = None
        """Place of stops that bypass the queue."""

    def wake(self) -> None:
        """Look at the queue again: a request or a late reply came, or the line was lost."""
        self._wake.set()

    def submit(self, job: Job) -> None:
        """Queue a request, or fail it immediately if polling of its device is paused."""
        if self._ends_unsent(job):
            return
        try:
            self._queue.put(job)
        except LineError as error:
            job.fail(error)
        self._wake.set()

    def fail_all(self, reason: str, kind: type[LineError]) -> None:
        """Fail everything that waits."""
        for job in self._queue.drain():
            self.fail(job, reason, kind)

    def fail(self, job: Job, reason: str, kind: type[LineError] = LineLost) -> None:
        """Fail a request without a line; a stop word is kept if the line closed itself."""
        keeps = bool(self.steps.behind) and kind is not LineClosed
        if (kept := fail_lost(job, reason, kind, self._clock(), keeps=keeps)) is not None:
            self._queue.keep(kept)

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
        """Queue a job again at its old place, as it has no result yet."""
        self._queue.put_back(job)
        self._wake.set()

    def void(self) -> None:
        """Refuse waiting commands that a stop has canceled."""
        self._queue.refuse(self.refusal)

    def void_older(self, than: float, why: str) -> None:
        """Refuse waiting commands that are older than a moment, except stops."""
        self._queue.refuse(lambda job: why if job.commands and job.requested < than else "")

    def stray(self, piece: Piece, time: float) -> None:
        """Note a whole frame that came when none was due: requests may have waited for it."""
        alone = ExchangeResult(ResultKind.NOTHING, strays=[piece], sent=time, end=time)
        self._outcomes.record(piece.device, b"", alone)
        self._outcomes.note_stray(piece, time)
        self.steps.stray(piece)
        self._wake.set()

    async def serve(self, master: Master) -> None:
        """Send requests until the line is lost. Raises LineLost."""
        self.steps.opened()
        while True:
            self._wake.clear()
            if self.last_way is not None and self.last_way.waits:
                await self.last_way.send_waiting()
            due = self._alive_reads.put_due()
            if master.failure is not None:
                raise LineLost(str(master.failure))
            if self.steps.reopen and not self._queue.stops:
                raise LineBehind(self.steps.behind)
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
            if self.steps.behind:
                due = min(due, self._clock() + await self.steps.attend(master))
            await self._sleep(max(0.0, due - self._clock()))

    async def _sleep(self, pause: float) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(None if pause == math.inf else pause):
                await self._wake.wait()

    def _not_before(self, job: Job) -> float:
        now = self._clock()
        if job.priority is not Priority.STOP and self.held_back():
            return now + HELD_LOOK
        if (free := self.steps.not_before(job, now)) is not None:
            return free
        if (trusted := self.proof.not_before(job, now)) > now:
            return trusted
        if (free := self._back_to_back.not_before(job)) > now:
            return free
        if self._devices.backed_off(job.request.device, job.priority, now, job.within) is not None:
            return 0.0  # taken out at once, to fail
        ready = self._free_from(job, now)
        if ready > max(now, self._devices.quiet_until) and self.steps.lengthen(job):
            ready = self._free_from(job, now)
        return ready

    def _free_from(self, job: Job, now: float) -> float:
        return self._devices.not_before(
            job.request.device, job.expectation, job.priority, now, job.tries
        )

    def _ends_unsent(self, job: Job) -> bool:
        values, now = self._outcomes.values, self._clock()
        return self.steps.refuses(job) or ends_unsent(job, self._devices, values, now)

    def refusal(self, job: Job) -> str:
        """Reason if a write must not be sent: a stop came after it, or another program commands."""
        return refusal_of(job, self.facts)

    def forbidden(self, job: Job) -> str:
        """Reason if a request must not be sent, by the shared state or by its sender."""
        return self.refusal(job) or (job.forbidden() if job.forbidden is not None else "")

    def _begins(self, job: Job) -> bool:
        """Take a job up; False if nothing is to be sent for it, or not yet."""
        if self._ends_unsent(job):
            return False
        if why := self.forbidden(job):
            job.fail(RequestRefused(why))
        return not why

    async def _run(self, master: Master, job: Job) -> None:
        if not self._begins(job):
            return
        if self.proof.is_due(job):
            self._queue.put_back(job)
            await self.proof.prove(master, job)
            return
        if (probe := self.steps.prepare(job)) is not None:
            self._queue.put_back(job)
            await self._prove(master, job, probe)
            return
        if not job.begun and not job.answer.set_running_or_notify_cancel():
            return
        job.begun = True
        if job.request.changes:
            self._outcomes.values.drop(job.request.device)
        await self._send(master, job)

    async def _send(self, master: Master, job: Job) -> None:
        begun = self._clock()
        self.in_flight = True
        try:
            result = await master.exchange(self._sending(job))
            if result.kind is ResultKind.UNSURE:
                await self._resolve_echo(master, job, result)
            if self._may_be_copy(job, result):
                result = await self._ask_again(master, job, result)
        except _NotSent as reason:
            self._not_sent(job, str(reason))
            return
        except LineLost:
            # failed with the others, once the line's state says that it is lost
            self._queue.put_back(job)
            self.in_flight = False
            cut = ExchangeResult(ResultKind.NOTHING, sent=begun, end=self._clock())
            self._outcomes.record(job.request.device, job.pdu, cut, job)
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
        try:
            self._queue.count(job, begun, self._clock(), acknowledged=acknowledged)
            self._conclude(job, result, begun)
        except BaseException as error:
            # its caller must not wait for ever; the line is opened again
            if not job.answer.done() and job not in self._queue.waiting():
                job.fail(LineFailed(with_fate(job, f"The reply could not be judged: {error!r}.")))
            raise

    async def _resolve_echo(self, master: Master, job: Job, result: ExchangeResult) -> None:
        """Decide if a result is the adapter's echo or the reply, by the echo of a read.

        Raises LineLost.
        """
        request = job.request
        probe = single_read(request)
        if probe.function in job.limits.functions:
            await master.quiet()
            time_out = self._devices.time_out(request.device, probe.function, job.priority)
            probed = await master.exchange(
                Sending(request.device, probe.pdu(), probe.expectation(), time_out)
            )
            self._outcomes.record(request.device, probe.pdu(), probed, job)
            self._outcomes.count_beside(request.device, probed)
        if master.echo is False:
            result.kind, result.pdu = ResultKind.REPLY, job.pdu
        else:
            result.kind = ResultKind.NOTHING
            result.detail = "only the adapter's echo of it came back"

    def _may_be_copy(self, job: Job, result: ExchangeResult) -> bool:
        return result.kind is ResultKind.REPLY and self._devices.is_repeat(
            job.request.device, job.pdu, result.pdu, result.turnaround
        )

    async def _ask_again(self, master: Master, job: Job, doubted: ExchangeResult) -> ExchangeResult:
        """Send a request again whose reply may be a copy of the previous one.

        The first of its two replies is right in either case. Raises LineLost.
        """
        device = job.request.device
        await master.quiet()
        result = await master.exchange(self._sending(job))
        self._outcomes.record(device, job.pdu, doubted, job, "copy")
        self._outcomes.count_beside(device, doubted)
        if result.pdu != doubted.pdu and job.expectation is not None:
            # it was a copy: one more reply to this request is on its way
            self._devices.may_come(device, job.expectation, result.sent, result.end)
        self._outcomes.note_strays(doubted.strays, doubted.end)
        return result

    async def _prove(self, master: Master, job: Job, probe: Request) -> None:
        """Send a probe for a job that waits; without a reply, the job has none either."""
        self.in_flight = True
        try:
            result = await self.steps.prove(master, job, probe)
        finally:
            self.in_flight = False
        silent = result.kind is ResultKind.NOTHING and may_be_silent(job, probe)
        if result.kind not in UNANSWERED or silent or job not in self._queue.waiting():
            return
        self._queue.remove(job)
        self._end(job, result, unsent=True)

    def _conclude(self, job: Job, result: ExchangeResult, begun: float) -> None:
        self._outcomes.hear_gateway(job, result)
        self._outcomes.record(job.request.device, job.pdu, result, job)
        if job.expectation is not None:
            self.steps.note(job, job.expectation, result)
        self._back_to_back.count(job, begun, self._clock())
        self.proof.sent(job, begun)
        if self.steps.end_form(job, result) or self._outcomes.waited_for_us(job, result):
            self.put_back(job)
        else:
            self._end(job, result)

    def _end(self, job: Job, result: ExchangeResult, *, unsent: bool = False) -> None:
        """Return the reply to the caller, or send the request again; an error it has already."""
        match self._outcomes.conclude(job, result, unsent=unsent):
            case Reply() as reply:
                job.finish(reply)
            case Next.REPEAT:
                self._repeat(job, result)

    def _repeat(self, job: Job, result: ExchangeResult) -> None:
        # one drive that no longer answers must not delay the others by several timeouts
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
            # a stop may have come during the silence before it, or while this program was suspended
            if job.priority is not Priority.STOP and self.held_back():
                raise _NotSent
            if why := self.refusal(job):
                raise _NotSent(why)

        if job.expectation is None:
            return Sending(request.device, job.pdu, None, 0.0, look=look)
        now = self._clock()
        sure, skip = self._devices.doubts(request.device, job.expectation, now, job.tries)
        job.mistakable = job.keeps_alive and skip > 0
        if job.mistakable:
            # it goes out while replies are late: to wait for the second one, after a first that was
            # its own, would take the line from all other drives
            skip = 0
        return Sending(
            request.device,
            job.pdu,
            job.expectation,
            self._devices.time_out(request.device, request.function, job.priority, job.within),
            job.form is not None or (sure and not self.proof.doubts_refusal(request.device)),
            skip,
            look,
        )


class _NotSent(Exception):
    """A request was held back at the last moment, for a reason or for a while."""
