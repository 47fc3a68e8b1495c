"""Requests of a client of a shared line, and the messages of its owner; without a socket."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import Priority
from tui.bus.errors import (
    OUTCOME_UNKNOWN,
    LineClosed,
    LineLost,
    NoAnswer,
    RequestRefused,
    WrongReply,
)
from tui.bus.line_events import (
    ControlDenied,
    ControlRequested,
    DevicesStopped,
    DeviceWritten,
    LineEvent,
    NoticeReceived,
)
from tui.bus.notes import NOTES_A_LOOK
from tui.bus.program import Program
from tui.bus.requests import Read, WriteOne
from tui.bus.schedule.queue import Job
from tui.bus.share import client as client_module
from tui.bus.share.carried import error_form
from tui.bus.share.client import STOP_UNHEARD, ShareClient
from tui.bus.share.messages import (
    Alive,
    Answer,
    AnyMessage,
    Asking,
    Describe,
    DriveRequested,
    Facts,
    Failed,
    Notified,
    PollWish,
    RequestDenied,
    RequestGranted,
    StopGiven,
    Withdraw,
)
from tui.bus.share.owner_watch import WATCH_INTERVAL
from tui.bus.share.requested import OWNER_ENDED, PendingRequests
from tui.bus.shared_state import SharedState

from .conftest import WIDE

VALUE = bytes([3, 2, 0, 7])


class Client:
    """Requests of a client; `sent` goes to the owner, `again` back to its own queue."""

    def __init__(self) -> None:
        self.sent: list[AnyMessage] = []
        self.again: list[Job] = []
        self.why = ""
        self.devices = {1: SimpleNamespace(heard=None)}
        dispatcher = SimpleNamespace(forbidden=lambda _: self.why, put_back=self.again.append)
        inside = SimpleNamespace(dispatcher=dispatcher, devices=self.devices)
        self.pending = PendingRequests(cast(Any, inside), self.sent.append)

    def send(self, *jobs: Job) -> None:
        for job in jobs:
            self.pending.send(job)
        self.sent.clear()


def read(priority: Priority = Priority.POLL) -> Job:
    return Job(Read(1, 100, 1), priority, WIDE)


def write(priority: Priority = Priority.OPERATOR_WRITE) -> Job:
    return Job(WriteOne(1, 8501, 7), priority, WIDE)


async def test_request_is_handed_to_the_owner_with_all_that_it_needs() -> None:
    client = Client()
    job = Job(
        Read(1, 100, 2), Priority.POLL, WIDE, replaceable=True, max_age=1.5, stamp=3,
        requested=9.0, within=0.5,
    )  # fmt: skip
    client.pending.send(job)
    described, requested = client.sent
    assert described == Describe(1, WIDE)
    assert isinstance(requested, Asking)
    assert (requested.number, requested.kind, requested.priority) == (1, "Read", Priority.POLL)
    assert requested.fields == {"device": 1, "address": 100, "count": 2}
    assert (requested.replaceable, requested.max_age, requested.stamp) == (True, 1.5, 3)
    assert (requested.requested, requested.within, requested.limits) == (9.0, 0.5, None)
    client.pending.send(read())
    assert [type(message) for message in client.sent[2:]] == [Asking], "described once"
    client.pending.send(Job(WriteOne(0, 1, 0), Priority.STOP, WIDE))
    (broadcast,) = client.sent[3:]
    assert isinstance(broadcast, Asking)
    assert (broadcast.number, broadcast.limits) == (3, WIDE)


async def test_request_that_is_forbidden_or_withdrawn_does_not_reach_the_owner() -> None:
    client = Client()
    withdrawn, forbidden = read(), write()
    withdrawn.answer.cancel()
    client.pending.send(withdrawn)
    client.why = "a stop came after it"
    client.pending.send(forbidden)
    assert client.sent == []
    with pytest.raises(RequestRefused, match="a stop came after it"):
        forbidden.answer.result(0)


async def test_request_that_is_withdrawn_later_is_withdrawn_from_the_owner_once() -> None:
    client, first, second = Client(), read(), read()
    client.send(first, second)
    second.answer.cancel()
    await asyncio.sleep(0.01)
    assert client.sent == [Withdraw(2)]
    client.pending.answered(Answer(2, VALUE, 5.0))
    client.pending.answered(Answer(1, VALUE, 5.0))
    await asyncio.sleep(0.01)
    assert client.sent == [Withdraw(2)]


async def test_answer_is_given_to_its_request_with_its_time() -> None:
    client, first, second = Client(), read(), read()
    client.send(first, second)
    client.pending.answered(Answer(2, VALUE, 5.0))
    assert not first.answer.done()
    found = second.answer.result(0)
    assert (found.words, found.time) == ((7,), 5.0)
    assert client.devices[1].heard == 5.0
    client.pending.answered(Failed(1, error_form(WrongReply(1, 3, 100, "why"))))
    assert isinstance(first.answer.exception(0), WrongReply)
    client.pending.answered(Answer(9, VALUE, 6.0))
    assert client.devices[1].heard == 5.0


@pytest.mark.parametrize(("text", "sent"), [("closed", False), (f"closed{OUTCOME_UNKNOWN}", True)])
async def test_end_of_the_owner_is_not_that_of_this_program(text: str, sent: bool) -> None:
    client, poll, command, stop = Client(), read(), write(), write(Priority.STOP)
    client.send(poll, command, stop)
    for number in (1, 2, 3):
        client.pending.answered(Failed(number, error_form(LineClosed(text))))
    assert client.again == [poll, stop], "read and stop are sent again"
    error = command.answer.exception(0)
    assert isinstance(error, LineLost)
    during = f"{OWNER_ENDED} during the request.{OUTCOME_UNKNOWN}"
    assert str(error) == (during if sent else f"{OWNER_ENDED}; this was not sent.")


@pytest.mark.parametrize("closing", [True, False])
async def test_requests_are_given_up_with_their_owner(closing: bool) -> None:
    client, poll, gone = Client(), read(), read()
    command, stop = write(), write(Priority.STOP)
    client.send(poll, gone, command, stop)
    gone.answer.cancel()
    client.pending.give_up_all(closing=closing)
    assert client.again == ([poll] if closing else [poll, stop])
    for job in (command, stop) if closing else (command,):
        error = job.answer.exception(0)
        assert isinstance(error, LineClosed if closing else LineLost)
        assert str(error).endswith(OUTCOME_UNKNOWN)
    client.again.clear()
    client.pending.give_up_all(closing=closing)
    assert client.again == [], "once"


async def test_frozen_owner_keeps_stop_words_only() -> None:
    client, poll, command = Client(), read(), write()
    look, stop = read(Priority.STOP), write(Priority.STOP)
    stop.program, stop.requested = "me", 4.0
    client.send(poll, command, look, stop)
    for _ in range(2):
        client.pending.fail_all("It is frozen.")
    assert client.sent == [Withdraw(1), Withdraw(2), Withdraw(3)]
    assert str(poll.answer.exception(0)) == "It is frozen."
    assert str(command.answer.exception(0)) == f"It is frozen.{OUTCOME_UNKNOWN}"
    error = look.answer.exception(0)
    assert isinstance(error, NoAnswer), "so that its stop is sent without a read"
    assert (error.device, error.function, error.address) == (1, 3, 100)
    assert isinstance(stop.answer.exception(0), LineLost)
    client.pending.give_up_all(closing=False)
    (again,) = client.again
    assert again is not stop
    assert (again.request, again.priority, again.limits) == (stop.request, Priority.STOP, WIDE)
    assert (again.program, again.requested) == ("me", 4.0)


# -- messages of the owner -------------------------------------------------------------------------

ME, OTHER = Program("me", "panel", 1), Program("other", "run", 2)


class Hearing:
    """A client that hears messages; `events` are what its program hears of them."""

    def __init__(self) -> None:
        self.facts = SharedState()
        self.facts.me = ME
        self.events: list[LineEvent] = []
        self.facts.events.subscribe(self.events.append)
        self.voids = 0
        self.client = cast(Any, object.__new__(ShareClient))
        self.client._owner = SimpleNamespace(program=OTHER)
        self.client._gone, self.client.again = False, False
        self.client._inside = SimpleNamespace(
            facts=self.facts, dispatcher=SimpleNamespace(void=self._void)
        )

    def _void(self) -> None:
        self.voids += 1

    def hear(self, message: AnyMessage) -> list[LineEvent]:
        self.events.clear()
        self.client._hear(message)
        return self.events


def test_stop_of_another_program_cancels_commands_and_is_reported() -> None:
    here = Hearing()
    found = here.hear(StopGiven((1, 2), (4, 1), "the stop key", OTHER, 50.0))
    assert found == [DevicesStopped((1, 2), "the stop key", OTHER)]
    assert here.voids == 1
    stops = here.facts.stops
    assert stops.of("other", (1, 2)) == (4, 1)
    assert stops.by[1] == f"the stop key, {OTHER.text}"
    assert dict(stops.times) == {1: 50.0, 2: 50.0}
    here.client._inside.facts.me = OTHER
    assert here.hear(StopGiven((1,), (5,), "the stop key", OTHER, 50.0)) == [], "its own"
    assert (here.voids, stops.of("other", (1,))) == (1, (4,))


@pytest.mark.parametrize(("again", "gone"), [(True, False), (True, True), (False, False)])
def test_stop_given_while_no_owner_was_heard_is_reported(again: bool, gone: bool) -> None:
    here = Hearing()
    here.client.again, here.client._gone = again, gone
    facts = Facts((ME, OTHER), {}, {1: {"other": 2}}, {})
    stopped = [event for event in here.hear(facts) if isinstance(event, DevicesStopped)]
    assert here.facts.stops.of("other", (1,)) == (2,)
    assert stopped == ([DevicesStopped((1,), STOP_UNHEARD[gone], OTHER)] if again else [])
    assert here.voids == (1 if again else 0)
    again_heard = [event for event in here.hear(facts) if isinstance(event, DevicesStopped)]
    assert again_heard == [], "no news"


def test_messages_about_control_and_notices_are_events() -> None:
    here = Hearing()
    assert here.hear(Notified(3, "A notice.")) == [NoticeReceived(3, "A notice.")]
    written = DeviceWritten(3, 9001, (30,), OTHER, 5.0)
    assert here.hear(written) == [written]
    assert here.hear(Alive()) == []
    denied = [
        event for event in here.hear(RequestDenied(1, OTHER)) if isinstance(event, ControlDenied)
    ]
    assert denied[0].device == 1
    assert here.facts.commanders[1] == "other"
    assert ControlRequested(2, OTHER) in here.hear(DriveRequested(2, OTHER))
    replies: list[tuple[object, ...]] = []
    cast(Any, here.facts).hear_reply = lambda device, why, *, yes: replies.append(
        (device, why, yes)
    )
    here.hear(RequestGranted(2, "me", False, "It is busy."))
    assert replies == [(2, "It is busy.", False)]
    parts: list[tuple[str, object]] = []
    for name, method in (("_requested", "answered"), ("_polls", "hear"), ("_news", "hear")):
        hears = {method: lambda message, name=name: parts.append((name, message))}
        setattr(here.client, name, SimpleNamespace(**hears))
    answer, failed = Answer(1, VALUE, 5.0), Failed(1, error_form(LineClosed("closed")))
    here.hear(answer)
    here.hear(failed)
    assert parts == [("_requested", answer), ("_requested", failed)]


def test_owner_that_is_heard_again_is_connected_again() -> None:
    here = Hearing()
    heard: list[object] = []
    here.client.watching = SimpleNamespace(hear=heard.append)
    here.client._news = SimpleNamespace(tell_state=lambda: heard.append("state"))
    here.client._reported = ""
    alive = Alive()
    here.client._hear_life(alive)
    here.client._reported = "It is frozen."
    here.client._hear_life(alive)
    here.client._hear_life(alive)
    assert heard == [alive, alive, "state", alive]
    assert here.client._reported == ""


class Watch:
    """A client's watch over its owner, for some of its turns."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, taken_in: bool = True) -> None:
        self.done: list[object] = []
        self.turns = 3
        self.client = client = cast(Any, object.__new__(ShareClient))
        self.pace, self.trace = SimpleNamespace(own={1: 1.0}), SimpleNamespace(looked_at=False)
        notes = SimpleNamespace(all=[f"note {number}" for number in range(100)])
        client._inside = SimpleNamespace(
            facts=SimpleNamespace(notes=notes), pace=self.pace,
            around=SimpleNamespace(trace=self.trace),
        )  # fmt: skip
        client._heartbeat = SimpleNamespace(turn=lambda: self.done.append("heartbeat"))
        client._tell = self.done.append
        client._wish = None
        client.watching = SimpleNamespace(frozen=False, look=self._look)
        client._wait_for_owner = lambda: self.done.append("waits")
        monkeypatch.setattr(ShareClient, "taken_in", taken_in, raising=False)
        monkeypatch.setattr(client_module, "asyncio", SimpleNamespace(sleep=self._sleep))

    def _look(self, *, attached: bool) -> None:
        self.done.append(attached)

    async def _sleep(self, seconds: float) -> None:
        assert seconds == WATCH_INTERVAL
        self.turns -= 1
        if self.turns < 0:
            raise asyncio.CancelledError

    async def run(self) -> list[object]:
        with pytest.raises(asyncio.CancelledError):
            await self.client._watch()
        return self.done


async def test_watch_sends_a_heartbeat_some_notes_and_each_new_wish(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Watch(monkeypatch)
    here.turns = 2
    count = NOTES_A_LOOK
    notes = [f"note {number}" for number in range(100)]
    wish = PollWish({1: 1.0}, False)
    assert await here.run() == [
        "heartbeat", *notes[:count], wish, True, "heartbeat", *notes[count : 2 * count], True,
    ]  # fmt: skip


async def test_watch_of_a_client_that_is_not_attached_sends_no_notes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Watch(monkeypatch, taken_in=False)
    here.turns, here.client._heartbeat, here.client.watching.frozen = 1, None, True
    assert await here.run() == [PollWish({1: 1.0}, False), False, "waits"]
