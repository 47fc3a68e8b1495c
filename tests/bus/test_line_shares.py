"""Shares of the line's time under overload; by the clock of the test."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import Callable

import pytest

from tui.bus.api import Priority, Reply
from tui.bus.errors import OUTCOME_UNKNOWN, LineClosed, LineFailed, LineLost, RequestRefused
from tui.bus.line import Timing
from tui.bus.master import ExchangeResult, ResultKind, Sending
from tui.bus.requests import Read, WriteOne
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


@pytest.mark.parametrize(("word", "unknown"), [(None, False), (7, True)])
async def test_internal_error_during_an_exchange_fails_its_request(
    word: int | None, unknown: bool
) -> None:
    """A write may have taken effect."""
    line = TimedLine()

    async def breaks(sending: Sending) -> ExchangeResult:
        raise ZeroDivisionError("on purpose")

    line.exchange = breaks  # type: ignore[method-assign]
    line.end = math.inf
    job = line.ask(Priority.OPERATOR_WRITE, word=word)
    with pytest.raises(ZeroDivisionError):
        await line.dispatcher.serve(line)  # type: ignore[arg-type]
    error = job.answer.exception(0)
    assert isinstance(error, LineFailed)
    assert str(error).startswith("The request failed: ZeroDivisionError('on purpose').")
    assert str(error).endswith(OUTCOME_UNKNOWN) is unknown
