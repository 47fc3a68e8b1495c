"""Requests that end without having been sent."""

from __future__ import annotations

from tui.safety import STOP_KEPT_FOR

from ..errors import LineError, NoAnswer
from ..model import Priority
from ..requests import Diagnose
from ..shared_state import SharedState
from .outcomes import with_fate
from .patience import Devices
from .queue import Job
from .shared_values import SharedValues


def is_stop_word(job: Job) -> bool:
    """True if a request stops a motor, also when it is repeated: nothing holds it back."""
    return job.request.changes and job.priority <= Priority.FEED


def fail_without_line(job: Job, error: LineError) -> None:
    """Fail a request without a line. A stop that cannot read then sends its word."""
    place = (job.request.device, job.request.function, job.request.register)
    reads = job.priority is Priority.STOP and not job.request.changes
    job.fail(NoAnswer(*place, str(error)) if reads else error)


def fail_lost(
    job: Job, reason: str, kind: type[LineError], now: float, *, keeps: bool
) -> Job | None:
    """Fail a request of a lost line; returns the stop that is still to be sent, if it `keeps` any.

    The program gets the error at once; the stop word is sent as soon as the line opens.
    """
    error = kind(with_fate(job, reason) if job.begun else reason)
    if not keeps:
        job.fail(error)
        return None
    fail_without_line(job, error)
    if not is_stop_word(job) or now - job.requested > STOP_KEPT_FOR:
        return None
    kept = Job(job.request, job.priority, job.limits, order=job.order)
    kept.program, kept.requested = job.program, job.requested
    return kept


def ends_unsent(job: Job, devices: Devices, values: SharedValues, now: float) -> bool:
    """End a request if polling of its device is paused, or if its reply is known already."""
    return _is_left_alone(job, devices, now) or _is_answered(job, values, now)


def _is_left_alone(job: Job, devices: Devices, now: float) -> bool:
    """Fail a poll of a silent device that is not polled again yet."""
    device = job.request.device
    rest = devices.backed_off(device, job.priority, now, job.within)
    if rest is None:
        return False
    text = f"Device {device} does not answer."
    job.fail(NoAnswer(device, job.request.function, job.request.register, text, retry_in=rest))
    return True


def _is_answered(job: Job, values: SharedValues, now: float) -> bool:
    """Answer a read with words that were read for another program, if they are recent enough."""
    if not job.max_age or job.begun:
        return False
    reply = values.find(job.request, now - job.max_age)
    if reply is None or not job.answer.set_running_or_notify_cancel():
        return False
    job.begun = True
    job.answer.set_result(reply)
    return True


def refusal_of(job: Job, facts: SharedState) -> str:
    """Reason if a write must not be sent: a stop came after it, or another program commands."""
    if job.priority is Priority.STOP or not job.program:
        return ""
    if paused := facts.paused.get(job.request.device):
        return paused[1]
    if not job.commands:
        return ""
    writes = job.request.function != Diagnose.function
    return facts.refusal(job.program, job.request.device, job.stamp, writes=writes)
