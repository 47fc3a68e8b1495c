"""One attached program as its owner sees it: its requests, its answers, and the news for it."""

from __future__ import annotations

import asyncio
import logging
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import msgspec
import pytest

from tests.limits import SILENT_CLIENT
from tui.bus.errors import LineLost, NoAnswer, RequestRefused
from tui.bus.limits import CAUTIOUS
from tui.bus.line_events import EventHub, WriteAbandoned
from tui.bus.model import LineState, LineStatus, Priority, Reply
from tui.bus.program import Program
from tui.bus.requests import Read, Request, WriteOne
from tui.bus.schedule.queue import Job
from tui.bus.schedule.worker import Worker
from tui.bus.share.attached import MOST_REQUESTED, MOST_UNREAD, Client, was_suspended
from tui.bus.share.beside import plain_stop
from tui.bus.share.carried import error_form, request_form
from tui.bus.share.messages import (
    Alive,
    Answer,
    Asking,
    Claim,
    Failed,
    News,
    NoMessage,
    StopGiven,
    unpacked,
)
from tui.bus.share.place import Peer
from tui.bus.tally import Tally
from tui.bus.trace import Trace

from .conftest import WIDE

PROGRAM = Program("a", "run", 7, "anna", "pts/3")
READ, WRITE = Read(4, 100, 2), WriteOne(4, 8501, 7)
POLL, COMMAND, STOP = Priority.POLL, Priority.OPERATOR_WRITE, Priority.STOP
NOW = 100.0
COMMAND_TOO_LATE, STOP_DUE = 2.0, 10.0
"""Seconds after which a command is not sent, and a stop is no longer due."""


class Bench:
    """A client whose messages are read from its socket."""

    def __init__(self) -> None:
        self.writer = Mock()
        self.transport = self.writer.transport
        self.transport.is_closing.return_value = False
        self.transport.get_write_buffer_size.return_value = 0
        self.events = EventHub()
        self.client = Client(PROGRAM, self.writer, self.events)
        self.jobs: list[Job] = []
        self.inside: Any = SimpleNamespace(clock=lambda: NOW, submit=self.jobs.append)

    def sent(self) -> list[Any]:
        found = [unpacked(args[0][4:]) for args, _ in self.writer.write.call_args_list]
        self.writer.write.reset_mock()
        return found

    def ask(self, request: Request, priority: Priority = POLL, **more: Any) -> None:
        kind, fields = request_form(request)
        number = len(self.client.requested) + 1
        asking = Asking(number, kind, fields, priority, False, 0.0, 0, NOW)
        self.client.ask(self.inside, msgspec.structs.replace(asking, **more))


def test_request_of_a_program_reaches_the_line_with_all_that_it_wants() -> None:
    bench = Bench()
    bench.client.limits[4] = WIDE
    bench.ask(READ, replaceable=True, max_age=0.5, stamp=9, requested=90.0, within=0.25)
    bench.ask(WriteOne(5, 1, 2), COMMAND)
    bench.ask(WriteOne(0, 1, 2), STOP, limits=WIDE, requested=1.0)
    seen = [
        (job.request, job.priority, job.limits, job.replaceable, job.program, job.stamp,
         job.max_age, job.requested, job.within)
        for job in bench.jobs
    ]  # fmt: skip
    assert seen == [
        (READ, POLL, WIDE, True, "a", 9, 0.5, 90.0, 0.25),
        (WriteOne(5, 1, 2), COMMAND, CAUTIOUS, False, "a", 0, 0.0, NOW, None),
        (WriteOne(0, 1, 2), STOP, WIDE, False, "a", 0, 0.0, 1.0, None),
    ]
    assert list(bench.client.requested.values()) == bench.jobs


def test_answer_and_error_are_sent_once_and_a_withdrawn_request_gets_none() -> None:
    bench, error = Bench(), NoAnswer(4, 3, 100)
    for _ in range(3):
        bench.ask(READ)
    first, second, third = bench.jobs
    first.answer.set_result(Reply((1, 2), 101.0, b"\x03\x04\x00\x01\x00\x02"))
    second.answer.set_exception(error)
    bench.client.withdraw(3)
    bench.client.withdraw(9)
    assert third.answer.cancelled()
    assert bench.sent() == [
        Answer(1, b"\x03\x04\x00\x01\x00\x02", 101.0), Failed(2, error_form(error))
    ]  # fmt: skip
    assert bench.client.requested == {}


