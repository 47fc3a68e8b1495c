"""Proof that a drive's replies belong to the requests that they follow.

An RTU reply names no request. After another process has used the line, a reply to it may still
come, and could be taken for the reply to the first request sent from here. A diagnostic echo
(function 8, sub-function 0) returns a number that no earlier request had.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable

from ..coils import single_read
from ..master import ExchangeResult, Master, MonotonicClock, ResultKind, Sending
from ..model import Priority
from ..requests import BROADCAST, Diagnose, Request
from .in_step import InStep
from .outcomes import Outcomes
from .patience import Devices
from .probes import ECHO
from .queue import Job

MOST_TRIES = 3
"""Most requests for a proof; then the device must wait."""


class StepProof:
    """Holds requests back until their drive has echoed a number, or no late reply may come.

    The words of a stop wait for neither, and are sent once more then.
    """

    def __init__(
        self,
        devices: Devices,
        outcomes: Outcomes,
        clock: MonotonicClock,
        submit: Callable[[Job], None],
        steps: InStep,
    ) -> None:
        self._devices = devices
        self._outcomes = outcomes
        self._clock = clock
        self._submit = submit
        self._steps = steps
        self.busy = False
        """True while a reply to a request for a proof is due."""
        self._until = 0.0
        self._proved: set[int] = set()
        self._tries: dict[int, int] = {}
        self._repeats: dict[int, Job] = {}
        """The last stop of each device that was sent when replies proved nothing."""

    def doubt(self, until: float) -> None:
        """Trust no reply before a time on the line's clock, unless its drive has proved itself."""
        self._until = until
        self._proved.clear()
        self._tries.clear()
        for job in self._repeats.values():
            job.answer.cancel()
        self._repeats.clear()

    @property
    def repeats_wait(self) -> bool:
        """True while a stop is still to be repeated."""
        return not all(job.answer.done() for job in self._repeats.values())

    def sent(self, job: Job, time: float) -> None:
        """Repeat a stop that was sent at a time when no reply proves anything.

        As soon as the device has proved itself, or no late reply may come. Nothing else that
        changes the device goes before it.
        """
        stops, device = job.priority is Priority.STOP and job.request.changes, job.request.device
        if not stops or time >= self._until or device in self._proved:
            return
        if (before := self._repeats.get(device)) is not None:
            before.answer.cancel()
        self._repeats[device] = again = Job(job.request, Priority.FEED, job.limits, requested=time)
        self._submit(again)

    def not_before(self, job: Job, now: float) -> float:
        """The time at which a request may go out, or be preceded by a proof; 0 for at once."""
        if not self._doubts(job, now):
            return 0.0
        device = job.request.device
        limits = job.limits
        echoes = Diagnose.function in limits.functions and ECHO in limits.subfunctions
        if device != BROADCAST and echoes and self._tries.get(device, 0) < MOST_TRIES:
            return 0.0
        return self._until

    def is_due(self, job: Job) -> bool:
        """True if the request's drive must first prove its step."""
        return self._doubts(job, self._clock())

    def _doubts(self, job: Job, now: float) -> bool:
        if now >= self._until or job.request.device in self._proved:
            return False
        return job.priority is not Priority.STOP or not job.request.changes

    def doubts_refusal(self, device: int) -> bool:
        """True while a refusal may be one of a request of the holder before."""
        return self._clock() < self._until and device not in self._proved

    async def prove(self, master: Master, job: Job) -> None:
        """Send one request that leads to the proof of a drive; a stop may follow it at once.

        Raises LineLost.
        """
        device = job.request.device
        tries = self._tries[device] = self._tries.get(device, 0) + 1
        read = single_read(job.request)
        if master.echo is None and tries < MOST_TRIES and read.function in job.limits.functions:
            # a number that came back may be from an adapter that repeats what is sent; a read
            # tells, whatever its reply, unless another reply comes just then
            result = await self._exchange(master, job, read)
        else:
            echo = Diagnose(device, ECHO, secrets.randbelow(1 << 16))
            result = await self._exchange(master, job, echo)
            if result.kind is ResultKind.REPLY:
                self._proved.add(device)
        if result.kind is ResultKind.NOTHING:
            # other drives must not wait for a silent one
            self._tries[device] = MOST_TRIES

    async def _exchange(self, master: Master, job: Job, request: Request) -> ExchangeResult:
        """Send a request whose reply is kept from being taken for that of a later one."""
        device, expectation, begun = request.device, request.expectation(), self._clock()
        time_out = self._devices.time_out(device, request.function, job.priority, job.within)
        result, self.busy = None, True
        try:
            sending = Sending(device, request.pdu(), expectation, time_out)
            result = await master.exchange(sending)
            self._outcomes.record(device, sending.pdu, result, job)
        finally:
            self.busy = False
            if result is None or result.kind not in (ResultKind.REPLY, ResultKind.EXCEPTION):
                sent = begun if result is None else result.sent
                self._devices.may_come(device, expectation, sent, self._clock())
        self._steps.note(job, expectation, result, number=isinstance(request, Diagnose))
        self._outcomes.count_beside(device, result)
        return result
