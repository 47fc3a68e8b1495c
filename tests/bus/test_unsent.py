"""Requests that end without having been sent, and what is kept of them; pure functions."""

from __future__ import annotations

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineClosed, LineLost, NoAnswer
from tui.bus.line import Timing
from tui.bus.requests import Read, ReadInput, Request, WriteMany, WriteOne
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import Job
from tui.bus.schedule.shared_values import SharedValues
from tui.bus.schedule.unsent import ends_unsent, fail_lost, is_stop_word

from .conftest import WIDE

READ, WRITE = Read(1, 100, 2), WriteOne(1, 8501, 7)
EXPECTED = READ.expectation()
TEN_MINUTES = 600.0


def job_of(request: Request, priority: Priority, **more: float) -> Job:
    return Job(request, priority, WIDE, program="panel", order=5, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("priority", list(Priority))
def test_stop_word_is_a_write_of_a_stop_or_of_its_repeat(priority: Priority) -> None:
    stops = priority in (Priority.STOP, Priority.FEED)
    assert is_stop_word(job_of(WRITE, priority)) is stops
    assert not is_stop_word(job_of(READ, priority))


@pytest.mark.parametrize(
    ("request_", "priority", "age", "keeps", "kept"),
    [
        (WRITE, Priority.STOP, 0.0, True, True),
        (WRITE, Priority.STOP, TEN_MINUTES, True, True),
        (WRITE, Priority.STOP, TEN_MINUTES + 1, True, False),
        (WRITE, Priority.STOP, 0.0, False, False),
        (READ, Priority.STOP, 0.0, True, False),
        (WRITE, Priority.OPERATOR_WRITE, 0.0, True, False),
        (READ, Priority.POLL, 0.0, True, False),
    ],
)
def test_stop_word_of_the_last_ten_minutes_outlives_a_lost_line(
    request_: Request, priority: Priority, age: float, keeps: bool, kept: bool
) -> None:
    job = job_of(request_, priority, requested=1000.0)
    left = fail_lost(job, "The cable is out.", LineLost, 1000.0 + age, keeps=keeps)
    assert job.answer.exception(0) is not None
    assert (left is not None) is kept
    if left is not None:
        assert not left.answer.done()
        assert (left.request, left.priority, left.limits) == (request_, priority, WIDE)
        assert (left.order, left.program, left.requested) == (5, "panel", 1000.0)


@pytest.mark.parametrize("keeps", [True, False])
def test_lost_line_is_no_answer_to_the_read_of_a_stop(keeps: bool) -> None:
    """The stop then sends its word without it."""
    read, poll = job_of(READ, Priority.STOP), job_of(READ, Priority.POLL)
    for job in (read, poll):
        fail_lost(job, "The cable is out.", LineLost, 0.0, keeps=keeps)
    assert isinstance(read.answer.exception(0), NoAnswer if keeps else LineLost)
    assert type(poll.answer.exception(0)) is LineLost


@pytest.mark.parametrize("begun", [True, False])
def test_outcome_is_unknown_for_a_write_that_was_begun(begun: bool) -> None:
    job = job_of(WRITE, Priority.OPERATOR_WRITE)
    job.begun = begun
    if begun:
        job.answer.set_running_or_notify_cancel()
    fail_lost(job, "The line is closed.", LineClosed, 0.0, keeps=False)
    text = str(job.answer.exception(0))
    assert text.startswith("The line is closed.")
    assert (text != "The line is closed.") is begun


def resting(answered: bool = True) -> Devices:
    """Device 1 has been silent until 1000 s, and is not polled for a while."""
    devices = Devices(Timing(), mistakable=True)
    if answered:
        devices.answered(1, EXPECTED, 0.01, 900.0, (b"", b""), refused=False)
    for _ in range(6):
        devices.silent(1, EXPECTED, 1000.0, 1000.0)
    return devices


def test_poll_of_a_resting_device_fails_with_the_seconds_until_it_is_polled_again() -> None:
    devices, values = resting(), SharedValues()
    job = job_of(READ, Priority.POLL)
    assert ends_unsent(job, devices, values, 1000.5)
    error = job.answer.exception(0)
    assert isinstance(error, NoAnswer)
    assert error.retry_in is not None
    assert error.retry_in > 0
    due = 1000.5 + error.retry_in
    again = job_of(READ, Priority.POLL)
    assert ends_unsent(again, devices, values, due - 0.01)
    assert not ends_unsent(job_of(READ, Priority.POLL), devices, values, due)


@pytest.mark.parametrize("priority", [p for p in Priority if p < Priority.POLL])
def test_person_and_stop_are_sent_to_a_resting_device(priority: Priority) -> None:
    job = job_of(READ, priority)
    assert not ends_unsent(job, resting(), SharedValues(), 1000.5)
    assert not job.answer.done()


@pytest.mark.parametrize(
    ("max_age", "age", "begun", "answered"),
    [
        (2.0, 1.0, False, True),
        (2.0, 2.0, False, True),
        (2.0, 2.5, False, False),
        (0.0, 0.0, False, False),
        (2.0, 1.0, True, False),
    ],
)
def test_read_is_answered_by_words_that_are_recent_enough(
    max_age: float, age: float, begun: bool, answered: bool
) -> None:
    values = SharedValues()
    values.note(Read(1, 98, 10), range(10), 500.0)
    job = job_of(READ, Priority.POLL, max_age=max_age)
    job.begun = begun
    devices = Devices(Timing(), mistakable=True)
    assert ends_unsent(job, devices, values, 500.0 + age) is answered
    if answered:
        reply = job.answer.result(0)
        assert (reply.words, reply.time) == ((2, 3), 500.0)
    assert job.begun is (begun or answered)


def found(values: SharedValues, request: Request) -> tuple[int, ...] | None:
    reply = values.find(request, 0.0)
    return None if reply is None else reply.words


def test_shared_words_are_those_of_the_device_function_and_register() -> None:
    values = SharedValues()
    values.note(Read(1, 100, 3), (10, 11, 12), 5.0)
    assert found(values, Read(1, 101, 2)) == (11, 12)
    assert found(values, Read(1, 100, 3)) == (10, 11, 12)
    for other in (
        Read(2, 100, 1), ReadInput(1, 100, 1), Read(1, 99, 2), Read(1, 102, 2), WRITE
    ):  # fmt: skip
        assert found(values, other) is None
    reply = values.find(Read(1, 101, 2), 5.0)
    assert reply is not None
    assert reply.pdu == bytes([3, 4, 0, 11, 0, 12])


def test_words_of_two_replies_are_not_combined() -> None:
    values = SharedValues()
    values.note(Read(1, 100, 1), (10,), 5.0)
    values.note(Read(1, 101, 1), (11,), 6.0)
    assert found(values, Read(1, 100, 2)) is None
    assert found(values, Read(1, 101, 1)) == (11,)


@pytest.mark.parametrize(
    ("write", "left"),
    [(WRITE, {2}), (WriteMany(2, 7, (1,)), {1}), (WriteOne(0, 8501, 7), set())],
)
def test_change_of_a_device_discards_its_words(write: Request, left: set[int]) -> None:
    values = SharedValues()
    for device in (1, 2):
        values.note(Read(device, 100, 1), (10,), 5.0)
    values.note(write, (), 6.0)
    assert {device for device in (1, 2) if found(values, Read(device, 100, 1))} == left
