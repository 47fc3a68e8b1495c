"""The plans that a client has handed to the owner of its line."""

from __future__ import annotations

import itertools
from collections.abc import Callable

from ..errors import LineError, RequestRefused
from ..limits import Limits, send_refusal
from ..model import Reply
from ..poll_plan import PolledTurn, PollPlan
from ..requests import read_request
from ..schedule.inside import LineInside
from ..schedule.polls import Subscription
from .carried import error_of
from .messages import AnyMessage, NoMessage
from .poll_messages import Polled, PolledReply, Subscribe, Unsubscribe


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
        """A cycle has come. Raises NoMessage."""
        found = self._subscriptions.get(message.number)
        closed = any(one.failure and one.failure[0] == "LineClosed" for one in message.replies)
        if found is None or closed:
            return  # on its way when the plan ended, or the owner, whose end is not this program's
        plan = found.plan
        if message.turn >= len(plan.turns):
            raise NoMessage(f"turn {message.turn} of {len(plan.turns)}")
        reads = plan.turns[message.turn]
        answers = {
            read: _answer_of(one, plan.device, read.address, read.count, read.function)
            for read, one in zip(reads, message.replies, strict=False)
        }
        times = [one.time for one in answers.values() if isinstance(one, Reply)]
        if times:
            self._inside.devices[plan.device].heard = max(times)
        found.hear(PolledTurn(message.turn, message.begun, answers))

    def lose_all(self) -> None:
        """The owner is gone, or does not answer: it is to carry nothing out when it does again."""
        lost, self._subscriptions = self._subscriptions, {}
        for number, one in lost.items():
            one.lose()
            self._tell(Unsubscribe(number))


def plan_refusal(plan: PollPlan, limits: Limits) -> str:
    """Why a plan must not be carried out, as for a single read of it; empty if it may."""
    for one in plan.rates:
        request = read_request(plan.device, one.address, one.count, one.function)
        if why := send_refusal(request, limits):
            return why
    return ""


def _answer_of(
    reply: PolledReply, device: int, address: int, count: int, function: int
) -> Reply | LineError:
    """What a message brings for one read. Raises NoMessage."""
    if reply.failure is not None:
        return error_of(*reply.failure)
    if len(reply.pdu) != 2 + 2 * count or reply.pdu[:2] != bytes([function, 2 * count]):
        raise NoMessage("a reply of another length")
    request = read_request(device, address, count, function)
    return Reply(request.words(reply.pdu), reply.time, reply.pdu)
