"""Telling a copy of the reply before from the reply to a request."""

from __future__ import annotations

from ..master import Master, Sending
from ..result import ExchangeResult, ResultKind
from .outcomes import Outcomes
from .patience import Devices
from .queue import Job


def is_copy(job: Job, result: ExchangeResult, devices: Devices) -> bool:
    """True if a reply may be a copy of the one before."""
    return result.kind is ResultKind.REPLY and devices.is_repeat(
        job.request.device, job.pdu, result.pdu, result.turnaround
    )


async def ask_again(
    master: Master,
    job: Job,
    doubted: ExchangeResult,
    sending: Sending,
    devices: Devices,
    outcomes: Outcomes,
) -> ExchangeResult:
    """Send the same request again: whichever of its two replies comes first is right.

    Raises LineLost.
    """
    device = job.request.device
    await master.quiet()
    result = await master.exchange(sending)
    outcomes.count_beside(device, doubted)
    if result.pdu != doubted.pdu and job.expectation is not None:
        # it was a copy: one more reply to this request is on its way
        devices.may_come(device, job.expectation, result.sent, result.end)
    outcomes.note_strays(doubted.strays, doubted.end)
    return result
