"""Last minute of a line and its devices: what counts as lost, and for which of them."""

from __future__ import annotations

import pytest

from tests.limits import MISSES
from tui.bus.master import ExchangeResult, Piece, ResultKind
from tui.bus.model import LastMinute, Priority, Timing
from tui.bus.requests import Read
from tui.bus.schedule.outcomes import SHORT_SILENCE, Outcomes
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import Job
from tui.bus.shared_state import SharedState
from tui.bus.tally import BUCKET, BUCKETS, MinuteWindow, Tally
from tui.wire.frames import frame

from .conftest import WIDE, Share
from .peer import PtyPeer, eventually, honest, reply

MINUTE = BUCKET * BUCKETS
TIMING = Timing(retries=0)


class Ended:
    """Exchanges that end as the test says, at the time of the test."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.tally = Tally(clock=lambda: self.now)
        self.devices = Devices(TIMING, mistakable=True)
        self._outcomes = Outcomes(
            self.devices, self.tally, TIMING, lambda: self.now, SharedState(), gateway=False
        )

    def reply(self, device: int, kind: ResultKind, priority: Priority = Priority.POLL) -> None:
        """A request for register 5 ends so."""
        job = Job(Read(device, 5, 1), priority, WIDE)
        job.answer.add_done_callback(lambda done: done.exception())
        pdu = b"\x03\x02\x00\x05" if kind is ResultKind.REPLY else b""
        self._outcomes.conclude(job, ExchangeResult(kind, pdu, sent=self.now, end=self.now))

    def good(self, device: int, times: int = 1) -> None:
        """Count this many good replies."""
        for _ in range(times):
            self.reply(device, ResultKind.REPLY)

    def doubted(self, device: int) -> None:
        """A reply that is requested again, as it may be a copy of the previous one."""
        self._outcomes.count_beside(device, ExchangeResult(ResultKind.REPLY, end=self.now))

    def missed(self, device: int, times: int = 1, priority: Priority = Priority.POLL) -> None:
        """Count this many requests without a reply."""
        for _ in range(times):
            self.reply(device, ResultKind.NOTHING, priority)

    def heard(self, data: bytes) -> None:
        """A whole frame arrives that answers no current request."""
        self._outcomes.note_stray(Piece(data, whole=True), self.now)

    @property
    def line(self) -> LastMinute:
        """The line's last minute."""
        return self.tally.frozen().minute

    def of(self, device: int) -> LastMinute:
        """A device's last minute."""
        return self.tally.frozen().devices[device].minute


@pytest.fixture
def ended() -> Ended:
    return Ended()


def test_count_lasts_a_minute_in_few_buckets() -> None:
    window = MinuteWindow()
    for second in range(600):
        window.count("good", float(second))
        assert second < MINUTE or MINUTE - BUCKET < window.total(second).good <= MINUTE
    assert len(window._buckets) <= BUCKETS
    assert window.total(599.0 + MINUTE - BUCKET).good == BUCKET
    assert window.total(599.0 + MINUTE) == LastMinute()


def test_correction_does_not_make_a_count_negative() -> None:
    window = MinuteWindow()
    window.count("silent", 0.0)
    window.count("silent", MINUTE - 1, -1)
    assert window.total(MINUTE - 1).silent == 0
    assert window.total(MINUTE).silent == 0


def test_missed_reply_counts_for_the_line_once_the_drive_answers(ended: Ended) -> None:
    ended.good(1, 8)
    ended.missed(1, 2)
    assert (ended.line, ended.of(1).silent) == (LastMinute(good=8), 2)
    ended.good(1)
    assert ended.line == LastMinute(good=9, lost=2)
    assert ended.of(1) == LastMinute(good=9, lost=2)
    assert ended.line.share == pytest.approx(9 / 11)


def test_doubted_reply_does_not_count_a_miss_twice(ended: Ended) -> None:
    ended.good(1)
    ended.missed(1)
    ended.doubted(1)
    ended.good(1)
    assert ended.line == ended.of(1) == LastMinute(good=3, lost=1)


