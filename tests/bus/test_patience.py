"""The knowledge of a line about each device, to the boundary: its patience and late replies."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from tui.bus.master import Piece
from tui.bus.model import Priority, Timing
from tui.bus.requests import Read, WriteMany, WriteOne
from tui.bus.schedule.device_record import (
    TURNAROUNDS_KEPT,
    Device,
    Guess,
    Outstanding,
    judge_guess,
    known_before,
    note_turnaround,
)
from tui.bus.schedule.patience import (
    LONG_MEMORY,
    SHORT_MEMORY,
    SHORT_WAIT,
    Devices,
    pause,
)
from tui.wire.frames import frame

TIMING = Timing(
    first_timeout=1.0, min_timeout=0.125, scan_timeout=0.25, patient_timeout=0.5, late_reply=2.0,
    back_off_first=1.0, back_off_longest=16.0,
)  # fmt: skip
READ = Read(1, 100, 1)
ONE, TWO = READ.expectation(), Read(1, 100, 2).expectation()
REPLY = bytes([3, 2, 0, 7])


def devices(*, mistakable: bool = True) -> Devices:
    return Devices(TIMING, mistakable=mistakable)


def answering(turnaround: float = 0.0625, *, mistakable: bool = True) -> Devices:
    """Devices of which device 1 has answered once, at 10 s."""
    made = devices(mistakable=mistakable)
    made.answered(1, ONE, turnaround, 10.0, (READ.pdu(), REPLY))
    return made


def piece(pdu: bytes, device: int = 1) -> Piece:
    return Piece(frame(device, pdu), whole=True)


# -- how long --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("within", "seconds"), [(0.07, 0.07), (0.0, 0.0), (5.0, 1.0), (-1.0, 1.0), (None, 1.0)]
)
def test_own_timeout_of_a_request_is_used_up_to_the_first_one(
    within: float | None, seconds: float
) -> None:
    assert devices().time_out(1, 3, Priority.STOP, within) == seconds


@pytest.mark.parametrize(
    ("priority", "unknown", "known"),
    [
        (Priority.STOP, 1.0, 0.25), (Priority.POLL, 1.0, 0.25),
        (Priority.BACKGROUND, 0.25, 0.25), (Priority.PATIENT, 0.5, 0.25),
    ],
)  # fmt: skip
def test_device_that_never_answered_has_the_time_of_a_search(
    priority: Priority, unknown: float, known: float
) -> None:
    assert devices().time_out(1, 3, priority) == unknown
    assert answering().time_out(1, 3, priority) == known
    assert answering().time_out(1, 6, priority) == 1.0, "of each function its own"
    short = Devices(
        Timing(first_timeout=0.2, scan_timeout=5.0, patient_timeout=5.0), mistakable=True
    )
    assert short.time_out(1, 3, priority) == 0.2


@pytest.mark.parametrize(
    ("failures", "factor"), [(0, 1), (2, 1), (3, 2), (4, 4), (5, 8), (6, 16), (99, 256)]
)
def test_timeout_of_a_silent_device_is_doubled_from_its_third_miss_on(
    failures: int, factor: int
) -> None:
    made = answering()
    made[1].failures = failures
    assert made.time_out(1, 3, Priority.POLL) == min(1.0, 0.25 * factor)
    made[1].recent[3].clear()
    made[1].recent[3].append(0.001)
    assert made.time_out(1, 3, Priority.POLL) == min(1.0, 0.125 * factor)


def test_doubling_of_a_timeout_is_limited() -> None:
    patient = Devices(Timing(first_timeout=1e9, min_timeout=0.125), mistakable=True)
    patient.answered(1, ONE, 0.0, 10.0)
    patient[1].failures = 1000
    assert patient.time_out(1, 3, Priority.POLL) == 0.125 * 2**8


@pytest.mark.parametrize(
    ("failures", "seconds"),
    [(-1, 0.0), (0, 0.0), (1, 1.0), (2, 2.0), (3, 4.0), (5, 16.0), (6, 16.0)],
)
def test_pause_is_doubled_with_each_failure_up_to_the_longest(
    failures: int, seconds: float
) -> None:
    assert pause(failures, 1.0, 16.0) == seconds


def test_pause_after_a_night_of_failures_is_a_number() -> None:
    assert pause(100_000, 1.0, math.inf) == 2.0**30
    assert pause(31, 1.0, math.inf) == 2.0**30


# -- silence ---------------------------------------------------------------------------------------


def test_known_device_pauses_from_its_third_miss_on_for_as_long_as_with_a_pause_each() -> None:
    made = answering()
    tries = []
    for miss in range(1, 6):
        made.silent(1, ONE, 20.0 + miss, 21.0 + miss)
        tries.append(made[1].next_try)
    assert tries == [None, None, 24.0 + 1.0, 25.0 + 2.0 + 4.0 + 8.0, 26.0 + 16.0]
    assert (made[1].answers, made[1].failures, made[1].silent_since) == (False, 5, 22.0)
    made.answered(1, ONE, 0.05, 50.0)
    found = made[1]
    assert (found.answers, found.failures, found.silent_since, found.next_try) == (
        True, 0, None, None,
    )  # fmt: skip


def test_device_that_never_answered_pauses_from_its_first_miss_on() -> None:
    made = devices()
    tries = []
    for miss in range(1, 4):
        made.silent(1, ONE, 20.0, 20.0)
        tries.append(made[1].next_try)
        assert made[1].failures == miss
    assert tries == [21.0, 22.0, 24.0]
    assert made[1].ever_answered is False


@pytest.mark.parametrize(
    ("priority", "within", "now", "ever", "seconds"),
    [
        (Priority.POLL, None, 29.0, True, 1.0), (Priority.POLL, None, 30.0, True, None),
        (Priority.POLL, 0.1, 29.0, True, None), (Priority.POLL, 0.0, 29.0, True, None),
        (Priority.OPERATOR_READ, None, 29.0, True, None), (Priority.STOP, None, 29.0, True, None),
        (Priority.BACKGROUND, None, 29.0, True, 1.0),
        (Priority.BACKGROUND, None, 29.0, False, None),
        (Priority.PATIENT, None, 29.0, False, None), (Priority.POLL, None, 29.0, False, 1.0),
    ],
)  # fmt: skip
def test_silent_device_is_polled_again_at_its_time_and_read_on_request(
    priority: Priority, within: float | None, now: float, ever: bool, seconds: float | None
) -> None:
    made = devices()
    made[1].next_try, made[1].ever_answered = 30.0, ever
    assert made.backed_off(1, priority, now, within) == seconds
    assert made.backed_off(2, priority, now, within) is None


# -- late replies ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sent", "lateness", "expires", "quiet"),
    [
        (20.0, 0.0, 22.0, 0.0), (15.0, 0.0, 21.0, 0.0), (15.0, 0.1, 21.0, 20.2),
        (15.0, 3.0, 26.0, 20.3), (15.0, 60.0, 30.0, 20.3),
    ],
)  # fmt: skip
def test_reply_may_come_for_the_longest_of_three_times(
    sent: float, lateness: float, expires: float, quiet: float
) -> None:
    made = devices()
    made[1].lateness = lateness
    made.may_come(1, ONE, sent, 20.0, b"pdu")
    assert made[1].outstanding == [Outstanding(ONE, sent, 20.0, expires, pdu=b"pdu")]
    assert made.quiet_until == pytest.approx(quiet)
    sure = devices(mistakable=False)
    sure[1].lateness = lateness
    sure.may_come(1, ONE, sent, 20.0)
    assert (sure[1].outstanding, sure.quiet_until) == ([], 0.0)


@pytest.mark.parametrize(
    ("priority", "expectation", "repeated", "due"),
    [
        (Priority.STOP, ONE, (b"", None), 0.0), (Priority.FEED, ONE, (b"", None), 0.0),
        (Priority.OPERATOR_READ, ONE, (b"", None), 22.0), (Priority.POLL, TWO, (b"", None), 20.5),
        (Priority.POLL, ONE, (b"pdu", 20.0), 20.5), (Priority.POLL, ONE, (b"pdu", 20.1), 22.0),
        (Priority.POLL, ONE, (b"other", 20.0), 22.0), (Priority.POLL, ONE, (b"", 20.0), 22.0),
        (Priority.POLL, None, (b"", None), 20.5),
    ],
)  # fmt: skip
def test_like_request_waits_for_a_reply_that_could_be_taken_for_its_own(
    priority: Priority, expectation: Any, repeated: tuple[bytes, float | None], due: float
) -> None:
    made = devices()
    made.may_come(1, ONE, 20.0, 20.0, b"pdu")
    made.quiet_until = 20.5
    assert made.not_before(1, expectation, priority, 21.0, repeated) == due
    assert made.not_before(2, expectation, Priority.POLL, 21.0) == 20.5
    assert made.not_before(1, ONE, Priority.POLL, 21.99) == 22.0
    assert made.not_before(1, ONE, Priority.POLL, 22.0) == 20.5, "it has expired"
    assert made[1].outstanding == []


def test_refusal_is_sure_if_no_reply_of_its_function_may_come() -> None:
    write, many = WriteOne(1, 1, 7).expectation(), WriteMany(1, 1, (7, 8)).expectation()
    made = devices()
    assert made.doubts(1, ONE, 20.0) == (True, 0)
    for expectation in (ONE, ONE, TWO, write, many):
        made.may_come(1, expectation, 20.0, 20.0, b"pdu")
    assert made.doubts(1, ONE, 21.0) == (False, 2)
    assert made.doubts(1, TWO, 21.0) == (False, 1)
    assert made.doubts(1, write, 21.0) == (False, 0), "it repeats all of its request"
    assert made.doubts(1, many, 21.0) == (False, 1), "it says nothing of the values"
    assert made.doubts(1, ONE, 21.0, (b"pdu", 20.0)) == (True, 0)
    assert made.doubts(1, ONE, 22.0) == (True, 0)


def test_last_reply_is_that_of_a_device_that_has_ever_answered() -> None:
    made = answering()
    assert made.last_reply_by(20.0) == 20.0
    made.may_come(2, ONE, 25.0, 25.0)
    assert made.last_reply_by(20.0) == 20.0
    made.may_come(1, ONE, 20.0, 20.0)
    made.may_come(1, TWO, 20.5, 20.5)
    assert made.last_reply_by(20.0) == 22.5
    assert made.last_reply_by(30.0) == 30.0


def test_stray_frame_is_a_late_reply_or_a_copy_or_unknown() -> None:
    made = answering()
    assert made.stray(piece(REPLY, device=9), 11.0) == ""
    assert made.stray(piece(bytes([6, 0, 1, 0, 7])), 11.0) == ""
    made.may_come(1, TWO, 20.0, 20.5)
    assert made.stray(piece(bytes([3, 4, 0, 7, 0, 8])), 20.75) == "late"
    found = made[1]
    assert (found.lateness, found.last, found.last_time) == (0.25, TWO, 20.75)
    assert list(found.recent[3]) == [0.0625, 0.75]
    assert found.outstanding == []
    assert found.answers
    made.may_come(1, ONE, 30.0, 30.0)
    assert made.stray(piece(bytes([0x83, 2])), 30.125) == "late", "a late refusal"
    assert found.lateness == 0.25, "the longest one"


def test_reply_that_came_twice_holds_like_requests_back_for_a_while() -> None:
    made = answering()
    assert made.stray(piece(REPLY), 10.25) == "copy"
    found = made[1]
    assert (found.settle, found.repeated) == (0.5, 10.25)
    assert made._settle == 0.0, "a slow copy is of one device"
    assert found.outstanding == [Outstanding(ONE, 10.0, 10.25, 10.75, copy=True)]
    assert made.stray(piece(REPLY), 10.75) == "copy", "until its time, and a third one is like it"
    assert found.settle == 1.5
    made.answered(1, ONE, 0.05, 11.0)
    assert found.outstanding[-1] == Outstanding(ONE, 11.0, 11.0, 12.5, copy=True)
    assert made.stray(piece(REPLY), 1000.0) == "copy"
    assert found.settle == 2.0, "at most as long as a late reply"


def test_line_that_repeats_frames_quickly_holds_every_device_back() -> None:
    made = answering()
    made.stray(piece(REPLY), 10.0 + SHORT_WAIT / 4)
    assert made._settle == pytest.approx(SHORT_WAIT / 2)
    made.answered(2, ONE, 0.05, 11.0)
    assert made[2].outstanding[-1].expires == pytest.approx(11.0 + SHORT_WAIT / 2)
    assert made.state(2).copies_within == made._settle
    sure = devices(mistakable=False)
    sure._settle = 0.0625
    sure.answered(2, ONE, 0.05, 1.0)
    assert sure[2].outstanding == []


@pytest.mark.parametrize(
    ("since", "own", "whole"),
    [
        (SHORT_MEMORY, 0.5, 0.0625), (SHORT_MEMORY + 0.5, SHORT_WAIT, 0.0625),
        (LONG_MEMORY, SHORT_WAIT, 0.0625), (LONG_MEMORY + 0.5, 0.0, 0.0),
    ],
)  # fmt: skip
def test_wait_after_a_repeated_reply_is_forgotten_after_its_time(
    since: float, own: float, whole: float
) -> None:
    made = devices()
    made[1].settle, made[1].repeated = 0.5, 10.0
    made._settle, made._repeated = 0.0625, 10.0
    assert made._settle_of(made[1], 10.0 + since) == max(own, whole)
    assert (made[1].settle, made._settle) == (own, whole)


# -- copies ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("turnaround", "repeat"),
    [(0.03125, False), (0.03, True), (0.0625, False), (0.127, False), (0.128, True)],
)
def test_equal_reply_to_another_request_is_a_copy_at_an_unusual_time(
    turnaround: float, repeat: bool
) -> None:
    made = answering()
    other = Read(1, 200, 1).pdu()
    assert not made.is_repeat(1, other, REPLY, turnaround), "too little is known"
    for _ in range(2):
        made.answered(1, ONE, 0.0625, 10.0, (READ.pdu(), REPLY))
    assert not made.is_repeat(1, other, REPLY, turnaround)
    made.answered(1, ONE, 0.0625, 10.0, (READ.pdu(), REPLY))
    assert made.is_repeat(1, other, REPLY, turnaround) is repeat
    assert not made.is_repeat(1, READ.pdu(), REPLY, turnaround), "the same was asked"
    assert not made.is_repeat(1, other, bytes([3, 2, 0, 8]), turnaround)
    assert not made.is_repeat(1, WriteOne(1, 200, 7).pdu(), REPLY, turnaround)
    assert not made.is_repeat(2, other, REPLY, turnaround)
    made._mistakable = False
    assert not made.is_repeat(1, other, REPLY, turnaround)


def test_each_timely_reply_makes_late_ones_less_expected() -> None:
    made = devices()
    made[1].lateness = 1.0
    made.answered(1, ONE, 0.05, 10.0, refused=True)
    found = made[1]
    assert (found.lateness, found.heard, found.refused, found.last, found.last_time) == (
        0.99, 10.0, True, ONE, 10.0,
    )  # fmt: skip
    assert made.state(1).answers
    assert found.ever_answered
    assert made.known == (1,)


def test_state_of_a_device_is_taken_over_from_the_owner_of_the_line() -> None:
    owner = answering()
    owner.stray(piece(REPLY), 10.0 + SHORT_WAIT / 4)
    owner[1].lateness = 0.25
    for miss in range(3):
        owner.silent(1, TWO, 20.0 + miss, 20.5 + miss)
    here = devices()
    here.copy(1, owner.state(1))
    assert here.state(1) == owner.state(1)
    assert here._settle == pytest.approx(SHORT_WAIT / 2)
    assert here._repeated == here[1].repeated == 10.0
    for within in (0.0, SHORT_WAIT, 0.5):  # one device's own
        slow = devices()
        slow.copy(1, replace(owner.state(1), copies_within=within))
        assert (slow._settle, slow._repeated) == (0.0, 0.0)
        assert slow[1].settle == within


def test_usual_turnaround_is_the_median_of_reads() -> None:
    made = devices()
    assert made.state(1).usual_turnaround is None
    assert made.state(1).turnaround is None
    for turnaround in (0.25, 0.125, 1.0):
        made.answered(1, ONE, turnaround, 10.0)
    write = WriteOne(1, 1, 7).expectation()
    made.answered(1, write, 0.5, 11.0)
    found = made.state(1)
    assert (found.usual_turnaround, found.turnaround) == (0.25, 0.5)
    copied = devices()
    copied.copy(1, found)
    assert copied.state(1).usual_turnaround == 0.25


def test_device_is_timed_by_its_last_turnarounds() -> None:
    record = Device()
    for turnaround in (4.0, *([0.5] * TURNAROUNDS_KEPT)):
        note_turnaround(record, READ.function, turnaround)
    assert record.turnaround == 0.5
    assert len(record.recent[READ.function]) == TURNAROUNDS_KEPT


def test_only_a_reply_that_never_came_is_remembered_as_missed() -> None:
    made = devices()
    over, due = (Outstanding(ONE, 10.0, 10.5, expires) for expires in (12.0, 12.5))
    made[1].outstanding = [over, replace(over, copy=True), due]
    made.doubts(1, TWO, 12.0)
    assert made[1].outstanding == [due]
    assert list(made[1].missed) == [over]


def test_guess_keeps_each_fact_that_it_may_restore() -> None:
    record = Device(lateness=1.0, settle=2.0, repeated=3.0)
    record.outstanding = [Outstanding(ONE, 10.0, 10.5, 12.0)]
    guess = known_before(record, 11.0)
    assert guess == Guess(11.0, tuple(record.outstanding), 1.0, 2.0, 3.0)


def test_guess_was_right_if_only_copies_or_other_replies_may_come() -> None:
    """Neither is the reply to the request of the guess."""
    own = Outstanding(ONE, 11.0, 11.5, 14.0)
    for late in (replace(own, copy=True), replace(own, sent=10.5)):
        record = Device(lateness=1.0, outstanding=[late])
        record.guess = Guess(11.0, (), 0.0, 0.0, 0.0)
        judge_guess(record, 12.0, 12.5)
        assert (record.lateness, record.outstanding) == (1.0, [late])


# -- a frame that was taken for an earlier reply ---------------------------------------------------


def doubted() -> Devices:
    """Reply to a request of 10 s is late; that of 11 s was taken for it, and has none itself."""
    made = answering()
    made.silent(1, ONE, 10.5, 10.75, READ.pdu())
    before = known_before(made[1], 11.0)
    assert made.stray(piece(REPLY), 11.125) == "late"
    made[1].guess = before
    made.silent(1, ONE, 11.0, 11.25, READ.pdu())
    assert made[1].lateness == 0.375
    return made


def due(made: Devices) -> list[float]:
    return [late.sent for late in made[1].outstanding]


def test_frame_was_the_reply_if_none_comes_before_that_of_a_later_request() -> None:
    made = doubted()
    judge_guess(made[1], 11.0, 11.5)  # that of the request itself shows nothing
    assert due(made) == [11.0]
    judge_guess(made[1], 11.375, 11.5)
    assert due(made) == [10.5], "the first one may still come, for as long as before"
    assert made[1].outstanding[0].expires == 12.5
    assert made[1].lateness == 0.0
    made[1].lateness = 1.0
    judge_guess(made[1], 11.875, 12.0)
    assert made[1].lateness == 1.0, "a guess is judged once"


def test_earlier_reply_that_would_be_over_is_not_awaited_again() -> None:
    made = doubted()
    judge_guess(made[1], 12.25, 12.5)
    assert due(made) == []


def test_guess_was_right_if_the_own_reply_comes_too() -> None:
    made = doubted()
    assert made.stray(piece(REPLY), 11.3) == "late"
    judge_guess(made[1], 11.375, 11.5)
    assert due(made) == []
    assert made[1].lateness == 0.375


def test_frame_taken_for_a_copy_teaches_no_wait_if_it_was_the_reply() -> None:
    made = answering()
    before = known_before(made[1], 11.0)
    assert made.stray(piece(REPLY), 11.125) == "copy"
    assert made[1].settle == 2.0
    made[1].guess = before
    made.silent(1, ONE, 11.0, 11.25, READ.pdu())
    judge_guess(made[1], 11.375, 11.5)
    assert (made[1].settle, made[1].repeated, due(made)) == (0.0, 0.0, [])


@pytest.mark.parametrize(("after", "kind"), [(29.5, "late"), (30.0, "copy")])
def test_reply_of_a_frozen_drive_is_no_copy(after: float, kind: str) -> None:
    made = answering()
    made.silent(1, ONE, 10.5, 10.75, READ.pdu())
    over = made[1].outstanding[0].expires
    made.doubts(1, TWO, over)  # what is over is put aside
    assert made.stray(piece(REPLY), over + after) == kind
    assert made[1].lateness == 0.0
    assert (made[1].settle == 0.0) is (kind == "late")
