"""Proof that a drive's replies belong to the requests that they follow.

An RTU reply names no request. After another process has used the line, a reply to it may still
come, and could be taken for the reply to the first request sent from here. A diagnostic echo
(function 8, sub-function 0) returns a number that no earlier request had.
"""

from __future__ import annotations

import secrets

from ..master import Master, MonotonicClock, Sending
from ..model import Priority
from ..requests import BROADCAST, Diagnose, Read, Request
from ..result import ExchangeResult, ResultKind
from .outcomes import Outcomes
from .patience import Devices
from .queue import Job

ECHO = 0
"""The sub-function that every device echoes, if it has function 8."""
MOST_TRIES = 2
"""Echoes that a device may miss; then it has to wait."""


class StepProof:
    """Holds requests back until their drive has echoed a number, or no late reply may come.

    The words of a stop wait for neither.
    """

    def __init__(self, devices: Devices, outcomes: Outcomes, clock: MonotonicClock) -> None:
        self._devices = devices
        self._outcomes = outcomes
        self._clock = clock
        self._until = 0.0
        self._proved: set[int] = set()
        self._tries: dict[int, int] = {}

    def doubt(self, until: float) -> None:
        """Trust no reply before a time on the line's clock, unless its drive has proved itself."""
        self._until = until
        self._proved.clear()
        self._tries.clear()

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
        """True if the request's drive has to prove itself first."""
        return self._doubts(job, self._clock())

    def _doubts(self, job: Job, now: float) -> bool:
        if now >= self._until or job.request.device in self._proved:
            return False
        return job.priority is not Priority.STOP or not job.request.changes

    async def prove(self, master: Master, job: Job) -> None:
        """Have the drive of a request echo a number. Raises LineLost."""
        device = job.request.device
        self._tries[device] = self._tries.get(device, 0) + 1
        for _ in range(MOST_TRIES):
            # a number that came back may be from an adapter that repeats what is sent; a read
            # tells, whatever its reply, unless another reply comes just then
            if master.echo is None and Read.function in job.limits.functions:
                await self._exchange(master, job, Read(device, job.request.register, 1))
                await master.quiet()
        echo = Diagnose(device, ECHO, secrets.randbelow(1 << 16))
        if (await self._exchange(master, job, echo)).kind is ResultKind.REPLY:
            self._proved.add(device)

    async def _exchange(self, master: Master, job: Job, request: Request) -> ExchangeResult:
        device = request.device
        time_out = self._devices.time_out(device, request.function, job.priority, job.within)
        sending = Sending(device, request.pdu(), request.expectation(), time_out)
        result = await master.exchange(sending)
        self._outcomes.count_beside(device, result)
        return result
