"""A request that waits, and its place among the others: each field to the exact value."""

from __future__ import annotations

from typing import Any

import pytest

from tui.bus.errors import LineFailed, LineLost, RequestRefused
from tui.bus.model import Priority
from tui.bus.requests import BROADCAST, Identify, Read, Request, WriteOne
from tui.bus.schedule import queue as queues
from tui.bus.schedule.queue import (
    LEAST_COUNTED,
    MOST_OWED,
    OVERDUE,
    Job,
    JobQueue,
    LineShares,
    SentStops,
)
from tui.safety import JUST_SENT, MOST_UNACKNOWLEDGED

from .conftest import WIDE

READ, WRITE = Read(1, 100, 2), WriteOne(1, 100, 7)
LONG = bytes([3, 6, 0, 1, 0, 2, 0, 3])
POLL, STOP, BACKGROUND = Priority.POLL, Priority.STOP, Priority.BACKGROUND
OPERATOR = Priority.OPERATOR_READ


def job_of(
    priority: Priority = POLL, program: str = "a", request: Request = READ, **more: Any
) -> Job:
    return Job(request, priority, WIDE, program=program, **more)


# -- one request -----------------------------------------------------------------------------------


@pytest.mark.parametrize("form", [None, Read(1, 100, 3)])
def test_longer_reply_is_cut_to_the_own_request(form: Read | None) -> None:
    job = job_of()
    own = bytes([3, 4, 0, 1, 0, 2])
    if form is not None:
        job.take_form(form)
        assert (job.pdu, job.expectation) == (form.pdu(), form.expectation())
    reply = job.reply(LONG if form else own, 5.0)
    assert (reply.words, reply.time, reply.pdu) == ((1, 2), 5.0, own)
    job.take_form(None)
    assert (job.form, job.pdu, job.expectation) == (None, READ.pdu(), READ.expectation())
    other = job_of(request=Identify(1))
    other.form = form
    assert other.own_part(LONG) == LONG


def test_request_has_its_result_once() -> None:
    job = job_of(first_sent=4.0)
    assert job.tries == (READ.pdu(), 4.0)
    job.begun = True
    job.answer.set_running_or_notify_cancel()
    job.break_off(ValueError("odd"))
    error = job.answer.exception(0)
    assert (type(error), str(error)) == (LineFailed, "The line failed: ValueError('odd').")
    waits = job_of()
    waits.fail(LineLost("x"))
    assert waits.begun
    canceled = job_of()
    canceled.answer.cancel()
    canceled.fail(LineLost("x"))
    assert not canceled.begun
    done = job_of()
    reply = done.reply(bytes([3, 4, 0, 1, 0, 2]), 1.0)
    done.finish(reply)
    assert done.answer.result(0) is reply


@pytest.mark.parametrize(
    ("request_", "priority", "commands"),
    [(READ, POLL, False), (WRITE, STOP, False), (WRITE, Priority.OPERATOR_WRITE, True)],
)
def test_stop_discards_commands(request_: Request, priority: Priority, commands: bool) -> None:
    assert job_of(priority, request=request_).commands == commands
    assert job_of(request=WriteOne(BROADCAST, 1, 1)).expectation is None


def test_waiting_jobs_are_refused_kept_and_taken_out() -> None:
    queue, jobs = JobQueue(10), [job_of(), job_of(STOP, request=WRITE), job_of(STOP)]
    for job in jobs:
        queue.put(job)
    assert queue.stops
    queue.refuse(lambda job: "void" if job is jobs[1] else "")
    assert queue.waiting() == (jobs[0], jobs[2])
    assert type(jobs[1].answer.exception(0)) is RequestRefused
    assert not queue.stops, "a read is no stop word"
    kept = job_of(STOP, request=WRITE)
    queue.keep(kept)
    queue.keep(job_of(STOP, request=WRITE))
    assert queue.waiting() == (jobs[0], jobs[2], kept)
    queue.remove(kept)
    jobs[0].answer.cancel()
    assert queue.take(lambda _: 5.0, 4.0) == (None, 5.0)
    assert queue.waiting() == (jobs[2],)
    assert queue.take(lambda _: 4.0, 4.0) == (jobs[2], None)
    assert queue.take(lambda _: 4.0, 4.0) == (None, None)


# -- stops that are repeated -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("acknowledged", "times", "after", "yields"),
    [
        (True, 1, 0.0, True), (True, 1, JUST_SENT, False), (False, 1, 0.0, False),
        (False, MOST_UNACKNOWLEDGED, 0.0, True), (False, MOST_UNACKNOWLEDGED + 1, 0.0, True),
    ],
)  # fmt: skip
def test_stop_that_was_just_sent_takes_turns(
    acknowledged: bool, times: int, after: float, yields: bool
) -> None:
    stops, stop = SentStops(), job_of(STOP, request=WRITE)
    assert not stops.yields(stop, 8.0)
    for _ in range(times):
        stops.count(stop, 8.0, acknowledged=acknowledged)
    assert stops.yields(stop, 8.0 + after) == yields
    assert not stops.yields(job_of(request=WRITE), 8.0)
    assert not stops.yields(job_of(STOP, request=WriteOne(1, 100, 8)), 8.0)
    stops.count(job_of(), 8.0, acknowledged=True)
    assert not stops.yields(stop, 8.0), "another request was between"


