"""A program that asks again as soon as it has its answer finds the line free."""

from __future__ import annotations

from random import Random
from statistics import fmean

import pytest

from tui.bus.limits import CAUTIOUS
from tui.bus.model import Priority
from tui.bus.requests import Read, WriteOne
from tui.bus.schedule.back_to_back import LONGEST_PAUSE, POLLS_SHARE, BackToBack
from tui.bus.schedule.queue import Job, JobQueue

EXCHANGE = 0.026


class Bench:
    """A queue and a line on which each exchange takes as long."""

    def __init__(self, *, polls: bool = False) -> None:
        self.polls = polls
        self.queue = JobQueue(100)
        self.line = BackToBack()
        self.now = 0.0
        self.sent: list[tuple[str, float]] = []
        if polls:
            self.come("panel", Priority.POLL)

    def come(self, program: str, priority: Priority, at: float = 0.0) -> None:
        self.queue.put(Job(Read(1, 1, 1), priority, CAUTIOUS, program=program, requested=at))

    def work(self) -> float | None:
        """Send a due request; if none is due, return the time of the next."""
        job, ready = self.queue.take(self.line.not_before, self.now)
        if job is None:
            return ready
        begun, self.now = self.now, self.now + EXCHANGE
        self.line.count(job, begun, self.now)
        self.sent.append((job.program, begun))
        if self.polls and job.program == "panel":
            self.come("panel", Priority.POLL)
        return None

    def client(self, times: int, pause: float) -> None:
        """A client asks as often, each time so long after its answer."""
        for _ in range(times):
            at = self.now + pause
            self.wait(pause)
            self.come("serve", Priority.OPERATOR_READ, at)
            count = self.served
            while self.served == count:
                assert self.work() is None

    def wait(self, pause: float) -> None:
        """Advance the time, in which a poll may be sent."""
        end = self.now + pause
        while self.now < end:
            waiting = len(self.sent)
            ready = self.work()
            if len(self.sent) == waiting:
                self.now = end if ready is None else min(end, max(ready, self.now + 0.0001))

    @property
    def served(self) -> int:
        return sum(program == "serve" for program, _ in self.sent)


def test_back_to_back_client_leaves_polls_only_their_share() -> None:
    for pause in (0.002, 0.012):
        bench = Bench(polls=True)
        bench.client(500, pause)
        polls = len(bench.sent) - bench.served
        share = polls / len(bench.sent)
        assert POLLS_SHARE * 0.9 < share < POLLS_SHARE * 1.2
        assert bench.now / 500 < 1.3 * EXCHANGE + pause


def test_polls_are_sent_while_client_pauses() -> None:
    bench = Bench(polls=True)
    bench.client(50, 0.1)
    assert len(bench.sent) - bench.served > 2 * bench.served


@pytest.mark.parametrize("longest", [0.1, 0.4, 1.5])
def test_read_after_random_pause_takes_at_most_1_3_times_its_time(
    longest: float,
) -> None:
    bench, chance, times = Bench(polls=True), Random(1), []
    for _ in range(600):
        pause = chance.uniform(0.0, longest)
        begun = bench.now + pause
        bench.client(1, pause)
        times.append(bench.now - begun)
    polls = len(bench.sent) - bench.served
    assert fmean(times) < 1.3 * EXCHANGE
    assert polls * EXCHANGE > 2 * POLLS_SHARE * bench.now


def test_polls_use_the_whole_line_after_client_has_left() -> None:
    bench = Bench(polls=True)
    bench.client(10, 0.2)
    bench.wait(0.5)
    before, begun = len(bench.sent), bench.now
    bench.wait(1.0)
    assert (len(bench.sent) - before) * EXCHANGE > 0.95 * (bench.now - begun)


def test_few_reads_by_a_person_do_not_limit_polls() -> None:
    bench = Bench(polls=True)
    bench.client(2, 0.2)
    before, begun = len(bench.sent), bench.now
    bench.wait(1.0)
    assert (len(bench.sent) - before) * EXCHANGE > 0.9 * (bench.now - begun)


def test_poll_waits_only_briefly_after_client_has_left() -> None:
    bench = Bench()
    bench.come("panel", Priority.POLL)
    bench.work()
    bench.client(5, 0.002)
    bench.come("panel", Priority.POLL)
    left = bench.now
    while (ready := bench.work()) is not None:
        bench.now = ready
    assert 0.0 < bench.sent[-1][1] - left < 0.01


def test_commands_and_reads_of_other_clients_do_not_wait() -> None:
    for priority in (Priority.FEED, Priority.OPERATOR_WRITE, Priority.OPERATOR_READ):
        bench = Bench()
        bench.client(5, 0.002)
        bench.come("panel", priority)
        assert bench.work() is None