@pytest.mark.parametrize("late", [COMMAND_TOO_LATE, COMMAND_TOO_LATE + 0.5])
@pytest.mark.parametrize(("request_", "priority"), [(WRITE, COMMAND), (WRITE, STOP), (READ, POLL)])
def test_command_that_comes_too_late_is_refused(
    late: float, request_: Request, priority: Priority
) -> None:
    bench = Bench()
    bench.ask(request_, priority, requested=NOW - late)
    refused = late > COMMAND_TOO_LATE and priority is COMMAND
    assert len(bench.jobs) == (not refused)
    why = was_suspended(late)
    assert bench.sent() == ([Failed(1, error_form(RequestRefused(why)))] if refused else [])
    assert was_suspended(7.6) == ("Not sent: the program that owns the line was suspended for 8 s.")


def test_request_beyond_the_most_or_of_no_form_is_no_message() -> None:
    bench = Bench()
    for _ in range(MOST_REQUESTED):
        bench.ask(READ)
    with pytest.raises(NoMessage, match="too many requests at once"):
        bench.ask(READ)
    with pytest.raises(NoMessage, match="request 'Odd'"):
        Bench().ask(READ, kind="Odd")


def test_stop_is_due_until_a_stop_word_is_answered() -> None:
    bench = Bench()
    client = bench.client
    client.stops_due = {4: NOW, 5: NOW - STOP_DUE, 6: NOW - STOP_DUE + 0.1}
    assert client.due_stops(NOW) == (4, 6)
    for request, priority in ((READ, STOP), (WRITE, COMMAND), (WRITE, STOP)):
        bench.ask(request, priority, limits=WIDE)
        bench.jobs[-1].answer.set_result(Reply((), NOW, b"\x06"))
        assert (4 in client.stops_due) == (priority is not STOP or request is READ)
    bench.ask(WriteOne(6, 1, 1), STOP, limits=WIDE)
    bench.jobs[-1].answer.set_exception(NoAnswer(6, 6, 1))
    assert client.due_stops(NOW) == (6,)


def test_heartbeat_counts_by_time_and_by_checks() -> None:
    bench = Bench()
    client = bench.client
    client.hears(Claim(4, True), NOW)
    assert bench.sent() == []
    checks = [client.is_silent(NOW + SILENT_CLIENT + 0.1, 2) for _ in range(4)]
    assert checks == [False, False, True, True]
    assert not client.is_silent(NOW + SILENT_CLIENT, 2)
    client.hears(StopGiven((4,), (1,), "s", PROGRAM), NOW + 5.0)
    assert bench.sent() == [Alive()]
    assert (client.heard, client.looks) == (NOW + 5.0, 0)


@pytest.mark.parametrize(
    ("closing", "unread", "sent", "aborted"),
    [(False, MOST_UNREAD, 1, False), (False, MOST_UNREAD + 1, 0, True), (True, 0, 0, False),
     (True, MOST_UNREAD + 1, 0, False)],
)  # fmt: skip
def test_program_that_no_longer_reads_is_disconnected(
    closing: bool, unread: int, sent: int, aborted: bool, caplog: pytest.LogCaptureFixture
) -> None:
    bench = Bench()
    bench.transport.is_closing.return_value = closing
    bench.transport.get_write_buffer_size.return_value = unread
    bench.client.say(Alive())
    assert len(bench.sent()) == sent
    assert bench.transport.abort.called is aborted
    logged = "run on pts/3 (pid 7) no longer reads and is disconnected"
    assert caplog.messages == ([logged] if aborted else [])


@pytest.mark.parametrize("drop", [True, False])
def test_program_that_leaves_leaves_its_stops_and_its_writes_on_the_wire(drop: bool) -> None:
    bench, heard = Bench(), list[Any]()
    bench.events.subscribe(heard.append)
    for request, priority in ((READ, POLL), (WRITE, COMMAND), (WRITE, COMMAND), (WRITE, STOP),
                              (READ, STOP)):  # fmt: skip
        bench.ask(request, priority, limits=WIDE)
    jobs = bench.jobs
    jobs[0].begun = jobs[2].begun = True
    if drop:
        bench.client.drop()
    else:
        assert bench.client.forget() is bench.client.stops_left
    assert bench.transport.abort.called is drop
    assert [job.answer.cancelled() for job in jobs] == [True, True, True, False, False]
    assert bench.client.stops_left == jobs[3:]
    assert heard == [WriteAbandoned(PROGRAM, job.request, job.answer) for job in jobs[2:4]]
    assert bench.client.requested == {}
    assert bench.client.forget() == jobs[3:]


