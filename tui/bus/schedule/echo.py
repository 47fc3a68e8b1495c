"""Telling the echo of an adapter from a reply that repeats its request."""

from __future__ import annotations

from ..master import Master, Sending
from ..requests import Read
from ..result import ExchangeResult, ResultKind
from .outcomes import Outcomes
from .patience import Devices
from .queue import Job


async def resolve_echo(
    master: Master, job: Job, result: ExchangeResult, devices: Devices, outcomes: Outcomes
) -> None:
    """Decide on a result that may be either, by the echo of a read. Raises LineLost."""
    request = job.request
    if Read.function in job.limits.functions:
        probe = Read(request.device, request.register, 1)
        await master.quiet()
        time_out = devices.time_out(request.device, probe.function, job.priority)
        probed = await master.exchange(
            Sending(request.device, probe.pdu(), probe.expectation(), time_out)
        )
        outcomes.count_beside(request.device, probed)
    if master.echo is False:
        result.kind, result.pdu = ResultKind.REPLY, job.pdu
    else:
        result.kind = ResultKind.NOTHING
        result.detail = "only the adapter's echo of it came back"
