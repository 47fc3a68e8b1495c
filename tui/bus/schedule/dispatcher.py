"""Takes requests from the queue one at a time, sends them, and hands back what became of them."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable

from ..errors import (
    ChecksumFault,
    DeviceException,
    LineClosed,
    LineError,
    LineLost,
    NoAnswer,
    RequestRefused,
    WrongReply,
)
from ..limits import STANDARD_EXCEPTIONS
from ..master import Master, MonotonicClock, Sending
from ..model import Priority, Timing
from ..requests import BROADCAST, Read
from ..result import ExchangeResult, Piece, ResultKind
from ..shared_facts import SharedFacts
from ..tally import Tally
from .patience import Devices
from .queue import Job, JobQueue
from .shared_values import SharedValues

GATEWAY_EXCEPTIONS = frozenset({10, 11})
"""Exceptions by which a gateway says that a device behind it did not answer."""
UNKNOWN_FATE = " Whether it was taken is not known; read the register back before trying again."
REPEATED_WHEN_SILENT = frozenset(range(Priority.POLL))


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
        self._tally = tally
        self._timing = timing
        self._clock = clock
        self._gateway = gateway
        self._queue = JobQueue(timing.queue_length)
        self._wake = asyncio.Event()
        self._values = SharedValues()
        self.in_flight = False
        """Whether a request was sent whose end is not known yet."""

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
            job.fail(kind(_with_fate(job, reason) if job.begun else reason))

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

    def void(self, device: int) -> None:
        """A stop was given: what waits to change the device is refused at once."""
        for job in self._queue.waiting():
            if job.request.device == device and job.request.changes and (why := self.refusal(job)):
                self._queue.remove(job)
                job.fail(RequestRefused(why))

    def stray(self, piece: Piece, time: float) -> None:
        """A whole frame came that nobody waited for; it may be what others were held back for."""
        self._devices.stray(piece, time)
        self._wake.set()

    async def serve(self, master: Master) -> None:
        """Send requests until the line is lost. Raises LineLost."""
        while True:
            self._wake.clear()
            pause: float | None = None
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
                pause = None if ready is None else max(0.0, ready - now)
            await self._sleep(pause)

    async def _sleep(self, pause: float | None) -> None:
        try:
            async with asyncio.timeout(pause):
                await self._wake.wait()
        except TimeoutError:
            return

    def _not_before(self, job: Job) -> float:
        now = self._clock()
        if self._devices.backed_off(job.request.device, job.priority, now) is not None:
            # taken out at once, to be told
            return 0.0
        return self._devices.not_before(job.request.device, job.expectation, job.priority, now)

    def _left_alone(self, job: Job) -> bool:
        """Fail a poll of a silent device that is not asked again yet."""
        device = job.request.device
        rest = self._devices.backed_off(device, job.priority, self._clock())
        if rest is None:
            return False
        text = f"Device {device} does not answer."
        job.fail(NoAnswer(device, job.request.function, job.request.register, text, retry_in=rest))
        return True

    def _is_answered(self, job: Job) -> bool:
        """Answer a read from what was read for another program, where that is young enough."""
        if not job.max_age or job.begun:
            return False
        reply = self._values.find(job.request, self._clock() - job.max_age)
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
        if not job.request.changes:
            return ""
        return self.facts.refusal(job.program, job.request.device, job.stamp)

    async def _run(self, master: Master, job: Job) -> None:
        if self._left_alone(job) or self._is_answered(job):
            return
        if not job.begun and not job.answer.set_running_or_notify_cancel():
            return
        job.begun = True
        if (why := self.refusal(job)) or (job.forbidden is not None and (why := job.forbidden())):
            job.fail(RequestRefused(why))
            return
        if job.request.changes:
            self._values.drop(job.request.device)
        begun = self._clock()
        self.in_flight = True
        try:
            result = await master.exchange(self._sending(job))
            if result.kind is ResultKind.UNSURE:
                await self._resolve_echo(master, job, result)
            if self._is_repeat(job, result):
                result = await self._ask_again(master, job, result)
        except LineLost:
            # failed with the others, once the line's state says that it is lost
            self._queue.put_back(job)
            self.in_flight = False
            if job.expectation is not None:
                now = self._clock()
                self._devices.may_come(job.request.device, job.expectation, begun, now)
            raise
        except asyncio.CancelledError:
            job.fail(LineClosed(_with_fate(job, "The line was closed during the request.")))
            raise
        except BaseException as error:
            job.fail(LineError(_with_fate(job, f"The request failed: {error!r}.")))
            raise
        self.in_flight = False
        self._conclude(job, result)

    def _sending(self, job: Job) -> Sending:
        request = job.request
        if job.expectation is None:
            return Sending(request.device, job.pdu, None, 0.0)
        sure, skip = self._devices.doubts(request.device, job.expectation, self._clock())
        return Sending(
            request.device,
            job.pdu,
            job.expectation,
            self._devices.time_out(request.device, request.function, job.priority),
            sure,
            skip,
        )

    async def _resolve_echo(self, master: Master, job: Job, result: ExchangeResult) -> None:
        """Tell an echo from an answer that repeats its request: see what a read comes back as."""
        request = job.request
        if Read.function in job.limits.functions:
            probe = Read(request.device, request.register, 1)
            await master.quiet()
            time_out = self._devices.time_out(request.device, probe.function, job.priority)
            await master.exchange(
                Sending(request.device, probe.pdu(), probe.expectation(), time_out)
            )
        if master.echo is False:
            result.kind, result.pdu = ResultKind.REPLY, job.pdu
        else:
            result.kind = ResultKind.NOTHING
            result.detail = "only the adapter's echo of it came back"

    def _is_repeat(self, job: Job, result: ExchangeResult) -> bool:
        """Whether a reply may be a copy of the one before."""
        return result.kind is ResultKind.REPLY and self._devices.is_repeat(
            job.request.device, job.pdu, result.pdu, result.turnaround
        )

    async def _ask_again(self, master: Master, job: Job, doubted: ExchangeResult) -> ExchangeResult:
        """The same once more: whichever of its two replies comes first, it is the right one."""
        await master.quiet()
        result = await master.exchange(self._sending(job))
        if result.pdu != doubted.pdu and job.expectation is not None:
            # it was a copy: one more reply to this request is on its way
            device, now = job.request.device, self._clock()
            self._devices.may_come(device, job.expectation, result.sent, now)
        self._note_strays(doubted.strays, doubted.end)
        return result

    def _conclude(self, job: Job, result: ExchangeResult) -> None:
        """Note what became of a request, and hand it back or send it again."""
        request, now = job.request, self._clock()
        if job.expectation is None:
            self._note_strays(result.strays, result.end)
            job.finish(b"", result.sent)
            return
        if result.kind is ResultKind.EXCEPTION and self._is_gateways(job, result.exception):
            result.kind, result.detail = ResultKind.NOTHING, "the gateway heard nothing of it"
        if result.kind in (ResultKind.REPLY, ResultKind.EXCEPTION):
            self._tally.replies += 1
            exchanged = (job.pdu, result.pdu)
            self._devices.answered(
                request.device, job.expectation, result.turnaround, now, exchanged
            )
        unexplained = self._note_strays(result.strays, result.end)
        if result.kind is ResultKind.WRONG and result.strays and request.device not in unexplained:
            result.kind = ResultKind.NOTHING
        match result.kind:
            case ResultKind.REPLY:
                self._share(job, result)
                job.finish(result.pdu, result.end)
            case ResultKind.EXCEPTION:
                self._tally.exceptions += 1
                job.fail(self._exception(job, result.exception))
            case _:
                self._failed(job, result, now)

    def _share(self, job: Job, result: ExchangeResult) -> None:
        """Keep what was read, while there is another program that may want it."""
        if len(self.facts.programs) > 1:
            self._values.note(job.request, job.request.words(result.pdu), result.end)

    def _failed(self, job: Job, result: ExchangeResult, now: float) -> None:
        request, expectation = job.request, job.expectation
        assert expectation is not None
        place = (request.device, request.function, request.register)
        error: LineError
        match result.kind:
            case ResultKind.DAMAGED:
                self._tally.checksum += 1
                if not result.recognised:
                    self._devices.may_come(request.device, expectation, result.sent, now)
                error = ChecksumFault(*place, received=result.received)
            case ResultKind.WRONG:
                self._tally.wrong += 1
                self._devices.may_come(request.device, expectation, result.sent, now)
                error = WrongReply(*place, result.detail, result.received)
            case _:
                known = self._devices[request.device].ever_answered
                self._tally.count_silence(job.priority, known=known)
                self._devices.silent(request.device, expectation, result.sent, now)
                error = NoAnswer(*place, self._no_answer(job, result.detail))
        if self._is_repeated(job, result.kind):
            job.repeats += 1
            self._queue.put_back(job)
            self._wake.set()
        else:
            job.fail(error)

    def _is_repeated(self, job: Job, kind: ResultKind) -> bool:
        """Whether a request is sent again: never one that changes anything."""
        if job.request.changes or job.repeats >= self._timing.retries:
            return False
        if kind is ResultKind.DAMAGED:
            return job.priority < Priority.BACKGROUND
        known = self._devices[job.request.device].ever_answered
        return kind is ResultKind.NOTHING and known and job.priority in REPEATED_WHEN_SILENT

    def _note_strays(self, strays: Iterable[Piece], time: float) -> set[int]:
        """Pass on frames that came beside the reply; returns the devices of unexplained ones."""
        unexplained = set()
        for piece in strays:
            self._tally.stale += 1
            if not self._devices.stray(piece, time):
                unexplained.add(piece.device)
        return unexplained

    def _is_gateways(self, job: Job, code: int) -> bool:
        meanings = job.limits.exceptions
        own = code in meanings and meanings is not STANDARD_EXCEPTIONS
        return self._gateway and code in GATEWAY_EXCEPTIONS and not own

    def _exception(self, job: Job, code: int) -> DeviceException:
        request = job.request
        meaning = job.limits.exceptions.get(code) or STANDARD_EXCEPTIONS.get(code, "")
        return DeviceException(request.device, request.function, request.register, code, meaning)

    def _no_answer(self, job: Job, detail: str) -> str:
        request = job.request
        what = f"function {request.function}"
        if request.register:
            what += f", register {request.register}"
        text = f"Device {request.device} did not answer ({what})"
        return _with_fate(job, f"{text}: {detail}." if detail else f"{text}.")


def _with_fate(job: Job, text: str) -> str:
    """Add to an error of a write that it may have been taken nevertheless."""
    unknown = job.request.changes and job.request.device != BROADCAST
    return text + UNKNOWN_FATE if unknown else text