@pytest.mark.parametrize(("device", "needed"), [(1, True), (2, False), (BROADCAST, True)])
def test_stop_is_needed_again_after_a_command(device: int, needed: bool) -> None:
    stops, stop = SentStops(), job_of(STOP, request=WRITE)
    stops.count(stop, 8.0, acknowledged=True)
    stops.count(job_of(request=WriteOne(device, 1, 1)), 8.0, acknowledged=True)
    stops.count(job_of(STOP), 8.0, acknowledged=True)
    assert stops.yields(stop, 8.0) is not needed


def test_old_stops_are_forgotten() -> None:
    stops = SentStops()
    stops.count(job_of(STOP, request=WRITE), 8.0, acknowledged=True)
    stops.count(job_of(STOP, request=WriteOne(2, 1, 1)), 8.0 + JUST_SENT, acknowledged=True)
    assert [device for device, _ in stops._sent] == [2]


# -- shares of the line ----------------------------------------------------------------------------


def test_place_follows_from_the_kind_and_what_it_is_owed() -> None:
    shares = LineShares()
    shares._owed[POLL], shares._had[POLL, "a"] = OVERDUE, 3.0
    assert shares.rank(job_of(STOP, order=5)) == (0.0, 0.0, 0.0, 0.0, 5)
    assert shares.rank(job_of(order=5)) == (2.0, POLL, 3.0, POLL, 5)
    shares._owed[POLL] = OVERDUE + 0.25
    assert shares.rank(job_of(order=5)) == (1.0, -OVERDUE - 0.25, 3.0, POLL, 5)
    assert shares.rank(job_of(program="b"))[2] == 0.0
    shares._had[BACKGROUND, "a"] = 2.0
    patient = job_of(Priority.PATIENT)
    assert shares.rank(patient) == (2.0, BACKGROUND, 2.0, Priority.PATIENT, 0)
    write = job_of(Priority.OPERATOR_WRITE)
    assert shares.rank(write) == (2.0, Priority.OPERATOR_WRITE, 0.0, Priority.OPERATOR_WRITE, 0)


@pytest.mark.parametrize(
    ("waiting", "had", "after"),
    [
        ([], {"a": 3.0}, {}),
        (["b"], {"a": 3.0, "b": 5.0}, {"a": 5.0, "b": 5.0}),
        (["b", "c"], {"b": 5.0, "c": 4.0}, {"a": 4.0, "b": 5.0, "c": 4.0}),
        (["b"], {"a": 7.0, "b": 5.0}, {"a": 7.0, "b": 5.0}),
        (["b"], {}, {"a": 0.0}),
        (["a", "b"], {"a": 1.0, "b": 5.0}, {"a": 1.0, "b": 5.0}),
    ],
)
def test_program_that_comes_makes_up_for_no_time(
    waiting: list[str], had: dict[str, float], after: dict[str, float]
) -> None:
    shares = LineShares()
    shares._had = {(POLL, program): seconds for program, seconds in had.items()}
    shares._had[OPERATOR, "x"] = 9.0
    others = [job_of(OPERATOR, "x"), *(job_of(program=program) for program in waiting)]
    shares.come(job_of(), others)
    expected = {(POLL, program): seconds for program, seconds in after.items()}
    assert shares._had == {**expected, (OPERATOR, "x"): 9.0}
    shares.come(job_of(STOP), others)
    assert shares._had == {**expected, (OPERATOR, "x"): 9.0}


def test_each_kind_that_waits_is_owed_its_share(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(queues, "MINIMUM_SHARES", {OPERATOR: 0.25, POLL: 0.5, BACKGROUND: 0.125})
    shares = LineShares()
    shares.count(job_of(STOP), 4.0, [job_of()])
    assert set(shares._owed.values()) == {0.0}
    shares.count(job_of(OPERATOR), 0.25, [job_of()])
    assert shares._owed == {OPERATOR: -0.1875, POLL: 0.125, BACKGROUND: 0.0}
    assert shares._had == {(OPERATOR, "a"): 0.25}
    shares.count(job_of(OPERATOR), 0.25, [job_of(Priority.PATIENT)])
    assert shares._owed == {OPERATOR: -0.25, POLL: 0.0, BACKGROUND: 0.03125}
    shares.count(job_of(Priority.OPERATOR_WRITE), 8.0, [job_of(), job_of(OPERATOR)])
    assert shares._owed == {OPERATOR: MOST_OWED, POLL: MOST_OWED, BACKGROUND: 0.0}
    assert shares._had == {(OPERATOR, "a"): 0.5}
    shares.count(job_of(), 0.0, [])
    assert shares._had[POLL, "a"] == LEAST_COUNTED
    assert shares._owed[POLL] == 0.5 * LEAST_COUNTED + MOST_OWED - LEAST_COUNTED
    assert shares._owed[OPERATOR] == 0.0