def test_news_has_what_changed_since_the_last_one() -> None:
    bench, tally, trace = Bench(), Tally(clock=lambda: NOW), Trace(1000)
    states = {4: "a", 5: "b"}
    error: list[Any] = [LineLost("gone"), None, None, None]
    line = LineState(LineStatus.LOST, "gone", 1.0)
    around = SimpleNamespace(trace=trace, tally=tally)
    devices = SimpleNamespace(known=(4, 5), state=lambda device: states[device])
    inside: Any = SimpleNamespace(
        devices=devices, around=around, error=lambda: error.pop(0), state=lambda: line,
        pace=SimpleNamespace(stretch=1.5),
    )  # fmt: skip
    tally.count_sent(4, 8)
    tally.count_sent(5, 8)
    for number in range(3):
        trace.add(float(number), "out", b"x")
    client, shares = bench.client, {4: 0.1}
    found = [client.news(inside, shares)]
    states[5] = "c"
    tally.count_sent(5, 8)
    client.trace = True
    trace.add(3.0, "in", b"y")
    found.append(client.news(inside, shares))
    found.append(client.news(inside, {}))
    for number in range(205):
        trace.add(float(number), "out", b"z")
    found.append(client.news(inside, {}))
    seen: list[Any] = [
        (news.devices, sorted(news.counted), [frame.time for frame in news.frames], news.shares)
        for news in found
    ]
    assert seen == [
        ({4: "a", 5: "b"}, [4, 5], [], shares),
        ({5: "c"}, [5], [3.0], shares),
        ({}, [], [], {}),
        ({}, [], [float(number) for number in range(5, 205)], {}),
    ]
    failure = error_form(LineLost("gone"))
    assert [news.failure for news in found] == [failure, None, None, None]
    assert {(news.state, news.stretch) for news in found} == {(line, 1.5)}
    assert isinstance(found[0], News)
    assert [(news.counters.requests, news.counters.devices) for news in found[:2]] == [
        (2, {}), (3, {})
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("peer", "name", "pid", "by"),
    [(None, "stop", 0, "drivepanel stop"), (Peer(9, 0), "stop", 9, "drivepanel stop"),
     (Peer(0, 0), "stop", 0, "drivepanel stop"), (Peer(7, 0), "run", 7, "a direct stop")],
)  # fmt: skip
async def test_plain_stop_has_the_name_of_its_program(
    peer: Peer | None, name: str, pid: int, by: str
) -> None:
    reader = asyncio.StreamReader()
    reader.feed_data(b" 3 4\n")
    programs = (Program("z", "panel", 0), PROGRAM)
    stop = await plain_stop(reader, (), peer, programs)
    assert (stop.devices, stop.counts, stop.by) == ((3, 4), (1, 1), by)
    assert (stop.program.name, stop.program.pid) == (name, pid)
    assert len(stop.program.id) == 32, "each stop counts as one of a program of its own"


async def test_worker_ends_once_however_it_ends(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.ERROR)
    loop = asyncio.get_running_loop()

    async def work() -> str:
        return "done"

    abandoned, broken, early, whole = (Worker(work, "w", loop) for _ in range(4))
    abandoned.abandon()
    abandoned.abandon()
    broken.break_off(error := ValueError("on purpose"))
    early.cancel()
    assert early.start() is None
    assert not whole.wait(0.0)
    task = whole.start()
    assert task is not None
    assert (task.get_name(), await task) == ("w", "done")
    await asyncio.sleep(0)
    assert [each.done() and each.wait(0.0) for each in (abandoned, broken, early, whole)] == [
        True
    ] * 4
    assert [each.error for each in (abandoned, broken, early, whole)] == [None, error, None, None]
    whole.cancel()
    assert caplog.messages == []
