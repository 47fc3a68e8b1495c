"""Requests that end without having been sent."""

from __future__ import annotations

from ..errors import NoAnswer
from ..model import Priority
from ..requests import Diagnose
from ..shared_facts import SharedFacts
from .patience import Devices
from .queue import Job
from .shared_values import SharedValues


def ends_unsent(job: Job, devices: Devices, values: SharedValues, now: float) -> bool:
    """End a request whose device is not polled now, or whose reply is known already."""
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
    """Answer a read from what was read for another program, if that is young enough."""
    if not job.max_age or job.begun:
        return False
    reply = values.find(job.request, now - job.max_age)
    if reply is None or not job.answer.set_running_or_notify_cancel():
        return False
    job.begun = True
    job.answer.set_result(reply)
    return True


def refusal_of(job: Job, facts: SharedFacts) -> str:
    """Why a write must not go out: a stop came after it, or another program commands."""
    if job.priority is Priority.STOP or not job.program:
        return ""
    if hushed := facts.hushed.get(job.request.device):
        return hushed[1]
    if not job.commands:
        return ""
    writes = job.request.function != Diagnose.function
    return facts.refusal(job.program, job.request.device, job.stamp, writes=writes)