def test_damaged_and_wrong_replies_count_immediately(ended: Ended) -> None:
    ended.good(1, 2)
    ended.reply(1, ResultKind.DAMAGED)
    ended.reply(1, ResultKind.WRONG)
    assert ended.line == ended.of(1) == LastMinute(good=2, damaged=2)


def test_dead_drive_does_not_lower_the_share_of_the_line(ended: Ended) -> None:
    for device in (1, 2, 3):
        ended.good(device, 10)
    ended.missed(3, 9)
    assert ended.line == LastMinute(good=30)
    assert ended.of(3).share == 1.0
    assert ended.of(3).whole_share == pytest.approx(10 / 19)


@pytest.mark.parametrize(("silence", "lost"), [(SHORT_SILENCE - 1, MISSES), (SHORT_SILENCE + 1, 0)])
def test_misses_count_for_the_line_after_a_short_absence_only(
    ended: Ended, silence: float, lost: int
) -> None:
    ended.good(1)
    ended.missed(1, MISSES)
    ended.now += silence
    ended.good(1)
    assert ended.line == LastMinute(good=2, lost=lost)
    assert ended.of(1).silent == MISSES - lost


def test_one_missed_slow_poll_is_not_a_dead_drive(ended: Ended) -> None:
    ended.good(1)
    ended.missed(1)
    ended.now += 30.0
    ended.good(1)
    assert ended.line.lost == 1


def test_drive_that_never_answered_does_not_count_for_the_line(ended: Ended) -> None:
    ended.missed(9, 5)
    assert ended.line.share is None
    assert ended.of(9).whole_share == 0.0
    ended.good(9)
    assert ended.line == LastMinute(good=1)


def test_scan_does_not_count(ended: Ended) -> None:
    ended.missed(7, 2, Priority.BACKGROUND)
    ended.reply(7, ResultKind.DAMAGED, Priority.PATIENT)
    assert ended.of(7) == ended.line == LastMinute()
    ended.good(7)
    assert ended.line == LastMinute(good=1)


def test_frames_of_another_master_are_foreign(ended: Ended) -> None:
    ended.good(1)
    ended.heard(frame(1, bytes.fromhex("0300640002")))  # polls one of our drives
    ended.heard(frame(8, bytes.fromhex("030400010002")))  # a drive that no program here polls
    assert (ended.line.foreign, ended.line.strays) == (2, 0)
    assert 8 not in ended.tally.devices


def test_second_replies_are_strays_and_late_ones_are_lost_replies(ended: Ended) -> None:
    ended.good(1)
    ended.heard(frame(1, b"\x03\x02\x00\x06"))
    ended.heard(frame(1, bytes.fromhex("030400010002")))
    assert (ended.line.foreign, ended.line.strays, ended.of(1).strays) == (0, 2, 2)
    ended.now += 10.0
    ended.missed(1)
    ended.heard(frame(1, b"\x03\x02\x00\x05"))
    ended.good(1)
    assert (ended.line.lost, ended.line.strays) == (1, 2)


async def test_all_programs_on_a_line_have_the_same_minute(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        await owner.read(1, 100)
        await other.read(1, 100)
        eventually(lambda: other.counters.minute.good == 2)
        assert other.counters.minute == owner.counters.minute
        assert other.counters.devices[1].minute == owner.counters.devices[1].minute


async def test_repeated_reply_counts_as_a_stray(share: Share) -> None:
    with PtyPeer(lambda request, _: [reply(request), 0.05, reply(request)]) as peer:
        line = share(peer.path).open("panel")
        await line.read(1, 100)
        eventually(lambda: line.counters.minute.strays == 1)
        assert line.counters.minute.share == 1.0


def test_next_owner_continues_the_counts() -> None:
    heir = MinuteWindow(LastMinute(good=7, lost=2))
    assert heir.total(5.0).lost == 2
    heir.count("good", 6.0)
    assert heir.total(6.0) == LastMinute(good=1)
