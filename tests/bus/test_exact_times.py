"""Times on a line to the exact moment: keep-alive reads, gaps for programs, timers of bytes."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.keep_alive import KeepAlive
from tui.bus.limits import CAUTIOUS
from tui.bus.model import Priority
from tui.bus.requests import Identify, Read, WriteOne
from tui.bus.rtu import master as masters
from tui.bus.rtu.exchange import FLOOD, RtuExchange, find_reply, noted
from tui.bus.rtu.master import PutOffTimer
from tui.bus.schedule import back_to_back as pauses
from tui.bus.schedule.alive_reads import LONGEST_RETRY, AliveReads
from tui.bus.schedule.back_to_back import (
    GAP,
    LONGEST_GAP,
    LONGEST_PAUSE,
    MARGIN,
    PAUSES,
    REST_AT_MOST,
    TRIP,
    BackToBack,
)
from tui.bus.schedule.queue import Job
from tui.wire.frames import frame

from .conftest import WIDE
from .peer import honest_pdu

NOW = 1024.0


# -- keep-alive reads ------------------------------------------------------------------------------


class Alive:
    """The reads of a device with a timeout of 4 s; `kept` may be replaced."""

    def __init__(self, *programs: str, timeout: float = 4.0, until: float | None = None) -> None:
        self.now = NOW
        self.jobs: list[Job] = []
        self.heard: float | None = None
        self.keep(*programs, timeout=timeout, until=until)
        self.limits = WIDE
        facts = SimpleNamespace(keep_alives=self)
        self.reads = AliveReads(
            cast(Any, {1: self}), cast(Any, facts), lambda: self.now, self.jobs.append
        )

    def keep(self, *programs: str, timeout: float = 4.0, until: float | None = None) -> None:
        self.kept = {(program, 1): KeepAlive(1, timeout, 77, until=until) for program in programs}

    def look(self, at: float) -> float:
        self.now = at
        return self.reads.put_due()


def test_keep_alive_read_is_sent_at_the_moment_it_is_due() -> None:
    alive = Alive("a")
    assert alive.look(NOW) == NOW + 1
    assert alive.look(NOW + 0.5) == NOW + 1
    alive.heard = NOW + 0.25
    assert alive.look(NOW + 0.75) == NOW + 1, "nothing is calculated before"
    assert alive.look(NOW + 1) == NOW + 1.25
    assert alive.jobs == []
    assert alive.look(NOW + 1.25) == NOW + 1.75
    (job,) = alive.jobs
    assert (job.request, job.priority, job.limits) == (Read(1, 77, 1), Priority.FEED, WIDE)
    assert (job.program, job.requested, job.keeps_alive) == ("a", NOW + 1.25, True)


def test_keep_alive_read_that_fails_is_repeated_after_half_its_period() -> None:
    alive = Alive("a")
    alive.look(NOW)
    assert alive.look(NOW + 1) == NOW + 1.5
    assert alive.look(NOW + 1.5) == NOW + 2, "it still waits for the line"
    assert len(alive.jobs) == 1
    alive.jobs[0].answer.cancel()
    assert alive.look(NOW + 2) == NOW + 2.5
    assert len(alive.jobs) == 2
    slow = Alive("a", timeout=60.0)
    slow.look(NOW)
    assert slow.look(NOW + 15) == NOW + 15 + LONGEST_RETRY


def test_device_heard_at_the_moment_of_its_read_needs_no_other_one() -> None:
    alive = Alive("a")
    alive.look(NOW)
    alive.look(NOW + 1)
    alive.heard = NOW + 1
    assert alive.look(NOW + 1.75) == NOW + 2


def test_device_that_has_timed_out_is_read_behind_the_others() -> None:
    for seconds, priority in ((3.75, Priority.FEED), (4.0, Priority.POLL)):
        alive = Alive("a")
        alive.look(NOW)
        alive.look(NOW + seconds)
        assert [job.priority for job in alive.jobs] == [priority]


def test_change_of_what_is_kept_alive_counts_immediately() -> None:
    alive = Alive()
    assert alive.look(NOW) == math.inf
    alive.keep("a")
    assert alive.look(NOW + 8) == NOW + 9, "since it was first kept"
    alive.keep("b", "a")
    assert alive.look(NOW + 9) == NOW + 9.5
    assert [job.program for job in alive.jobs] == ["b"], "the first of equal ones"
    alive.keep()
    assert alive.look(NOW + 9.25) == math.inf
    alive.keep("a")
    assert alive.look(NOW + 10) == NOW + 11
    both = {("a", 1): KeepAlive(1, 8.0, 77), ("b", 1): KeepAlive(1, 4.0, 77, until=NOW + 10.5)}
    alive.kept = both
    assert alive.look(NOW + 10.25) == NOW + 11, "of the shortest timeout"
    alive.kept = dict(both)
    assert alive.look(NOW + 10.5) == NOW + 12, "that one has ended"


# -- gaps for programs that ask again --------------------------------------------------------------


def job_of(priority: Priority, requested: float = NOW, program: str = "serve", **more: Any) -> Job:
    request = more.pop("request", Read(1, 1, 1))
    return Job(request, priority, CAUTIOUS, program=program, requested=requested)


POLL = job_of(Priority.POLL)


def reads_after(line: BackToBack, *rests: float, start: float = NOW) -> float:
    """Reads of a program, each so long after the one before; returns the end of the last."""
    now, took = start, 0.25
    for rest in rests:
        line.count(job_of(Priority.OPERATOR_READ, now + rest), now + rest, now + rest + took)
        now += rest + took
    return now


@pytest.mark.parametrize(
    ("stop", "until"), [(WriteOne(1, 1, 1), 0.0), (Read(1, 1, 1), NOW + 1 + LONGEST_PAUSE)]
)
def test_line_is_free_for_the_word_after_what_a_stop_reads(stop: Any, until: float) -> None:
    line = BackToBack()
    line.count(job_of(Priority.STOP, request=Read(1, 1, 1)), NOW, NOW + 0.5)
    line.count(job_of(Priority.STOP, request=stop), NOW, NOW + 1)
    assert line.not_before(POLL) == until
    assert line.not_before(job_of(Priority.OPERATOR_READ)) == until
    assert line.not_before(job_of(Priority.FEED)) == line.not_before(job_of(Priority.STOP)) == 0.0


def test_line_is_free_for_a_share_of_the_longest_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pauses, "LONGEST_PAUSE", 0.125)
    monkeypatch.setattr(pauses, "POLLS_SHARE", 0.0)
    line = BackToBack()
    ended = reads_after(line, 0.125, 0.0625, 0.125)
    assert line.not_before(POLL) == ended + MARGIN * 0.125 + TRIP
    assert line.not_before(job_of(Priority.OPERATOR_READ)) == 0.0
    reads_after(line, 0.1875, start=ended)
    assert not line._pauses, "a longer pause"
    line.count(job_of(Priority.OPERATOR_READ, NOW, "another"), NOW, NOW)
    assert not line._pauses, "of another program"


@pytest.mark.parametrize(
    ("rests", "polled", "late", "gap"),
    [
        ((0.25,) * PAUSES, 0.0625, 0.0, GAP * 0.0625),
        ((0.25,) * PAUSES, 2.0, 0.0, LONGEST_GAP),
        ((0.25,) * PAUSES, 0.0625, 0.5, GAP * 0.0625),
        ((0.25,) * PAUSES, 0.0625, 0.5625, 0.0),
        ((0.25,) * (PAUSES - 1), 0.0625, 0.0, 0.0),
        ((0.125,) * PAUSES, 0.0625, 0.0, 0.0),
        ((REST_AT_MOST,) * PAUSES, 0.0625, 0.0, GAP * 0.0625),
        ((0.25,) * (PAUSES - 1) + (REST_AT_MOST + 0.25,), 0.0625, 0.0, 0.0),
    ],
)
def test_gap_between_polls_is_a_share_of_their_time(
    rests: tuple[float, ...], polled: float, late: float, gap: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(pauses, "LONGEST_PAUSE", 0.125)
    line = BackToBack()
    line._ended = NOW
    ended = reads_after(line, *rests)
    line._free_until = 0.0
    line.count(POLL, ended + late - polled, ended + late)
    assert line._gap_until == ended + late + gap
    background = job_of(Priority.BACKGROUND)
    line.count(background, ended, ended + late)
    assert line._polled == late
    line.count(job_of(Priority.OPERATOR_WRITE), ended, ended + 64.0)
    assert line._gap_until < ended + 64.0


@pytest.mark.parametrize(("read", "owed"), [(0.75, False), (1.0, True)])
def test_polls_get_their_share_in_addition(
    read: float, owed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pauses, "POLLS_SHARE", 0.25)
    line = BackToBack()
    line.count(POLL, NOW, NOW + 0.25)
    line._free_until, line._read = NOW + 9, read
    assert line.not_before(POLL) == (0.0 if owed else NOW + 9)


# -- bytes -----------------------------------------------------------------------------------------


class Loop:
    """The time of a loop, and its timers."""

    def __init__(self) -> None:
        self.now = NOW
        self.timers: list[Any] = []

    def time(self) -> float:
        return self.now

    def call_at(self, when: float, action: Any) -> Any:
        timer = SimpleNamespace(when=lambda: when, action=action, canceled=False)
        timer.cancel = lambda: setattr(timer, "canceled", True)
        self.timers.append(timer)
        return timer

    @property
    def waiting(self) -> list[float]:
        return [timer.when() for timer in self.timers if not timer.canceled]


def test_timer_is_put_off_without_a_new_one(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop()
    monkeypatch.setattr(
        masters, "asyncio", SimpleNamespace(get_running_loop=lambda: loop, TimerHandle=object)
    )
    rung: list[float] = []
    timer = PutOffTimer()
    timer.start(1.0, lambda: rung.append(loop.now))
    timer.start(1.0, lambda: rung.append(loop.now))
    timer.start(2.0, lambda: rung.append(loop.now))
    assert [timer.when() for timer in loop.timers] == [NOW + 1]
    loop.now = NOW + 1
    loop.timers[0].action()
    assert (rung, loop.waiting) == ([], [NOW + 1, NOW + 2])
    timer.start(0.5, lambda: rung.append(loop.now))
    assert loop.waiting == [NOW + 1, NOW + 1.5]
    loop.now = NOW + 1.5
    loop.timers[-1].action()
    assert rung == [NOW + 1.5]
    timer.start(1.0, lambda: rung.append(loop.now))
    timer.leave()
    loop.now = NOW + 2.5
    loop.timers[-1].action()
    timer.start(1.0, lambda: rung.append(loop.now))
    timer.stop()
    timer.stop()
    assert loop.timers[-1].canceled
    assert rung == [NOW + 1.5]


READ = Read(1, 5, 2)


def exchange_of(request: Any, **more: Any) -> RtuExchange:
    return RtuExchange(frame(request.device, request.pdu()), request.expectation(), **more)


def test_half_of_a_flood_is_forgotten_above_its_limit() -> None:
    exchange = exchange_of(READ)
    assert exchange.feed(b"\x55" * FLOOD) is None
    assert len(exchange.buffer) == FLOOD
    assert exchange.feed(b"\x55") is None
    assert len(exchange.buffer) == FLOOD // 2


def test_refusal_of_another_request_is_not_the_reply_however_long_the_rest() -> None:
    refusal = frame(1, bytes([0x83, 2]))
    for exceptions in (True, False):
        result = exchange_of(READ, exceptions=exceptions).feed(refusal + b"\x55" * 9)
        assert (result is not None) is exceptions


@pytest.mark.parametrize("request_", [READ, Identify(1), WriteOne(1, 5, 7)])
def test_reply_of_any_length_is_found_and_is_no_exception(request_: Any) -> None:
    whole = frame(1, honest_pdu(request_.pdu()))
    result = exchange_of(request_, echo=False).feed(whole)
    assert result is not None
    assert (result.exception, result.pdu, result.strays) == (0, whole[1:-2], [])


def test_reply_may_begin_with_the_byte_after_another_one_like_its_first() -> None:
    whole = frame(1, honest_pdu(READ.pdu()))
    for count in (1, 2, 3):
        found = find_reply(b"\x01" * count + whole, 1, READ.expectation())
        assert found is not None
        assert found.start == count


def test_whole_frame_that_refuses_nothing_is_not_a_reply() -> None:
    assert exchange_of(Identify(1)).feed(frame(1, bytes([0xAB, 1, 2]))) is None


def test_reply_alone_is_noted_once() -> None:
    whole = frame(1, honest_pdu(READ.pdu()))
    result = exchange_of(READ).feed(whole)
    assert result is not None
    assert list(noted(result, b"", 1)) == [(whole, "")]


def test_broadcast_is_as_long_as_its_echo() -> None:
    sent = frame(0, WriteOne(0, 5, 7).pdu())
    assert RtuExchange(sent, None).longest == 3
    assert RtuExchange(sent, None, echo=True).longest == len(sent) + 3
