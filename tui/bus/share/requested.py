"""The requests that a client has handed to the owner of its line, until they are answered."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from contextlib import suppress

from ..errors import OUTCOME_UNKNOWN, LineClosed, LineLost, NoAnswer, RequestRefused
from ..limits import Limits
from ..model import Priority
from ..requests import BROADCAST
from ..schedule.inside import LineInside
from ..schedule.queue import Job
from .carried import error_from, request_form
from .messages import Answer, AnyMessage, Asking, Describe, Failed, Withdraw

OWNER_ENDED = "The program that owned the line ended"


class PendingRequests:
    """One attachment's requests; lives in the line's loop."""

    def __init__(self, inside: LineInside, tell: Callable[[AnyMessage], None]) -> None:
        self._inside = inside
        self._tell = tell
        self._loop = asyncio.get_running_loop()
        self._numbers = itertools.count(1)
        self._requested: dict[int, Job] = {}
        self._left: set[int] = set()
        """Stops that have no waiting caller."""
        self._described: dict[int, object] = {}

    def send(self, job: Job) -> None:
        """Hand a job to the owner, unless it must not be sent."""
        if job.answer.cancelled():
            return
        request = job.request
        if why := self._inside.dispatcher.forbidden(job):
            job.fail(RequestRefused(why))
            return
        self.describe(request.device, job.limits)
        kind, fields = request_form(request)
        number = next(self._numbers)
        self._requested[number] = job
        job.answer.add_done_callback(lambda answer: self._withdrawn(number, answer.cancelled()))
        limits = job.limits if request.device == BROADCAST else None
        self._tell(
            Asking(
                number, kind, fields, job.priority, job.replaceable, job.max_age,
                job.stamp, job.requested, limits, job.within,
            )
        )  # fmt: skip

    def describe(self, device: int, limits: Limits) -> None:
        """Report the requests that a device accepts to the owner."""
        if device != BROADCAST and self._described.get(device) is not limits:
            self._described[device] = limits
            self._tell(Describe(device, limits))

    def _withdrawn(self, number: int, cancelled: bool) -> None:
        """Called in any thread: the caller no longer waits for the answer."""
        if cancelled:
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._withdraw, number)

    def _withdraw(self, number: int) -> None:
        if self._requested.pop(number, None) is not None:
            self._tell(Withdraw(number))

    def answered(self, message: Answer | Failed) -> None:
        """Result of a request from the owner."""
        job = self._requested.pop(message.number, None)
        if job is None or not (job.begun or job.answer.set_running_or_notify_cancel()):
            return
        job.begun = True
        if isinstance(message, Answer):
            self._inside.devices[job.request.device].heard = message.time
            job.finish(job.reply(message.pdu, message.time))
        else:
            self._failed(job, message)

    def _failed(self, job: Job, message: Failed) -> None:
        if message.form.kind == "LineClosed":
            # the owner's end is not this program's
            self._give_up(job, sent=OUTCOME_UNKNOWN in message.form.text)
        else:
            job.fail(error_from(message.form))

    def fail_all(self, why: str) -> None:
        """Fail all waiting requests; later only stop words are still sent."""
        for number, job in list(self._requested.items()):
            stops = job.priority is Priority.STOP
            if stops and job.request.changes:
                if number not in self._left:
                    self._left.add(number)
                    self._requested[number] = _without_asker(job)
                    job.fail(LineLost(why))
                continue
            self._withdraw(number)
            if stops:
                # a drive that does not answer is sent its stop without a look
                request = job.request
                job.fail(NoAnswer(request.device, request.function, request.register, why))
            else:
                job.fail(LineLost(why + (OUTCOME_UNKNOWN if job.request.changes else "")))

    def give_up_all(self, *, closing: bool) -> None:
        """Give up all requests: the owner has exited, or this program leaves it (`closing`)."""
        requested, self._requested = self._requested, {}
        for job in requested.values():
            if closing and job.request.changes:
                job.fail(LineClosed(f"The line was closed during the request.{OUTCOME_UNKNOWN}"))
            else:
                self._give_up(job, sent=True)

    def _give_up(self, job: Job, *, sent: bool) -> None:
        """The owner ended before it answered: a read is sent again, a write never is.

        A stop is sent again: it may have got lost, and does no harm twice.
        """
        if not job.request.changes or job.priority is Priority.STOP:
            if not job.answer.cancelled():
                self._inside.dispatcher.put_back(job)
            return
        text = (
            f"{OWNER_ENDED} during the request.{OUTCOME_UNKNOWN}"
            if sent
            else f"{OWNER_ENDED}; this was not sent."
        )
        job.fail(LineLost(text))


def _without_asker(job: Job) -> Job:
    """A copy of a job whose reply has no receiver."""
    again = Job(job.request, job.priority, job.limits)
    again.program, again.requested = job.program, job.requested
    return again
