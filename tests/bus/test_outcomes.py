"""Outcome of a request at the end of its exchange; without a line or a clock."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.line_events import on_event
from tui.bus.errors import (
    OUTCOME_UNKNOWN,
    ChecksumFault,
    DeviceException,
    ExchangeError,
    NoAnswer,
    WrongReply,
)
from tui.bus.limits import CAUTIOUS, STANDARD_EXCEPTIONS
from tui.bus.line_events import DeviceWritten
from tui.bus.master import ExchangeResult, Piece, ResultKind
from tui.bus.model import EndedExchange, Priority, Reply, Timing
from tui.bus.requests import Read, Request, WriteOne
from tui.bus.schedule import outcomes as outcomes_module
from tui.bus.schedule.outcomes import Next, Outcomes
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import Job
from tui.bus.shared_state import SharedState
from tui.bus.tally import Tally
from tui.wire.frames import frame

from .conftest import WIDE
from .peer import reply


@pytest.mark.parametrize(
    ("turnaround", "on_wire", "lay", "anew"),
    [
        (0.005, 1.2, 0.0, False),  # 61 words at 1200 baud
        (0.005, 4.7, 0.0, False),  # and at 300
        (1.2, 0.02, 0.0, True),
        (0.005, 0.02, 1.2, True),
    ],
)
def test_read_is_repeated_if_its_reply_waited_not_if_it_is_long(
    turnaround: float, on_wire: float, lay: float, anew: bool
) -> None:
    """A backup at 1200 baud requested its first long reply again and again, without an end."""
    timing, end = Timing(), turnaround + on_wire
    devices, tally = Devices(timing, mistakable=True), Tally()
    outcomes = Outcomes(devices, tally, timing, lambda: end + lay, SharedState(), gateway=False)
    job = Job(Read(1, 4201, 61), Priority.BACKGROUND, CAUTIOUS)
    devices.answered(1, job.request.expectation(), 0.005, 0.0)
    result = ExchangeResult(ResultKind.REPLY, sent=0.0, end=end, turnaround=turnaround)
    assert outcomes.waited_for_us(job, result) is anew


def test_not_polled_silent_and_refused_are_distinct_states() -> None:
    devices = Devices(Timing(), mistakable=True)
    expected = Read(1, 0, 1).expectation()
    assert devices.state(1).contact == "not_polled"
    devices.silent(1, expected, 0.0, 1.0)
    assert devices.state(1).contact == "silent"
    devices.answered(1, expected, 0.01, 2.0, refused=True)
    assert devices.state(1).contact == "refused"
    copied = Devices(Timing(), mistakable=True)
    copied.copy(1, devices.state(1))
    assert copied.state(1).contact == "refused"
    devices.answered(1, expected, 0.01, 3.0)
    assert devices.state(1).contact == "answers"


# -- each end of a request -------------------------------------------------------------------------

VALUE = bytes([3, 2, 0, 77])


class Ends:
    """Ends of requests at a time that the test sets; device 1 has answered before if `known`."""

    def __init__(self, *, known: bool = True, gateway: bool = False, retries: int = 2) -> None:
        self.now = 10.0
        self.timing = Timing(retries=retries)
        self.devices, self.tally = Devices(self.timing, mistakable=True), Tally()
        self.facts = SharedState()
        self.outcomes = Outcomes(
            self.devices, self.tally, self.timing, lambda: self.now, self.facts, gateway=gateway
        )
        if known:
            self.devices.answered(1, Read(1, 0, 1).expectation(), 0.005, 9.0)
        self.late: list[tuple[Any, ...]] = []
        self.devices.may_come = lambda *those: self.late.append(those)  # type: ignore[method-assign]

    def end(self, job: Job, kind: ResultKind, *, unsent: bool = False, **more: Any) -> Reply | Next:
        result = ExchangeResult(kind, sent=9.5, end=9.75, turnaround=0.125, **more)
        return self.outcomes.conclude(job, result, unsent=unsent)


def read(priority: Priority = Priority.OPERATOR_READ, **more: Any) -> Job:
    return Job(Read(1, 100, 1), priority, WIDE, **more)


def command() -> Job:
    return Job(WriteOne(1, 8501, 15), Priority.OPERATOR_WRITE, WIDE)


def error_of(job: Job) -> ExchangeError:
    found = job.answer.exception(0)
    assert isinstance(found, ExchangeError)
    return found


def test_reply_has_its_words_and_the_time_of_its_end_or_of_the_first_try() -> None:
    ends = Ends()
    found = ends.end(read(), ResultKind.REPLY, pdu=VALUE)
    assert found == Reply((77,), 9.75, VALUE)
    for first, time in ((9.0, 9.0), (9.9, 9.75)):
        again = ends.end(read(first_sent=first), ResultKind.REPLY, pdu=VALUE)
        assert isinstance(again, Reply)
        assert again.time == time


@pytest.mark.parametrize(
    ("max_age", "programs", "mistakable", "kept"),
    [(0.0, 1, False, False), (1.0, 1, False, True), (0.0, 2, False, True), (1.0, 2, True, False)],
)
def test_words_are_kept_while_another_reader_may_use_them(
    max_age: float, programs: int, mistakable: bool, kept: bool
) -> None:
    ends = Ends()
    ends.facts.programs = ("program",) * programs  # type: ignore[assignment]
    ends.end(read(max_age=max_age, mistakable=mistakable), ResultKind.REPLY, pdu=VALUE)
    assert (ends.outcomes.values.find(Read(1, 100, 1), 9.75) is not None) == kept


@pytest.mark.parametrize(
    ("code", "meanings", "text"),
    [
        (2, {}, STANDARD_EXCEPTIONS[2]),
        (2, {2: "its own meaning"}, "its own meaning"),
        (99, {}, ""),
    ],
)
def test_refusal_is_not_repeated_and_has_the_meaning_of_its_family(
    code: int, meanings: dict[int, str], text: str
) -> None:
    ends = Ends()
    job = Job(Read(1, 100, 1), Priority.POLL, replace(WIDE, exceptions=meanings))
    assert ends.end(job, ResultKind.EXCEPTION, exception=code) is Next.NOTHING
    error = error_of(job)
    assert isinstance(error, DeviceException)
    assert (error.device, error.function, error.address, error.code) == (1, 3, 100, code)
    assert text in str(error)
    assert ends.devices[1].refused


@pytest.mark.parametrize(
    ("kind", "error", "text"),
    [
        (ResultKind.NOTHING, NoAnswer, "Device 1 did not answer (function 3, register 100)."),
        (
            ResultKind.WRONG,
            WrongReply,
            "Device 1 sent an unexpected reply (function 3, register 100).",
        ),
        (ResultKind.DAMAGED, ChecksumFault, ""),
    ],
)
def test_request_that_failed_has_its_error(
    kind: ResultKind, error: type[ExchangeError], text: str
) -> None:
    ends = Ends(retries=0)
    job = read()
    assert ends.end(job, kind, received=b"what came") is Next.NOTHING
    found = error_of(job)
    assert type(found) is error
    assert (found.device, found.function, found.address) == (1, 3, 100)
    assert text in str(found)
    assert not str(found).endswith(OUTCOME_UNKNOWN)
    if isinstance(found, (WrongReply, ChecksumFault)):
        assert found.received == b"what came"


def test_write_without_a_reply_is_not_repeated_and_may_have_taken_effect() -> None:
    for kind in (ResultKind.NOTHING, ResultKind.WRONG, ResultKind.DAMAGED):
        ends, job = Ends(), command()
        assert ends.end(job, kind) is Next.NOTHING
        assert job.repeats == 0
        if kind is ResultKind.NOTHING:
            assert str(error_of(job)) == (
                f"Device 1 did not answer (function 6, register 8501).{OUTCOME_UNKNOWN}"
            )


def test_silence_of_a_gateway_has_its_detail() -> None:
    ends, job = Ends(retries=0, gateway=True), read()
    result = ExchangeResult(ResultKind.EXCEPTION, exception=11, sent=9.5, end=9.75)
    ends.outcomes.hear_gateway(job, result)
    assert result.kind is ResultKind.NOTHING
    assert ends.outcomes.conclude(job, result) is Next.NOTHING
    assert str(error_of(job)) == (
        "Device 1 did not answer (function 3, register 100): the gateway heard nothing of it."
    )


@pytest.mark.parametrize(
    ("gateway", "code", "meanings", "silent"),
    [
        (True, 10, STANDARD_EXCEPTIONS, True), (True, 11, {}, True), (True, 4, {}, False),
        (False, 11, {}, False), (True, 11, {11: "own"}, False), (True, 11, {10: "own"}, True),
    ],
)  # fmt: skip
def test_exception_of_a_gateway_is_a_silence_unless_the_drive_has_it_too(
    gateway: bool, code: int, meanings: Any, silent: bool
) -> None:
    ends = Ends(gateway=gateway)
    job = Job(Read(1, 100, 1), Priority.POLL, replace(WIDE, exceptions=meanings))
    result = ExchangeResult(ResultKind.EXCEPTION, exception=code)
    ends.outcomes.hear_gateway(job, result)
    assert (result.kind is ResultKind.NOTHING) == silent


@pytest.mark.parametrize(
    ("kind", "priority", "known", "times"),
    [
        (ResultKind.NOTHING, Priority.OPERATOR_READ, True, 1),
        (ResultKind.NOTHING, Priority.OPERATOR_READ, False, 0),
        (ResultKind.NOTHING, Priority.POLL, True, 2),
        (ResultKind.NOTHING, Priority.BACKGROUND, True, 0),
        (ResultKind.DAMAGED, Priority.OPERATOR_READ, False, 1),
        (ResultKind.DAMAGED, Priority.POLL, True, 2),
        (ResultKind.DAMAGED, Priority.BACKGROUND, True, 0),
        (ResultKind.WRONG, Priority.OPERATOR_READ, True, 0),
        (ResultKind.WRONG, Priority.POLL, True, 2),
    ],
)
def test_read_is_repeated_by_its_priority_and_the_kind_of_its_end(
    kind: ResultKind, priority: Priority, known: bool, times: int
) -> None:
    ends, job = Ends(known=known, retries=1), read(priority)
    found = [ends.end(job, kind)]
    while found[-1] is Next.REPEAT:
        ends.now += 1.0
        assert len(found) < 10, "it never ends"
        found.append(ends.end(job, kind))
    assert (len(found) - 1, job.repeats) == (times, times)
    assert job.first_sent == (9.5 if times else None)
    never = Ends(known=known, retries=0)
    assert never.end(read(priority), kind) is Next.NOTHING


def test_damaged_reply_may_come_again_unless_it_was_recognized() -> None:
    for recognized in (True, False):
        ends, job = Ends(retries=0), read()
        ends.end(job, ResultKind.DAMAGED, recognized=recognized)
        late = [] if recognized else [(1, job.expectation, 9.5, 10.0, job.pdu)]
        assert ends.late == late
    ends, write = Ends(), command()
    ends.end(write, ResultKind.WRONG)
    assert ends.late == [(1, write.expectation, 9.5, 10.0, b"")], "no copy of a write is expected"


def test_wrong_reply_that_is_explained_by_an_earlier_request_is_a_silence() -> None:
    ends, job = Ends(retries=0), read()
    other = Piece(reply(bytes([2]) + Read(2, 100, 1).pdu() + bytes(2)), whole=True)
    ends.end(job, ResultKind.WRONG, strays=[other])
    assert isinstance(error_of(job), NoAnswer), "it is of another device"
    job = read()
    own = Piece(reply(bytes([1]) + Read(1, 100, 2).pdu() + bytes(2)), whole=True)
    ends.end(job, ResultKind.WRONG, strays=[own])
    assert isinstance(error_of(job), WrongReply)


def test_write_that_was_not_sent_is_tried_again_and_then_reported_as_not_written() -> None:
    ends, job = Ends(retries=2), command()
    for tries in (1, 2):
        assert ends.end(job, ResultKind.NOTHING, unsent=True) is Next.REPEAT
        assert job.repeats == tries
    assert ends.end(job, ResultKind.NOTHING, unsent=True) is Next.NOTHING
    error = error_of(job)
    assert (error.device, error.function, error.address) == (1, 6, 8501)
    assert str(error) == "Device 1 did not answer a test read. Nothing was written."


def test_broadcast_ends_when_it_was_sent() -> None:
    job = Job(WriteOne(0, 8501, 0), Priority.STOP, WIDE)
    assert Ends().end(job, ResultKind.NOTHING) == Reply((), 9.5, b"")


@pytest.mark.parametrize(
    ("request_", "kind", "again"),
    [
        (Read(1, 100, 1), ResultKind.REPLY, True), (Read(1, 100, 1), ResultKind.EXCEPTION, True),
        (Read(1, 100, 1), ResultKind.NOTHING, False),
        (WriteOne(1, 100, 1), ResultKind.REPLY, False),
    ],
)  # fmt: skip
def test_reply_that_waited_for_this_program_is_requested_again(
    request_: Request, kind: ResultKind, again: bool
) -> None:
    ends = Ends()
    job = Job(request_, Priority.POLL, WIDE)
    longest = ends.devices.time_out(1, request_.function, Priority.POLL)
    for lay, doubted in ((longest + 0.9, False), (longest + 1.1, again)):
        result = ExchangeResult(kind, end=10.0 - lay, turnaround=0.0)
        assert ends.outcomes.waited_for_us(job, result) == doubted


def test_reply_at_the_end_of_its_time_is_not_requested_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ends, job = Ends(), read()
    monkeypatch.setattr(outcomes_module, "STILL", 1.0)
    monkeypatch.setattr(ends.devices, "time_out", lambda *_: 0.5)
    for end, again in ((8.75, False), (8.5, True)):
        result = ExchangeResult(ResultKind.REPLY, end=end, turnaround=0.25)
        assert ends.outcomes.waited_for_us(job, result) == again


@pytest.mark.parametrize("kind", [ResultKind.REPLY, ResultKind.EXCEPTION])
def test_device_learns_from_each_reply(kind: ResultKind, monkeypatch: pytest.MonkeyPatch) -> None:
    ends, job = Ends(), read()
    learned: list[object] = []
    monkeypatch.setattr(ends.devices, "answered", lambda *of, **how: learned.append((of, how)))
    ends.end(job, kind, pdu=VALUE, exception=2)
    refused = {"refused": kind is ResultKind.EXCEPTION}
    assert learned == [((1, job.expectation, 0.125, 10.0, (job.pdu, VALUE)), refused)]


def test_guess_about_a_wrong_reply_can_be_judged_later(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = Ends()
    before: Any = object()
    seen: list[object] = []

    def known_before(*of: object) -> Any:
        seen.append(of)
        return before

    monkeypatch.setattr(outcomes_module, "known_before", known_before)
    monkeypatch.setattr(ends.outcomes, "note_strays", lambda *_: set())
    ends.end(read(), ResultKind.WRONG, strays=[Piece(b"", True)])
    assert ends.devices[1].guess is before
    assert seen == [(ends.devices[1], 9.5)]


def test_frames_beside_a_broadcast_are_counted() -> None:
    ends = Ends()
    stray = Piece(bytes([1, *VALUE, 0, 0]), True)
    ends.end(Job(WriteOne(0, 1, 1), Priority.STOP, WIDE), ResultKind.NOTHING, strays=[stray])
    assert ends.tally.stale == 1


# -- what is counted and reported ------------------------------------------------------------------


class Counted(Ends):
    """Ends of requests whose counts are noted by their names."""

    def __init__(self, **how: Any) -> None:
        super().__init__(**how)
        self.counts: list[tuple[object, ...]] = []
        names = [name for name in dir(self.tally) if name.startswith("count_")]
        counts = {name: self._noted(name.removeprefix("count_")) for name in names}
        self.outcomes._tally = self.counter = cast(Any, SimpleNamespace(stale=0, **counts))

    def _noted(self, name: str) -> Any:
        def count(*those: object, **how: object) -> None:
            self.counts.append((name, *those, *how.values()))

        return count


@pytest.mark.parametrize(
    ("kind", "known", "priority", "counts"),
    [
        (ResultKind.REPLY, True, Priority.POLL, [("reply", 1, 0.125), ("good", 1, True)]),
        (ResultKind.REPLY, False, Priority.POLL, [("reply", 1, 0.125), ("good", 1, False)]),
        (ResultKind.EXCEPTION, True, Priority.POLL,
         [("reply", 1, 0.125), ("good", 1, True), ("exception", 1, 2)]),
        (ResultKind.DAMAGED, True, Priority.POLL,
         [("minute", 1, "damaged"), ("checksum", 1), ("repeat", 1)]),
        (ResultKind.DAMAGED, False, Priority.BACKGROUND, [("checksum", 1)]),
        (ResultKind.DAMAGED, True, Priority.BACKGROUND,
         [("minute", 1, "damaged"), ("checksum", 1)]),
        (ResultKind.WRONG, True, Priority.OPERATOR_READ, [("minute", 1, "damaged"), ("wrong", 1)]),
        (ResultKind.NOTHING, False, Priority.BACKGROUND, [("silence", 1, True)]),
        (ResultKind.NOTHING, False, Priority.POLL, [("silence", 1, False)]),
        (ResultKind.NOTHING, True, Priority.BACKGROUND, [("silence", 1, False)]),
    ],
)  # fmt: skip
def test_each_end_is_counted_for_its_drive(
    kind: ResultKind, known: bool, priority: Priority, counts: list[tuple[object, ...]]
) -> None:
    ends = Counted(known=known)
    ends.end(read(priority), kind, pdu=VALUE, exception=2)
    assert ends.counts == counts


def test_request_with_a_timeout_of_its_own_searches_for_a_drive() -> None:
    ends = Counted()
    ends.end(read(Priority.BACKGROUND, within=0.1), ResultKind.NOTHING)
    assert ends.counts == [("silence", 1, True)]


@pytest.mark.parametrize(
    ("failures", "silent", "heard"),
    [(0, None, True), (2, 60.0, True), (3, 60.0, False), (3, 4.9, True), (3, 5.0, False)],
)
def test_few_or_short_misses_of_a_drive_are_those_of_the_line(
    failures: int, silent: float | None, heard: bool
) -> None:
    ends = Counted()
    record = ends.devices[1]
    record.failures = failures
    record.silent_since = None if silent is None else 10.0 - silent
    ends.end(read(), ResultKind.REPLY, pdu=VALUE)
    assert ends.counts[1] == ("good", 1, heard)


@pytest.mark.parametrize("kind", [*ResultKind])
def test_additional_exchange_is_counted_if_it_brought_a_reply(kind: ResultKind) -> None:
    ends = Counted()
    ends.outcomes.count_beside(1, ExchangeResult(kind, turnaround=0.25, end=9.0))
    good = kind in (ResultKind.REPLY, ResultKind.EXCEPTION)
    assert ends.counts == ([("reply", 1, 0.25), ("good", 1, True)] if good else [])


@pytest.mark.parametrize("kind", [*ResultKind])
def test_exchange_is_recorded_as_it_was_on_the_wire(
    kind: ResultKind, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends = Ends()
    monkeypatch.setattr(outcomes_module, "time", lambda: 5000.0)
    kept: list[EndedExchange] = []
    stray = Piece(reply(bytes([1, 3, 0, 100, 0, 1, 0, 0])), whole=True)
    result = ExchangeResult(kind, pdu=VALUE, received=b"noise", sent=9.5, end=9.75, strays=[stray])
    ends.outcomes.record(1, b"request", result)
    ends.facts.record = kept.append
    job = read(program="p1", repeats=2)
    ends.outcomes.record(1, b"request", result, job)
    ends.outcomes.record(1, b"request", result, job, "copy")
    ends.outcomes.record(1, b"request", result)
    good = kind in (ResultKind.REPLY, ResultKind.EXCEPTION)
    expected = EndedExchange(
        1, b"request", kind.value, VALUE if good else b"noise", 9.5, 9.75, 4999.75, "p1", 2,
        (stray.data,),
    )  # fmt: skip
    assert kept == [
        expected, expected._replace(result="copy"), expected._replace(program="", repeat=0),
    ]  # fmt: skip


def test_recorder_that_fails_is_used_no_longer(caplog: pytest.LogCaptureFixture) -> None:
    ends = Ends()

    def full(_: object) -> None:
        raise OSError("the disk is full")

    ends.facts.record = full
    ends.outcomes.record(1, b"request", ExchangeResult(ResultKind.REPLY))
    assert ends.facts.record is None
    assert "the recorder failed" in caplog.text


@pytest.mark.parametrize(
    ("known", "kind", "data", "counted"),
    [
        (True, "late", b"", []), (True, "copy", b"", [("minute", 1, "strays")]),
        (True, "", b"", [("minute", 1, "strays")]), (False, "", b"", [("minute", None, "foreign")]),
        (True, "", bytes([1, 3, 0, 100, 0, 1]), [("minute", None, "foreign")]),
        (True, "copy", bytes([1, 3, 0, 100, 0, 1]), [("minute", 1, "strays")]),
    ],
)  # fmt: skip
def test_stray_frame_is_counted_by_its_origin(
    known: bool, kind: str, data: bytes, counted: list[object]
) -> None:
    ends = Counted(known=known)
    judged: list[object] = []

    def stray(piece: Piece, time: float) -> str:
        judged.append((piece, time))
        return kind

    ends.devices.stray = stray  # type: ignore[method-assign,assignment]
    whole = frame(data[0], data[1:]) if data else frame(1, VALUE)
    piece = Piece(whole, whole=True)
    assert ends.outcomes.note_strays([piece], 9.0) == (set() if kind else {1})
    assert ends.counts == counted
    assert ends.counter.stale == 1
    assert judged == [(piece, 9.0)]


def test_written_registers_are_reported_with_their_program_and_time() -> None:
    ends = Ends()
    here, other, left = (
        cast(Any, SimpleNamespace(id=name)) for name in (ends.facts.me.id, "other", "left")
    )
    ends.facts.programs, ends.facts.departed = (here, other), (left,)
    seen: list[DeviceWritten] = []
    on_event(ends.facts, DeviceWritten, seen.append)
    for program in ("", "other", "left", "never there"):
        job = Job(WriteOne(1, 8501, 15), Priority.OPERATOR_WRITE, WIDE, program=program)
        ends.end(job, ResultKind.REPLY, pdu=job.pdu)
    ends.end(read(), ResultKind.REPLY, pdu=VALUE)
    ends.end(command(), ResultKind.EXCEPTION, exception=2)
    assert [(each.device, each.address, list(each.values), each.program.id, each.time)
            for each in seen] == [
        (1, 8501, [15], name, 9.75) for name in (here.id, "other", "left")
    ]  # fmt: skip
    broadcast = Job(WriteOne(0, 8501, 0), Priority.STOP, WIDE)
    ends.end(broadcast, ResultKind.NOTHING)
    assert (seen[-1].device, seen[-1].time) == (0, 9.5)
