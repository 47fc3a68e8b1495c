"""Shares of the line's time under overload, and each step of a request; in time of the tests."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import Priority, Reply
from tui.bus.errors import OUTCOME_UNKNOWN, LineClosed, LineFailed, LineLost, RequestRefused
from tui.bus.limits import Limits
from tui.bus.line import Timing
from tui.bus.master import ExchangeResult, Master, Piece, ResultKind, Sending
from tui.bus.requests import Diagnose, Read, Request, WriteOne
from tui.bus.schedule.dispatcher import Dispatcher
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import MINIMUM_SHARES, Job
from tui.bus.tally import Tally

from .conftest import WIDE

Submitted = tuple[Priority, str, int, int | None]
"""Priority, program, device and the word that is written, None for a read."""
COMMAND, STOP_WORD, RUN_WORD = 8501, 7, 15
EXCHANGE = 0.03
"""Seconds of one exchange on the line of these tests."""


class TimedLine:
    """A dispatcher with a master whose exchanges advance the clock, until the time is up."""

    def __init__(self) -> None:
        self.failure: LineLost | None = None
        self.now = 100.0
        self.end = 0.0
        self.sent: list[Job] = []
        self.away: set[int] = set()
        """Devices that answer nothing."""
        self.round_trip = False
        """True if programs send again during the next exchange only."""
        self.last_moment: Callable[[], None] = lambda: None
        """Called when a request is about to be sent."""
        self._later: list[Submitted] = []
        self._again: list[Submitted] = []
        self._waiting: list[Job] = []
        timing = Timing(probes=False)
        devices = Devices(timing, mistakable=False)
        self.dispatcher = Dispatcher(devices, Tally(), timing, lambda: self.now, gateway=False)

    def ask(
        self, priority: Priority, program: str = "a", device: int = 1, word: int | None = None
    ) -> Job:
        """Hand over a read, or the write of a word."""
        request = Read(device, 0, 1) if word is None else WriteOne(device, COMMAND, word)
        job = Job(request, priority, WIDE, program=program, requested=self.now)
        self._waiting.append(job)
        self.dispatcher.submit(job)
        return job

    def keep_asking(
        self, priority: Priority, program: str = "a", count: int = 4, word: int | None = None
    ) -> None:
        """Keep this many requests waiting."""
        for device in range(1, count + 1):
            self._again.append((priority, program, device, word))
            self.ask(priority, program, device, word)

    async def quiet(self) -> None:
        """End the current exchange once the time is up."""
        if self.now >= self.end:
            raise LineLost("the time is up")

    async def exchange(self, sending: Sending) -> ExchangeResult:
        """Answer, and repeat the request."""
        self.last_moment()
        sending.look()
        self.now += EXCHANGE
        later, self._later = self._later, []
        for pair in later:
            self.ask(*pair)
        job = next(item for item in self._waiting if item.begun)
        self._waiting.remove(job)
        self.sent.append(job)
        request = job.request
        word = request.value if isinstance(request, WriteOne) else None
        again = job.priority, job.program, request.device, word
        if again in self._again and self.round_trip:
            self._later.append(again)
        elif again in self._again:
            self.ask(*again)
        if request.device in self.away:
            return ExchangeResult(ResultKind.NOTHING, end=self.now)
        reply = bytes([3, 2, 0, 0]) if word is None else job.pdu
        return ExchangeResult(ResultKind.REPLY, reply, end=self.now, turnaround=0.01)

    def serve(self, seconds: float) -> None:
        """Serve for so long by the clock."""
        self.end = self.now + seconds - EXCHANGE / 2

        async def served() -> None:
            with pytest.raises(LineLost):
                await self.dispatcher.serve(self)  # type: ignore[arg-type]

        asyncio.run(served())

    def shares(self) -> dict[Priority, float]:
        """The share of the time that each kind of request had."""
        counted = Counter(job.priority for job in self.sent)
        return {priority: count / counted.total() for priority, count in counted.items()}


URGENT = (Priority.FEED, Priority.OPERATOR_WRITE)
SHARED = tuple(MINIMUM_SHARES)
STARVED = [(low, high) for low in SHARED for high in (*URGENT, *SHARED) if high < low]


@pytest.mark.parametrize(("low", "high"), STARVED)
def test_full_line_leaves_each_kind_its_minimum_share(low: Priority, high: Priority) -> None:
    line = TimedLine()
    line.keep_asking(high)
    line.keep_asking(low)
    line.serve(60.0)
    assert line.shares()[low] == pytest.approx(MINIMUM_SHARES[low], rel=0.1)


def test_all_kinds_at_once_have_their_minimum_shares() -> None:
    line = TimedLine()
    for priority in (*URGENT, *SHARED):
        line.keep_asking(priority)
    line.serve(60.0)
    shares = line.shares()
    assert all(shares[item] == pytest.approx(MINIMUM_SHARES[item], rel=0.1) for item in SHARED)
    assert shares[Priority.FEED] == pytest.approx(1 - sum(MINIMUM_SHARES.values()), rel=0.1)


def test_stop_precedes_kinds_that_are_owed_time() -> None:
    line = TimedLine()
    for priority in (*URGENT, *SHARED):
        line.keep_asking(priority)
    line.serve(1.0)
    for _ in range(40):
        stop = line.ask(Priority.STOP)
        before = len(line.sent)
        line.serve(EXCHANGE)
        assert line.sent[before] is stop


def test_repeated_stops_alternate_with_waiting_requests() -> None:
    line = TimedLine()
    for program in ("a", "b"):
        line.keep_asking(Priority.STOP, program, word=STOP_WORD)
    for priority in SHARED:
        line.keep_asking(priority)
    line.keep_asking(Priority.FEED, count=1)
    line.serve(20.0)
    shares = line.shares()
    assert shares[Priority.STOP] == pytest.approx(0.5, rel=0.05)
    rest = 1 - sum(MINIMUM_SHARES.values())
    assert shares[Priority.FEED] == pytest.approx(0.5 * rest, rel=0.1)
    assert all(shares[item] > 0 for item in SHARED)


def test_unanswered_stops_alternate_with_waiting_requests() -> None:
    line = TimedLine()
    line.away = {1}
    line.keep_asking(Priority.STOP, count=1, word=STOP_WORD)
    line.keep_asking(Priority.FEED, count=2)
    line.serve(20.0)
    assert line.shares()[Priority.FEED] == pytest.approx(0.5, rel=0.1)


def test_first_stop_precedes_repeated_ones() -> None:
    line = TimedLine()
    for priority in (*URGENT, *SHARED):
        line.keep_asking(priority)
    line.keep_asking(Priority.STOP, "b", word=STOP_WORD)
    line.serve(2.0)
    for device in range(10, 30):
        line.serve(EXCHANGE)
        stop, before = line.ask(Priority.STOP, "c", device, STOP_WORD), len(line.sent)
        line.serve(2 * EXCHANGE)
        waiting = line.sent[before:]
        assert stop in waiting
        assert all(job.priority is Priority.STOP for job in waiting[: waiting.index(stop)])


def test_repeated_stop_waits_for_one_exchange_at_most() -> None:
    line = TimedLine()
    for priority in (*URGENT, *SHARED):
        line.keep_asking(priority)
    for _ in range(10):
        stop, before = line.ask(Priority.STOP, word=STOP_WORD), len(line.sent)
        line.serve(2 * EXCHANGE)
        assert stop in line.sent[before:]


def test_line_with_spare_time_follows_priority() -> None:
    line = TimedLine()
    line.keep_asking(Priority.POLL)
    line.serve(10.0)
    line.sent.clear()
    commands = [line.ask(Priority.OPERATOR_WRITE) for _ in range(3)]
    reads = [line.ask(Priority.OPERATOR_READ) for _ in range(3)]
    line.serve(6 * EXCHANGE)
    assert line.sent == commands + reads


def test_scan_gets_its_share_and_no_more() -> None:
    line = TimedLine()
    line.round_trip = True
    line.keep_asking(Priority.POLL)
    line.keep_asking(Priority.BACKGROUND, count=1)
    line.serve(60.0)
    share = MINIMUM_SHARES[Priority.BACKGROUND]
    assert line.shares()[Priority.BACKGROUND] == pytest.approx(share, rel=0.1)


@pytest.mark.parametrize("priority", SHARED)
def test_programs_share_evenly_whatever_their_demand(priority: Priority) -> None:
    line = TimedLine()
    line.keep_asking(priority, "many", count=31)
    line.keep_asking(priority, "few", count=2)
    line.serve(30.0)
    counted = Counter(job.program for job in line.sent)
    assert counted["few"] == pytest.approx(counted["many"], rel=0.05)


def test_program_with_few_requests_waits_two_exchanges_at_most() -> None:
    line = TimedLine()
    line.keep_asking(Priority.POLL, "many", count=31)
    line.serve(5.0)
    for _ in range(20):
        poll = line.ask(Priority.POLL, "few")
        before = len(line.sent)
        line.serve(2 * EXCHANGE)
        assert poll in line.sent[before:]
        line.serve(5 * EXCHANGE)


def test_idle_program_gains_no_credit() -> None:
    line = TimedLine()
    line.keep_asking(Priority.POLL, "here")
    line.ask(Priority.POLL, "away")
    line.serve(60.0)
    line.sent.clear()
    line.keep_asking(Priority.POLL, "away")
    line.serve(3.0)
    counted = Counter(job.program for job in line.sent)
    assert counted["here"] == pytest.approx(counted["away"], rel=0.05)


async def outcome(line: TimedLine, job: Job) -> Reply:
    """Serve until a request is over, and return its reply; raises its error."""
    line.end = math.inf
    serving = asyncio.ensure_future(line.dispatcher.serve(line))  # type: ignore[arg-type]
    try:
        return await asyncio.wait_for(asyncio.wrap_future(job.answer), 20.0)
    finally:
        serving.cancel()


async def test_stop_in_the_silence_before_a_command_refuses_it() -> None:
    line = TimedLine()
    line.last_moment = lambda: line.dispatcher.facts.give_stop([1], "the stop key")
    with pytest.raises(RequestRefused, match="a stop came after it"):
        await outcome(line, line.ask(Priority.OPERATOR_WRITE, word=7))
    assert line.sent == []


@pytest.mark.parametrize(
    ("priority", "device", "word"),
    [
        (Priority.STOP, 1, 0),
        (Priority.STOP, 1, None),
        (Priority.POLL, 1, None),
        (Priority.OPERATOR_WRITE, 2, 7),
    ],
)
async def test_stop_in_the_silence_before_a_request_leaves_stops_reads_and_other_devices(
    priority: Priority, device: int, word: int | None
) -> None:
    line = TimedLine()
    line.last_moment = lambda: line.dispatcher.facts.give_stop([1], "the stop key")
    job = line.ask(priority, device=device, word=word)
    await outcome(line, job)
    assert line.sent == [job]


async def test_command_that_is_held_back_at_the_last_moment_is_sent_later() -> None:
    """A program that was suspended first gets the stops of the others."""
    line = TimedLine()
    until = line.now + 0.1

    def held() -> bool:
        line.now += 0.01
        return line.now < until

    line.last_moment = lambda: setattr(line.dispatcher, "held_back", held)
    command = line.ask(Priority.OPERATOR_WRITE, word=7)
    await outcome(line, command)
    assert line.sent == [command]
    assert line.now >= until


async def test_reply_is_due_from_the_request_to_the_end_of_its_exchange() -> None:
    """The next program on the line waits for a reply that is due when this one leaves."""
    line, due = TimedLine(), []
    line.last_moment = lambda: due.append(line.dispatcher.in_flight)
    await outcome(line, line.ask(Priority.POLL))
    assert (due, line.dispatcher.in_flight) == ([True], False)
    line.last_moment = lambda: line.dispatcher.facts.give_stop([1], "the stop key")
    with pytest.raises(RequestRefused):
        await outcome(line, line.ask(Priority.OPERATOR_WRITE, word=7))
    assert not line.dispatcher.in_flight


async def test_reply_is_due_after_its_exchange_was_cut_short() -> None:
    line = TimedLine()
    begun = asyncio.Event()

    async def hangs(sending: Sending) -> ExchangeResult:
        begun.set()
        return await asyncio.Future()

    line.exchange = hangs  # type: ignore[method-assign]
    line.end = math.inf
    job = line.ask(Priority.POLL)
    serving = asyncio.ensure_future(line.dispatcher.serve(line))  # type: ignore[arg-type]
    await asyncio.wait_for(begun.wait(), 20.0)
    serving.cancel()
    await asyncio.wait([serving])
    assert line.dispatcher.in_flight
    assert isinstance(job.answer.exception(0), LineClosed)


async def fails_internally(line: TimedLine, word: int | None, text: str, *, unknown: bool) -> None:
    """An internal error fails the request in progress, and ends the serving."""
    line.end = math.inf
    job = line.ask(Priority.OPERATOR_WRITE, word=word)
    with pytest.raises(ZeroDivisionError):
        await line.dispatcher.serve(line)  # type: ignore[arg-type]
    error = job.answer.exception(0)
    assert isinstance(error, LineFailed)
    assert str(error).startswith(f"{text}: ZeroDivisionError('on purpose').")
    assert str(error).endswith(OUTCOME_UNKNOWN) is unknown


@pytest.mark.parametrize(("word", "unknown"), [(None, False), (7, True)])
async def test_internal_error_during_an_exchange_fails_its_request(
    word: int | None, unknown: bool
) -> None:
    """A write may have taken effect."""
    line = TimedLine()

    async def breaks(sending: Sending) -> ExchangeResult:
        raise ZeroDivisionError("on purpose")

    line.exchange = breaks  # type: ignore[method-assign]
    await fails_internally(line, word, "The request failed", unknown=unknown)


# -- one request, with each part of the dispatcher set by the test ---------------------------------


class Parts:
    """A dispatcher at 100 s; its master gives `results` in their order."""

    echo: bool | None = None

    def __init__(self, *results: ExchangeResult | Exception) -> None:
        self.now = 100.0
        self.results = list(results)
        self.sent: list[Sending] = []
        self.quiets = 0
        timing = Timing(probes=False)
        self.devices = Devices(timing, mistakable=True)
        self.here = Dispatcher(self.devices, Tally(), timing, lambda: self.now, gateway=False)
        self.late: list[tuple[Any, ...]] = []
        self.devices.may_come = lambda *those: self.late.append(those)  # type: ignore[method-assign]

    @property
    def master(self) -> Master:
        return cast(Master, self)

    async def quiet(self) -> None:
        self.quiets += 1

    async def exchange(self, sending: Sending) -> ExchangeResult:
        self.sent.append(sending)
        sending.look()
        self.now += 0.25
        result = self.results.pop(0)
        if isinstance(result, Exception):
            raise result
        return result


VALUE = bytes([3, 2, 0, 7])


def job_of(
    priority: Priority = Priority.POLL, request: Request | None = None, limits: Limits = WIDE
) -> Job:
    return Job(request or Read(1, 100, 1), priority, limits, program="a")


def replied(pdu: bytes = VALUE) -> ExchangeResult:
    return ExchangeResult(ResultKind.REPLY, pdu, sent=100.1, end=100.25, turnaround=0.05)


def test_request_waits_for_the_first_of_its_reasons() -> None:
    parts = Parts()
    here, job, stop = parts.here, job_of(), job_of(Priority.STOP, WriteOne(1, COMMAND, STOP_WORD))
    longer: list[int] = []
    forms = [False]

    def lengthen(_: Job) -> bool:
        longer.append(1)
        if forms[0]:
            free.insert(0, 50.0)
        return forms[0]

    steps = SimpleNamespace(not_before=lambda *_: None, lengthen=lengthen)
    cast(Any, here).steps = steps
    cast(Any, here).proof = proof = SimpleNamespace(not_before=lambda *_: 0.0)
    back = SimpleNamespace(not_before=lambda _: 0.0)
    cast(Any, here)._back_to_back = back
    free = [99.0]
    devices = cast(Any, parts.devices)
    devices.not_before = lambda *_: free[0]
    devices.backed_off = lambda *_: None
    assert here._not_before(job) == 99.0
    free[0] = 100.0
    assert (here._not_before(job), longer) == (100.0, [])
    free[0] = 103.0
    devices.quiet_until = 103.0
    assert (here._not_before(job), longer) == (103.0, [])
    devices.quiet_until = 102.0
    assert (here._not_before(job), longer) == (103.0, [1])
    forms[0] = True
    assert here._not_before(job) == 50.0, "lengthened, it need not wait"
    devices.backed_off = lambda *_: 1.0
    assert here._not_before(job) == 0.0, "to fail at once"
    back.not_before = lambda _: 104.0
    assert here._not_before(job) == 104.0
    proof.not_before = lambda *_: 105.0
    assert here._not_before(job) == 105.0
    proof.not_before = lambda *_: 100.0
    assert here._not_before(job) == 104.0
    steps.not_before = lambda *_: 3.0
    assert here._not_before(job) == 3.0
    here.held_back = lambda: True
    assert here._not_before(job) == 100.01
    assert here._not_before(stop) == 3.0, "no program holds a stop back"


def test_dispatcher_looks_again_after_each_change() -> None:
    parts = Parts()
    here = parts.here

    def woken() -> bool:
        found = here._wake.is_set()
        here._wake.clear()
        return found

    assert not woken()
    job = job_of()
    here.submit(job)
    assert woken()
    assert here.take_all() == [job]
    here.put_back(job)
    assert woken()
    assert here.take_all() == [job]
    strays: list[object] = []
    recorded: list[Any] = []
    cast(Any, here)._outcomes = SimpleNamespace(
        note_stray=lambda *those: strays.append(those), record=lambda *those: recorded.append(those)
    )
    cast(Any, here).steps = SimpleNamespace(stray=strays.append)
    piece = Piece(b"a frame", whole=True)
    here.stray(piece, 99.0)
    assert woken()
    assert strays == [(piece, 99.0), piece]
    [(device, sent, result)] = recorded
    assert (device, sent, result.strays) == (piece.device, b"", [piece])
    here.wake()
    assert woken()


def test_waiting_requests_fail_with_the_line_and_a_stop_is_kept_while_it_is_behind() -> None:
    for behind, kind, kept in (
        ("", LineLost, 0),
        ("behind", LineLost, 1),
        ("behind", LineClosed, 0),
    ):
        here = Parts().here
        poll, stop = job_of(), job_of(Priority.STOP, WriteOne(1, COMMAND, STOP_WORD))
        stop.requested = 100.0
        for job in (poll, stop):
            here.submit(job)
        here.steps.behind = behind
        here.fail_all("unplugged", kind)
        for job in (poll, stop):
            assert isinstance(job.answer.exception(0), kind)
        assert [again.request for again in here.take_all()] == [stop.request] * kept


def test_old_commands_are_refused_and_neither_stops_nor_reads() -> None:
    here = Parts().here
    jobs = [
        job_of(Priority.OPERATOR_WRITE, WriteOne(1, COMMAND, RUN_WORD)),
        job_of(Priority.OPERATOR_WRITE, WriteOne(2, COMMAND, RUN_WORD)),
        job_of(Priority.STOP, WriteOne(3, COMMAND, STOP_WORD)), job_of(),
    ]  # fmt: skip
    for job, requested in zip(jobs, (98.9, 99.0, 90.0, 90.0), strict=True):
        job.requested = requested
        here.submit(job)
    here.void_older(99.0, "a stop came")
    with pytest.raises(RequestRefused, match="a stop came"):
        jobs[0].answer.result(0)
    assert here.take_all() == jobs[1:]
    here.submit(jobs[1])
    here.facts.give_stop([2], "the stop key")
    here.void()
    assert here.take_all() == []


async def test_new_connection_is_begun_before_anything_is_sent() -> None:
    parts = Parts()
    here = parts.here
    opened: list[int] = []
    here.steps.opened = lambda: opened.append(len(parts.sent))  # type: ignore[method-assign]
    here.submit(job_of())
    cast(Any, parts).failure = OSError("unplugged")
    with pytest.raises(LineLost, match="unplugged"):
        await here.serve(parts.master)
    assert (opened, parts.sent) == ([0], [])


async def test_request_is_begun_once_and_a_withdrawn_one_is_not_sent() -> None:
    parts = Parts(replied(), replied())
    withdrawn, job = job_of(), job_of()
    withdrawn.answer.cancel()
    await parts.here._run(parts.master, withdrawn)
    assert parts.sent == []
    await parts.here._run(parts.master, job)
    assert job.begun
    assert job.answer.result(0).words == (7,)
    again = job_of()
    again.begun = again.answer.set_running_or_notify_cancel()
    await parts.here._run(parts.master, again)
    assert again.answer.result(0).words == (7,), "it was begun, and is sent again"


@pytest.mark.parametrize(("word", "dropped"), [(RUN_WORD, [1]), (None, [])])
async def test_write_makes_shared_values_of_its_drive_unknown(
    word: int | None, dropped: list[int]
) -> None:
    request = Read(1, COMMAND, 1) if word is None else WriteOne(1, COMMAND, word)
    job = job_of(Priority.STOP, request)
    parts = Parts(replied(VALUE if word is None else job.pdu))
    drops: list[int] = []
    cast(Any, parts.here._outcomes.values).drop = drops.append
    await parts.here._run(parts.master, job)
    assert drops == dropped


async def test_request_on_a_lost_line_waits_for_the_state_of_the_line() -> None:
    job = job_of()
    parts = Parts(LineLost("unplugged"))
    with pytest.raises(LineLost):
        await parts.here._run(parts.master, job)
    assert not parts.here.in_flight
    assert parts.here.take_all() == [job]
    assert not job.answer.done()
    assert parts.late == [(1, job.expectation, 100.0, 100.25)]


@pytest.mark.parametrize(
    ("echo", "limits", "probed", "kind"),
    [
        (False, WIDE, True, ResultKind.REPLY), (True, WIDE, True, ResultKind.NOTHING),
        (None, WIDE, True, ResultKind.NOTHING),
        (False, Limits(functions=frozenset({6}), max_read=0, max_write=1, max_read_23=0,
                       max_write_23=0), False, ResultKind.REPLY),
    ],
)  # fmt: skip
async def test_one_copy_of_a_write_is_its_reply_if_the_adapter_has_no_echo(
    echo: bool | None, limits: Limits, probed: bool, kind: ResultKind
) -> None:
    parts = Parts(replied())
    parts.echo = echo
    job = job_of(Priority.STOP, WriteOne(1, COMMAND, STOP_WORD), limits)
    unsure = ExchangeResult(ResultKind.UNSURE)
    counted: list[int] = []
    parts.here._outcomes.count_beside = (  # type: ignore[method-assign]
        lambda device, result: counted.append(device)
    )
    await parts.here._resolve_echo(parts.master, job, unsure)
    assert unsure.kind is kind
    assert (unsure.pdu, unsure.detail) == (
        (job.pdu, "") if kind is ResultKind.REPLY
        else (b"", "only the adapter's echo of it came back")
    )  # fmt: skip
    assert counted == [1] * probed
    assert parts.quiets == probed
    if probed:
        (sending,) = parts.sent
        probe = Read(1, COMMAND, 1)
        assert (sending.device, sending.pdu, sending.expectation) == (
            1, probe.pdu(), probe.expectation()
        )  # fmt: skip
        assert sending.time_out == parts.devices.time_out(1, 3, Priority.STOP)


@pytest.mark.parametrize(
    ("kind", "repeat", "copy"),
    [
        (ResultKind.REPLY, True, True), (ResultKind.REPLY, False, False),
        (ResultKind.EXCEPTION, True, False), (ResultKind.NOTHING, True, False),
    ],
)  # fmt: skip
def test_only_a_reply_like_the_last_one_may_be_a_copy(
    kind: ResultKind, repeat: bool, copy: bool
) -> None:
    parts, job = Parts(), job_of()
    compared: list[tuple[Any, ...]] = []

    def is_repeat(*those: Any) -> bool:
        compared.append(those)
        return repeat

    cast(Any, parts.devices).is_repeat = is_repeat
    result = replied()
    result.kind = kind
    assert parts.here._may_be_copy(job, result) is copy
    assert compared == [(1, job.pdu, VALUE, 0.05)] * (kind is ResultKind.REPLY)


@pytest.mark.parametrize(
    ("request_", "form", "waited", "waits"),
    [
        (Read(1, 100, 1), False, False, False), (Read(1, 100, 1), True, False, True),
        (Read(1, 100, 1), False, True, True), (WriteOne(0, COMMAND, 7), False, False, False),
    ],
)  # fmt: skip
def test_end_of_an_exchange_is_noted_by_each_part(
    request_: Request, form: bool, waited: bool, waits: bool
) -> None:
    parts = Parts()
    here, job, result = parts.here, job_of(request=request_), replied()
    noted: list[tuple[Any, ...]] = []

    def note(name: str, back: object = None) -> Any:
        def called(*those: Any) -> object:
            noted.append((name, *those))
            return back

        return called

    outcomes, steps = cast(Any, here._outcomes), cast(Any, here.steps)
    outcomes.hear_gateway, outcomes.record = note("gateway"), note("record")
    steps.note, steps.end_form = note("step"), note("form", form)
    cast(Any, here._back_to_back).count = note("count")
    cast(Any, here.proof).sent = note("sent")
    outcomes.waited_for_us = note("waited", waited)
    cast(Any, here)._end = note("end")
    here._conclude(job, result, 99.5)
    expected = [
        ("gateway", job, result), ("record", job.request.device, job.pdu, result, job),
        ("step", job, job.expectation, result), ("count", job, 99.5, 100.0), ("sent", job, 99.5),
        ("form", job, result), ("waited", job, result), ("end", job, result),
    ]  # fmt: skip
    left_out = {"step"} if job.expectation is None else set()
    left_out |= {"end"} if waits else set()
    left_out |= {"waited"} if form else set()
    assert noted == [entry for entry in expected if entry[0] not in left_out]
    assert here.take_all() == ([job] if waits else [])


@pytest.mark.parametrize("second", [VALUE, bytes([3, 2, 0, 8])])
async def test_reply_that_may_be_a_copy_is_requested_once_more(second: bytes) -> None:
    parts, job = Parts(replied(second)), job_of()
    doubted = replied()
    counted: list[object] = []
    strays: list[float] = []
    parts.here._outcomes.count_beside = (  # type: ignore[method-assign]
        lambda device, result: counted.append((device, result))
    )

    def note_strays(_: object, end: float) -> set[int]:
        strays.append(end)
        return set()

    cast(Any, parts.here._outcomes).note_strays = note_strays
    result = await parts.here._ask_again(parts.master, job, doubted)
    assert result.pdu == second
    assert (parts.quiets, counted, strays) == (1, [(1, doubted)], [100.25])
    assert parts.late == ([] if second == VALUE else [(1, job.expectation, 100.1, 100.25)])


@pytest.mark.parametrize(
    ("kind", "waits", "ended"),
    [
        (ResultKind.NOTHING, True, True), (ResultKind.WRONG, True, True),
        (ResultKind.NOTHING, False, False), (ResultKind.REPLY, True, False),
        (ResultKind.EXCEPTION, True, False),
    ],
)  # fmt: skip
async def test_request_whose_probe_has_no_reply_has_none_either(
    kind: ResultKind, waits: bool, ended: bool
) -> None:
    parts = Parts(ExchangeResult(kind, sent=100.1, end=100.2))
    here, job = parts.here, job_of(Priority.OPERATOR_WRITE, WriteOne(1, COMMAND, RUN_WORD))
    job.repeats = 99
    if waits:
        here.put_back(job)
    flights: list[bool] = []
    prove = here.steps.prove

    async def proved(*those: Any) -> ExchangeResult:
        flights.append(here.in_flight)
        return await prove(*those)

    cast(Any, here.steps).prove = proved
    await here._prove(parts.master, job, Diagnose(1, 0, 7))
    assert (flights, here.in_flight) == ([True], False)
    assert here.take_all() == ([job] if waits and not ended else [])
    assert job.answer.done() == ended
    if ended:
        assert "Nothing was written" in str(job.answer.exception(0))


@pytest.mark.parametrize(
    ("missed", "kind"),
    [
        (True, ResultKind.NOTHING),
        (False, ResultKind.DAMAGED),
    ],
)
def test_repeated_poll_lets_others_pass_if_its_drive_is_silent(
    missed: bool, kind: ResultKind
) -> None:
    here = Parts().here
    first, second = job_of(), job_of(request=Read(2, 100, 1))
    for job in (first, second):
        here.submit(job)
    here._queue.remove(first)
    here._repeat(first, ExchangeResult(kind))
    taken, _ = here._queue.take(lambda _: 0.0, 100.0)
    assert taken is (second if missed else first)
    reading = job_of(Priority.OPERATOR_READ)
    reading.order = -1
    here._repeat(reading, ExchangeResult(ResultKind.NOTHING))
    assert reading.order == -1, "only a poll gives up its place"


def test_request_is_sent_with_what_is_known_of_its_drive() -> None:
    parts = Parts()
    here, job = parts.here, job_of(request=WriteOne(1, COMMAND, RUN_WORD))
    cast(Any, parts.devices).doubts = lambda *those: (True, 3)
    found = here._sending(job)
    assert (found.device, found.pdu, found.expectation) == (1, job.pdu, job.expectation)
    assert (found.sure, found.skip) == (True, 3)
    assert found.time_out == parts.devices.time_out(1, 6, Priority.POLL, None)
    here.proof.doubt(101.0)
    assert not here._sending(job).sure, "a refusal may be another's"
    read = job_of()
    read.take_form(Read(1, 100, 2))
    assert here._sending(read).sure, "its form is its own"
    job.within = 0.07
    assert here._sending(job).time_out == 0.07
    broadcast = here._sending(job_of(request=WriteOne(0, COMMAND, 0)))
    assert (broadcast.device, broadcast.expectation, broadcast.time_out) == (0, None, 0.0)
    found.look()
    here.facts.give_stop([1], "the stop key")
    with pytest.raises(Exception, match="a stop came after it"):
        found.look()


@pytest.mark.parametrize(("word", "unknown"), [(None, False), (7, True)])
async def test_internal_error_in_judging_a_reply_fails_its_request(
    word: int | None, unknown: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its caller would wait for ever: the request no longer waits in the queue."""
    line = TimedLine()

    def breaks(*_: object) -> bool:
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(line.dispatcher.steps, "end_form", breaks)
    await fails_internally(line, word, "The reply could not be judged", unknown=unknown)
