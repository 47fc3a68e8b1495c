"""The plans of programs on a line: carried out by its owner, and handed to it by a client."""

from __future__ import annotations

import asyncio
import itertools
import logging
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from tui.safety import SHARED_AGE

from ..bounds import MOST_DEVICES, MOST_STRETCH
from ..coils import read_request
from ..errors import DeviceException, LineError, RequestRefused
from ..limits import CAUTIOUS, Limits, send_refusal
from ..link import character_time, silence
from ..model import Priority, Reply
from ..poll_plan import USUAL_TURNAROUND, PlannedRead, PolledTurn, PollPlan, Subscription
from ..schedule.inside import LineInside
from ..schedule.pace import SHARE, greatest
from ..schedule.queue import Job
from .attached import Client
from .carried import Polled, PolledReply, Subscribe, Unsubscribe, error_form, error_from
from .messages import AnyMessage, NoMessage

log = logging.getLogger(__name__)

MOST_UNTAKEN = 1 << 16
"""Bytes that a program may leave unread before nothing is polled for it."""
MOST_PLANNED = 1 << 16
"""Reads in all plans of one program."""
SHARED_OUT_EVERY = 0.5
"""Seconds from one look at all plans to the next."""
CLOCK_STEP = 1e-6
"""Seconds by which a reply is newer than another, at least."""
READ_CHARACTERS = 13
"""Characters of a read and its reply, besides the words."""


@dataclass(eq=False, slots=True)
class ServedPlan:
    """One plan of one program."""

    client: Client
    message: Subscribe
    rates: dict[PlannedRead, float]
    """Rate of each of its reads per second."""
    task: asyncio.Task[None] | None = None
    read_at: dict[PlannedRead, float] = field(default_factory=dict)
    """The time of the last reply to each read."""

    @property
    def size(self) -> int:
        """Its reads, those of all turns."""
        return sum(len(turn) for turn in self.message.plan.turns)


class PollsServed:
    """Carries plans out, each in a task of the line's loop, as polls of the program they are of."""

    def __init__(self, inside: LineInside) -> None:
        self._inside = inside
        self._served: dict[Client, dict[int, ServedPlan]] = {}
        self._shared_out = -math.inf

    def start(self, client: Client, message: Subscribe) -> None:
        """Carry a plan out from now on. Raises NoMessage."""
        self.end(client, message.number)
        served = self._served.setdefault(client, {})
        plan, served_plan = message.plan, ServedPlan(client, message, message.plan.rates)
        if len(served) >= MOST_DEVICES:
            raise NoMessage("too many plans")
        limits = client.limits.get(plan.device, CAUTIOUS)
        why = plan_refusal(plan, limits)
        if served_plan.size + sum(other.size for other in served.values()) > MOST_PLANNED:
            why = why or f"Not polled: more than {MOST_PLANNED} reads."
        if why:
            failure = PolledReply(b"", 0.0, error_form(RequestRefused(why)))
            client.say(Polled(message.number, 0, self._inside.clock(), (failure,)))
            return
        served[message.number] = served_plan
        served_plan.task = asyncio.get_running_loop().create_task(
            self._work(served_plan), name=f"polls of device {plan.device}"
        )
        served_plan.task.add_done_callback(_note_error)

    def end(self, client: Client, number: int) -> None:
        """End a plan."""
        plan = self._served.get(client, {}).pop(number, None)
        if plan is not None and plan.task is not None:
            plan.task.cancel()

    def end_all(self, client: Client) -> None:
        """End all plans of a program that has left."""
        for number in list(self._served.get(client, {})):
            self.end(client, number)
        self._served.pop(client, None)

    def close(self) -> None:
        """End all plans."""
        for client in list(self._served):
            self.end_all(client)

    # The time of the line

    def share_out(self, wishes: Mapping[int, float]) -> None:
        """Calculate the factor for the periods of all polls; `wishes` are those of the programs.

        To be called often; the factor is calculated once every SHARED_OUT_EVERY seconds.
        """
        pace, now = self._inside.pace, self._inside.clock()
        if now - self._shared_out < SHARED_OUT_EVERY:
            return
        self._shared_out = now
        pace.others = wishes
        wished = sum(greatest(pace.own, pace.others, self._shares()).values())
        pace.stretch = min(max(1.0, wished / SHARE), MOST_STRETCH)

    def _shares(self) -> dict[int, float]:
        """The share of the line's time that plans want, by device; the same read counts once."""
        rates: dict[int, dict[PlannedRead, float]] = {}
        for plan in self._all():
            known = rates.setdefault(plan.message.plan.device, {})
            for read, rate in plan.rates.items():
                known[read] = max(rate, known.get(read, 0.0))
        return {device: self._share(device, reads) for device, reads in rates.items()}

    def _all(self) -> list[ServedPlan]:
        return [plan for plans in self._served.values() for plan in plans.values()]

    def _share(self, device: int, rates: Mapping[PlannedRead, float]) -> float:
        """The share of the time that reads of a device take on the wire, without repeats."""
        link = self._inside.link
        measured = self._inside.devices.state(device).usual_turnaround
        quiet, turnaround = silence(link), USUAL_TURNAROUND if measured is None else measured
        character, waits = character_time(link), max(turnaround, quiet) + quiet
        return sum(
            ((READ_CHARACTERS + 2 * read.count) * character + waits) * rate
            for read, rate in rates.items()
        )

    # Reading

    async def _work(self, served_plan: ServedPlan) -> None:
        clock, plan = self._inside.clock, served_plan.message.plan
        due, turn = min(plan.begin, clock() + plan.period), 0
        while True:
            await asyncio.sleep(max(0.0, due - clock()))
            begun = clock()
            if served_plan.client.unread <= MOST_UNTAKEN:
                replies = await self._cycle(served_plan, turn)
                served_plan.client.say(Polled(served_plan.message.number, turn, begun, replies))
                turn = (turn + 1) % len(plan.turns)
            due = begun + plan.period * self._inside.pace.stretch

    async def _cycle(self, plan: ServedPlan, turn: int) -> tuple[PolledReply, ...]:
        """The replies of one cycle; a silent device is not polled for the rest of it."""
        found: list[PolledReply] = []
        for read in plan.message.plan.turns[turn]:
            try:
                reply = await self._read(plan, read)
            except LineError as error:
                found.append(PolledReply(b"", 0.0, error_form(error)))
                if not isinstance(error, DeviceException):
                    break
            else:
                plan.read_at[read] = reply.time
                found.append(PolledReply(reply.pdu, reply.time))
        return tuple(found)

    async def _read(self, plan: ServedPlan, read: PlannedRead) -> Reply:
        """One read, as a single poll of the program. Raises the line's errors."""
        device, now = plan.message.plan.device, self._inside.clock()
        request = read_request(device, read.address, read.count, read.function)
        limits = plan.client.limits.get(device, CAUTIOUS)
        job = Job(request, Priority.POLL, limits)
        job.program, job.requested = plan.client.program.id, now
        period = plan.message.plan.period * self._inside.pace.stretch
        # nothing that this program has been given already
        since = now - plan.read_at.get(read, 0.0) - CLOCK_STEP
        job.max_age = max(0.0, min(period * SHARED_AGE, since))
        self._inside.submit(job)
        await _ended(job)
        return job.answer.result()