def test_no_request_is_sent_between_a_stop_and_the_read_before_it() -> None:
    bench = Bench()
    bench.come("serve", Priority.STOP)
    for priority in (Priority.OPERATOR_WRITE, Priority.OPERATOR_READ, Priority.POLL):
        bench.come("panel", priority)
    assert bench.work() is None
    assert bench.work() == bench.now + LONGEST_PAUSE
    bench.come("serve", Priority.STOP)
    assert bench.work() is None
    assert [program for program, _ in bench.sent] == ["serve", "serve"]


# -- each limit ------------------------------------------------------------------------------------


def due(line: BackToBack, priority: Priority = Priority.POLL) -> float:
    return line.not_before(Job(Read(1, 1, 1), priority, CAUTIOUS))


def read(line: BackToBack, pause: float, program: str = "serve", takes: float = 0.0) -> float:
    """A read of a program so long after the last one; returns when it is over."""
    requested = line._ended + pause
    job = Job(Read(1, 1, 1), Priority.OPERATOR_READ, CAUTIOUS, program=program, requested=requested)
    line.count(job, requested, requested + takes)
    return requested + takes


def polled(line: BackToBack, begun: float, seconds: float) -> None:
    line.count(Job(Read(1, 1, 1), Priority.POLL, CAUTIOUS), begun, begun + seconds)


def test_line_is_kept_free_for_the_longest_pause_of_a_program() -> None:
    line = BackToBack()
    polled(line, 99.0, 1.0)
    line._ended = 100.0
    read(line, 0.01)
    assert due(line) == line._ended, "one read is no series"
    ended = read(line, 0.02)
    assert due(line) == pytest.approx(ended + 1.25 * 0.02 + 0.003)
    ended = read(line, 0.004)
    assert due(line) == pytest.approx(ended + 1.25 * 0.02 + 0.003), "the longest of the last ones"
    for priority in (Priority.STOP, Priority.FEED, Priority.OPERATOR_WRITE, Priority.OPERATOR_READ):
        assert due(line, priority) == 0.0, priority
    assert due(line, Priority.BACKGROUND) == due(line)
    ended = read(line, 0.021)
    assert line._free_until == ended, "it paused"
    ended = read(line, 0.01)
    assert line._free_until == pytest.approx(ended + 1.25 * 0.01 + 0.003)
    ended = read(line, 0.01, "another")
    assert line._free_until == ended


def test_only_the_last_four_pauses_count_and_an_early_request_has_none() -> None:
    line = BackToBack()
    polled(line, 99.0, 1.0)
    line._ended = 100.0
    for pause in (0.02, 0.02, 0.004, 0.004, 0.004):
        ended = read(line, pause)
    assert due(line) == pytest.approx(ended + 1.25 * 0.02 + 0.003)
    ended = read(line, 0.004)
    assert due(line) == pytest.approx(ended + 1.25 * 0.004 + 0.003)
    for _ in range(4):
        ended = read(line, -0.01)
    assert due(line) == pytest.approx(ended + 0.003)


@pytest.mark.parametrize(("takes", "owed"), [(0.05, False), (0.06, True)])
def test_poll_goes_first_once_reads_have_had_their_share(takes: float, owed: bool) -> None:
    line = BackToBack()
    line._ended = 100.0
    polled(line, 99.0, 0.02)
    for _ in range(2):
        ended = read(line, 0.01, takes=takes)
    assert line._read == pytest.approx(2 * takes)
    assert (due(line) == 0.0) == owed  # 0.15 of 0.113 s reads and 0.02 s poll
    if not owed:
        assert due(line) > ended
    polled(line, ended, 0.02)
    assert line._read == 0.0


def test_stop_word_finds_the_line_free_after_what_is_read_for_it() -> None:
    line = BackToBack()
    line.count(Job(Read(1, 1, 1), Priority.STOP, CAUTIOUS), 99.0, 100.0)
    assert due(line, Priority.OPERATOR_READ) == 100.0 + LONGEST_PAUSE
    assert due(line, Priority.FEED) == 0.0
    line.count(Job(WriteOne(1, 1, 1), Priority.STOP, CAUTIOUS), 100.0, 100.1)
    assert due(line, Priority.OPERATOR_READ) == 0.0


@pytest.mark.parametrize(
    ("pauses", "poll", "gap"),
    [
        ([0.5] * 4, 0.05, 0.0425), ([0.5] * 4, 0.5, 0.1), ([0.5] * 3, 0.05, 0.0),
        ([0.02] * 4, 0.05, 0.0), ([0.5] * 4 + [2.1], 0.05, 0.0), ([0.5] * 3 + [2.0], 0.05, 0.0425),
    ],
)  # fmt: skip
def test_gap_between_polls_is_left_to_a_program_that_asks_again_and_again(
    pauses: list[float], poll: float, gap: float
) -> None:
    line = BackToBack()
    line._ended = 100.0
    for pause in pauses:
        ended = read(line, pause)
    polled(line, ended, poll)
    assert line._gap_until == pytest.approx(ended + poll + gap)
    longest = max(pauses)
    polled(line, ended + 2 * longest, 0.001)
    assert line._gap_until == pytest.approx(ended + 2 * longest + 0.001), "it has left"