def _note_error(task: asyncio.Task[None]) -> None:
    """An internal error has ended a plan; its program reads after a while."""
    if not task.cancelled() and (error := task.exception()) is not None:
        log.error("%s ended by an error", task.get_name(), exc_info=error)


async def _ended(job: Job) -> None:
    """Wait for the answer to a job, which is set in this loop; withdraw it if cancelled."""
    ended = asyncio.Event()
    job.answer.add_done_callback(lambda _: ended.set())
    try:
        await ended.wait()
    except asyncio.CancelledError:
        job.answer.cancel()
        raise


class PollsSubmitted:
    """One attachment's plans; lives in the line's loop."""

    def __init__(
        self,
        inside: LineInside,
        tell: Callable[[AnyMessage], None],
        describe: Callable[[int, Limits], None],
        answers: Callable[[], bool],
    ) -> None:
        """`describe` has the owner know the limits of a device before a plan of it."""
        self._inside = inside
        self._tell = tell
        self._describe = describe
        self._answers = answers
        self._numbers = itertools.count(1)
        self._subscriptions: dict[int, Subscription] = {}

    def subscribe(self, plan: PollPlan) -> Subscription | None:
        """Have the owner carry a plan out; None while it does not answer. Raises RequestRefused."""
        if not self._answers():
            return None
        limits = self._inside.devices[plan.device].limits
        if why := plan_refusal(plan, limits):
            raise RequestRefused(why)
        number = next(self._numbers)
        self._subscriptions[number] = found = Subscription(plan, lambda: self._end(number))
        self._describe(plan.device, limits)
        self._tell(Subscribe(number, plan))
        return found

    def _end(self, number: int) -> None:
        if self._subscriptions.pop(number, None) is not None:
            self._tell(Unsubscribe(number))

    def hear(self, message: Polled) -> None:
        """Pass on a cycle. Raises NoMessage."""
        found = self._subscriptions.get(message.number)
        closed = any(
            reply.failure and reply.failure.kind == "LineClosed" for reply in message.replies
        )
        if found is None or closed:
            return  # sent before the plan or its owner ended, which does not concern this program
        plan = found.plan
        if message.turn >= len(plan.turns):
            raise NoMessage(f"turn {message.turn} of {len(plan.turns)}")
        reads = plan.turns[message.turn]
        answers = {
            read: _answer_of(reply, plan.device, read.address, read.count, read.function)
            for read, reply in zip(reads, message.replies, strict=False)
        }
        times = [answer.time for answer in answers.values() if isinstance(answer, Reply)]
        if times:
            self._inside.devices[plan.device].heard = max(times)
        found.hear(PolledTurn(message.turn, message.begun, answers))

    def lose_all(self) -> None:
        """End all plans: the owner has exited, or does not answer, and must not resume them."""
        lost, self._subscriptions = self._subscriptions, {}
        for number, subscription in lost.items():
            subscription.lose()
            self._tell(Unsubscribe(number))


def plan_refusal(plan: PollPlan, limits: Limits) -> str:
    """Why a plan must not be carried out, as for a single read of it; empty if it may."""
    for rate in plan.rates:
        request = read_request(plan.device, rate.address, rate.count, rate.function)
        if why := send_refusal(request, limits):
            return why
    return ""


def _answer_of(
    reply: PolledReply, device: int, address: int, count: int, function: int
) -> Reply | LineError:
    """Return the reply or error in a message for one read. Raises NoMessage."""
    if reply.failure is not None:
        return error_from(reply.failure)
    request = read_request(device, address, count, function)
    if not request.expectation().fits(reply.pdu):
        raise NoMessage("a reply of another length")
    return Reply(request.words(reply.pdu), reply.time, reply.pdu)
