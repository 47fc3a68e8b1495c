"""Order of requests, back-off, timeouts and late replies; with a clock of the test's own."""

from __future__ import annotations

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineBusy, LineClosed, Superseded
from tui.bus.line import Timing
from tui.bus.master import Piece
from tui.bus.program_use import ProgramUse
from tui.bus.requests import Read, Request, WriteMany, WriteOne
from tui.bus.schedule.patience import LONG_MEMORY, SHORT_MEMORY, SHORT_WAIT, Devices, pause
from tui.bus.schedule.queue import Job, JobQueue, LineShares, SentStops
from tui.bus.schedule.unsent import is_stop_word
from tui.bus.trace import Trace
from tui.wire.frames import frame

from .conftest import WIDE
from .peer import honest_pdu


def job(priority: Priority, address: int = 0) -> Job:
    return Job(Read(1, address, 1), priority, WIDE)


def now(_job: Job) -> float:
    return 0.0


def test_jobs_are_taken_by_priority_then_age() -> None:
    queue = JobQueue(20)
    jobs = [
        job(priority) for priority in (4, 3, 3, 2, 1, 0, 2) for priority in [Priority(priority)]
    ]
    for each in jobs:
        queue.put(each)
    taken = [queue.take(now, 0.0)[0] for _ in jobs]
    assert [jobs.index(each) for each in taken if each] == [5, 4, 3, 6, 1, 2, 0]
    assert queue.take(now, 0.0) == (None, None)


@pytest.mark.parametrize(("between", "first"), [(0x000F, True), (None, False)])
def test_stop_after_another_command_counts_as_a_first_stop(
    between: int | None, first: bool
) -> None:
    queue = JobQueue(20)

    def send(item: Job) -> None:
        queue.put(item)
        assert queue.take(now, 0.0)[0] is item
        queue.count(item, 0.0, 0.1, acknowledged=True)

    send(stop_job(1))
    if between is not None:
        send(Job(WriteOne(1, 8501, between), Priority.OPERATOR_WRITE, WIDE))
    send(stop_job(2))
    stop, feed = stop_job(1), job(Priority.FEED)
    queue.put(feed)
    queue.put(stop)
    assert queue.take(now, 0.2)[0] is (stop if first else feed)


def stop_job(device: int) -> Job:
    return Job(WriteOne(device, 8501, 0x0007), Priority.STOP, WIDE)


def test_job_that_is_not_ready_is_skipped() -> None:
    queue = JobQueue(20)
    first, second = job(Priority.STOP, 1), job(Priority.POLL, 2)
    queue.put(first)
    queue.put(second)
    ready = {first: 5.0, second: 3.0}
    assert queue.take(ready.__getitem__, 1.0) == (None, 3.0)
    assert queue.take(ready.__getitem__, 4.0) == (second, None)
    assert queue.take(ready.__getitem__, 4.0) == (None, 5.0)
    assert queue.take(ready.__getitem__, 5.0) == (first, None)


def test_repeated_job_keeps_its_place() -> None:
    queue = JobQueue(20)
    first, second = job(Priority.POLL), job(Priority.POLL)
    queue.put(first)
    queue.put(second)
    assert queue.take(now, 0.0)[0] is first
    queue.put_back(first)
    assert queue.take(now, 0.0)[0] is first


def test_withdrawn_jobs_are_dropped() -> None:
    queue = JobQueue(20)
    gone = job(Priority.POLL)
    queue.put(gone)
    assert gone.answer.cancel()
    assert queue.take(now, 0.0) == (None, None)
    gone.fail(LineClosed())
    assert gone.answer.cancelled()


def test_queue_is_bounded() -> None:
    queue = JobQueue(4)
    for _ in range(2):
        queue.put(job(Priority.POLL))
    with pytest.raises(LineBusy):
        queue.put(job(Priority.BACKGROUND))
    for _ in range(2):
        queue.put(job(Priority.OPERATOR_READ))
    with pytest.raises(LineBusy):
        queue.put(job(Priority.OPERATOR_WRITE))
    queue.put(job(Priority.STOP))
    assert len(queue) == 5
    assert len(queue.drain()) == 5
    assert len(queue) == 0


def test_back_off_doubles_to_its_cap() -> None:
    assert [pause(failures, 1.0, 10.0) for failures in range(7)] == [0, 1, 2, 4, 8, 10, 10]
    assert pause(100_000, 1.0, 10.0) == 10.0


TIMING = Timing(first_timeout=1.0, min_timeout=0.1, late_reply=2.0, scan_timeout=0.3)
READ = Read(1, 5, 1)
EXPECTED = READ.expectation()
LATE = Piece(frame(1, honest_pdu(READ.pdu())), whole=True)


@pytest.fixture
def devices() -> Devices:
    return Devices(TIMING, mistakable=True)


def test_timeout_follows_the_turnaround(devices: Devices) -> None:
    poll = Priority.POLL
    assert devices.time_out(1, 3, poll) == 1.0
    devices.answered(1, EXPECTED, 0.05, 10.0)
    assert devices.time_out(1, 3, poll) == pytest.approx(0.2)
    assert devices.time_out(1, 6, poll) == 1.0
    devices.answered(1, EXPECTED, 0.001, 10.0)
    assert devices.time_out(1, 3, poll) == pytest.approx(0.2)
    for _ in range(20):
        devices.answered(1, EXPECTED, 0.001, 10.0)
    assert devices.time_out(1, 3, poll) == pytest.approx(0.1)
    devices.answered(1, EXPECTED, 0.9, 10.0)
    assert devices.time_out(1, 3, poll) == 1.0
    assert devices.state(1).turnaround == 0.9


def test_timeout_grows_with_failures(devices: Devices) -> None:
    devices.answered(1, EXPECTED, 0.01, 10.0)
    outs = []
    for _ in range(5):
        outs.append(devices.time_out(1, 3, Priority.POLL))
        devices.silent(1, EXPECTED, 10.0, 11.0)
    assert outs == pytest.approx([0.1, 0.1, 0.1, 0.2, 0.4])


def test_known_drive_is_polled_without_a_pause_until_three_misses(
    devices: Devices,
) -> None:
    devices.silent(2, EXPECTED, 10.0, 10.1)
    assert devices.backed_off(2, Priority.POLL, 10.1) == pytest.approx(1.0)
    devices.answered(1, EXPECTED, 0.01, 10.0)
    for missed in (1, 2):
        devices.silent(1, EXPECTED, 10.0, 10.1)
        assert devices.state(1).failures == missed
        assert devices.backed_off(1, Priority.POLL, 10.1) is None
    devices.silent(1, EXPECTED, 10.0, 10.1)
    assert devices.backed_off(1, Priority.POLL, 10.1) == pytest.approx(1.0)
    devices.answered(1, EXPECTED, 0.01, 12.0)
    devices.silent(1, EXPECTED, 12.0, 12.1)
    assert devices.backed_off(1, Priority.POLL, 12.1) is None


def test_dead_drive_takes_no_more_time_than_with_a_pause_after_each_miss() -> None:
    """A minute of polls, as often as they are allowed."""
    timing = Timing()
    devices = Devices(timing, mistakable=True)
    devices.answered(1, EXPECTED, 0.01, 0.0)
    now = spent = before = waited = 0.0
    failures = 0
    while now < 60.0:
        out = devices.time_out(1, 3, Priority.POLL)
        devices.silent(1, EXPECTED, now, now + out)
        spent, now = spent + out, now + out
        now += devices.backed_off(1, Priority.POLL, now) or 0.0
    while waited < 60.0:
        out = min(timing.first_timeout, timing.min_timeout * 2**failures)
        failures += 1
        before += out
        waited += out + pause(failures, timing.back_off_first, timing.back_off_longest)
    assert spent <= before + 1e-9


def test_repeat_does_not_wait_for_its_own_earlier_try(devices: Devices) -> None:
    pdu = READ.pdu()
    devices.silent(1, EXPECTED, 9.0, 10.0, pdu)
    ask = (1, EXPECTED, Priority.POLL, 10.0)
    assert devices.not_before(*ask, (pdu, 9.0)) == 0.0
    assert devices.doubts(1, EXPECTED, 10.0, (pdu, 9.0)) == (True, 0)
    # a request of its own may follow a write: an older reply is not as good
    assert devices.not_before(*ask, (pdu, None)) == 11.0
    assert devices.not_before(*ask, (pdu, 9.5)) == 11.0
    assert devices.not_before(*ask, (Read(1, 6, 1).pdu(), 9.0)) == 11.0
    assert devices.doubts(1, EXPECTED, 10.0, (pdu, 9.5)) == (False, 1)


def test_scan_waits_briefly_for_unknown_devices_only(devices: Devices) -> None:
    background = Priority.BACKGROUND
    assert devices.time_out(1, 3, background) == 0.3
    devices.answered(1, EXPECTED, 0.01, 10.0)
    assert devices.time_out(1, 6, background) == 1.0


def test_repeated_request_waits_longer(devices: Devices) -> None:
    waits = [devices.time_out(1, 3, p) for p in (Priority.BACKGROUND, Priority.PATIENT)]
    assert waits == [0.3, 0.8]
    hurried = Devices(Timing(first_timeout=0.2), mistakable=True)
    assert hurried.time_out(1, 3, Priority.PATIENT) == 0.2
    # nor is it held off by the silence of the first time
    devices.silent(1, EXPECTED, 9.0, 10.0)
    assert devices.backed_off(1, Priority.PATIENT, 10.0) is None


def test_caller_sets_the_wait_for_an_unknown_device(devices: Devices) -> None:
    background = Priority.BACKGROUND
    assert devices.time_out(1, 3, background, 0.01) == 0.01
    assert devices.time_out(1, 3, background, 5.0) == 1.0, "no longer than the longest"
    assert devices.time_out(1, 3, background, float("nan")) == 0.3


def test_address_that_never_answered_has_no_late_reply(devices: Devices) -> None:
    devices.silent(1, EXPECTED, 10.0, 11.0)
    assert devices.last_reply_by(11.0) == 11.0
    devices.answered(2, EXPECTED, 0.01, 10.0)
    devices.silent(2, EXPECTED, 10.0, 11.0)
    assert devices.last_reply_by(11.0) == 12.0


def test_silent_device_is_not_polled_during_the_back_off(devices: Devices) -> None:
    devices.silent(1, EXPECTED, 9.0, 10.0)
    assert devices.backed_off(1, Priority.POLL, 10.0) == 1.0
    assert devices.backed_off(1, Priority.POLL, 11.0) is None
    assert devices.backed_off(1, Priority.OPERATOR_READ, 10.0) is None
    assert devices.backed_off(2, Priority.POLL, 10.0) is None
    # a scan asks an address that never answered by every function it knows
    assert devices.backed_off(1, Priority.BACKGROUND, 10.0) is None
    devices.silent(1, EXPECTED, 11.0, 12.0)
    assert devices.backed_off(1, Priority.POLL, 12.0) == 2.0
    assert devices.state(1).silent_since == 10.0
    devices.answered(1, EXPECTED, 0.01, 13.0)
    assert devices.backed_off(1, Priority.POLL, 13.0) is None
    assert devices.state(1).silent_since is None


@pytest.mark.parametrize(
    ("request_", "waits"),
    [
        (READ, True),
        (Read(1, 99, 1), True),
        (Read(1, 5, 2), False),
        (WriteOne(1, 5, 1), False),
        (Read(2, 5, 1), False),
    ],
)
def test_only_requests_with_the_same_reply_form_wait(
    devices: Devices, request_: Request, waits: bool
) -> None:
    devices.silent(1, EXPECTED, 9.0, 10.0)
    wanted = (request_.device, request_.expectation())
    assert devices.not_before(*wanted, Priority.OPERATOR_READ, 10.0) == (11.0 if waits else 0.0)
    assert devices.not_before(*wanted, Priority.STOP, 10.0) == 0.0
    assert devices.not_before(*wanted, Priority.OPERATOR_READ, 11.0) == 0.0


def test_late_reply_ends_the_wait_and_sets_the_lateness(devices: Devices) -> None:
    devices.silent(1, EXPECTED, 9.0, 10.0)
    assert devices.stray(LATE, 13.0)
    assert devices.not_before(1, EXPECTED, Priority.POLL, 13.0) == 0.0
    # three seconds late: six are waited the next time, and the line is left quiet at first
    devices.silent(1, EXPECTED, 19.0, 20.0)
    assert devices.not_before(1, EXPECTED, Priority.POLL, 20.0) == 26.0
    assert 20.0 < devices.not_before(2, EXPECTED, Priority.POLL, 20.0) < 21.0
    assert devices.not_before(2, EXPECTED, Priority.STOP, 20.0) == 0.0


def test_modbus_tcp_request_never_waits_for_a_late_reply() -> None:
    devices = Devices(TIMING, mistakable=False)
    devices.silent(1, EXPECTED, 9.0, 10.0)
    assert devices.not_before(1, EXPECTED, Priority.POLL, 10.0) == 0.0


@pytest.mark.parametrize(("after", "memory"), [(0.04, LONG_MEMORY), (0.2, SHORT_MEMORY)])
def test_repeated_reply_delays_the_same_request(
    devices: Devices, after: float, memory: float
) -> None:
    devices.answered(1, EXPECTED, 0.01, 10.0)
    assert devices.not_before(1, EXPECTED, Priority.POLL, 10.0) == 0.0
    assert devices.stray(LATE, 10.0 + after)
    devices.answered(1, EXPECTED, 0.01, 11.0)
    assert devices.not_before(1, EXPECTED, Priority.POLL, 11.0) == pytest.approx(11 + 2 * after)
    end = 10.0 + memory
    devices.answered(1, EXPECTED, 0.01, end)
    assert devices.not_before(1, EXPECTED, Priority.POLL, end) == pytest.approx(end + 2 * after)
    # a long wait becomes a short one; that is over at the end of the longer memory
    end = 11.0 + memory
    devices.answered(1, EXPECTED, 0.01, end)
    left = 0.0 if memory is LONG_MEMORY else end + SHORT_WAIT
    assert devices.not_before(1, EXPECTED, Priority.POLL, end) == pytest.approx(left)
    end = 11.0 + LONG_MEMORY
    devices.answered(1, EXPECTED, 0.01, end)
    assert devices.not_before(1, EXPECTED, Priority.POLL, end) == 0.0


def test_request_waits_as_long_as_copies_arrive(devices: Devices) -> None:
    """Only the first one counted, and ten minutes later the next was taken for an answer."""
    for now in range(10, 10 + 3 * int(LONG_MEMORY), 20):
        devices.answered(1, EXPECTED, 0.01, now)
        assert devices.stray(LATE, now + 0.04)
        devices.answered(1, EXPECTED, 0.01, now + 10)
        until = devices.not_before(1, EXPECTED, Priority.POLL, now + 10)
        assert until == pytest.approx(now + 10.08)
    assert devices.state(1).lateness == 0.0


def test_new_owner_knows_that_line_repeats_replies(devices: Devices) -> None:
    devices.answered(1, EXPECTED, 0.01, 10.0)
    assert devices.stray(LATE, 10.004)
    heir = Devices(TIMING, mistakable=True)
    heir.copy(1, devices.state(1))
    other = Read(2, 5, 1).expectation()
    heir.answered(2, other, 0.01, 11.0)
    waited = heir.not_before(2, other, Priority.POLL, 11.0) - 11.0
    assert waited == pytest.approx(0.004 + TIMING.frame_gap)


def test_wait_for_a_copy_exceeds_the_previous_gap(devices: Devices) -> None:
    """An adapter delivers in lumps: a copy was 4 ms after its reply, the next one 16."""
    devices.answered(1, EXPECTED, 0.01, 10.0)
    assert devices.stray(LATE, 10.004)
    devices.answered(1, EXPECTED, 0.01, 11.0)
    waited = devices.not_before(1, EXPECTED, Priority.POLL, 11.0) - 11.0
    assert waited == pytest.approx(0.004 + TIMING.frame_gap)


def test_repeated_trace_entries_share_a_line(devices: Devices) -> None:
    devices.answered(1, EXPECTED, 0.01, 10.0)
    assert devices.stray(LATE, 10.02)
    other = Read(2, 5, 1).expectation()
    devices.answered(2, other, 0.01, 11.0)
    assert devices.not_before(2, other, Priority.POLL, 11.0) == pytest.approx(11.04)


def test_copy_of_the_previous_reply_is_recognized_by_its_time(devices: Devices) -> None:
    requested, reply = Read(1, 5, 1).pdu(), bytes([3, 2, 0, 7])
    for _ in range(5):
        devices.answered(1, EXPECTED, 0.01, 10.0, (requested, reply))
    other = Read(1, 6, 1).pdu()
    assert devices.is_repeat(1, other, reply, 0.03)
    assert devices.is_repeat(1, other, reply, 0.001)
    assert not devices.is_repeat(1, other, reply, 0.01), "as long as ever"
    assert not devices.is_repeat(1, other, reply, 0.0215), "a little more than twice as long"
    assert not devices.is_repeat(1, requested, reply, 0.03), "the same register"
    assert not devices.is_repeat(1, other, bytes([3, 2, 0, 8]), 0.03), "another value"


def test_frame_without_a_request_is_unexplained(devices: Devices) -> None:
    assert not devices.stray(LATE, 10.0)
    devices.silent(1, WriteOne(1, 5, 1).expectation(), 9.0, 10.0)
    assert not devices.stray(LATE, 10.0)
    assert devices.stray(Piece(frame(1, bytes([0x86, 2])), whole=True), 10.0)


@pytest.mark.parametrize(
    ("request_", "doubts"),
    [
        (Read(1, 5, 1), (False, 1)),
        (Read(1, 5, 2), (False, 0)),
        (WriteOne(1, 5, 1), (False, 0)),
        (WriteMany(1, 5, (1, 2)), (False, 1)),
        (Read(2, 5, 1), (True, 0)),
    ],
)
def test_doubts_about_a_stop(devices: Devices, request_: Request, doubts: tuple[bool, int]) -> None:
    for earlier in (READ, WriteOne(1, 5, 1), WriteMany(1, 5, (7, 8))):
        devices.silent(1, earlier.expectation(), 9.0, 10.0)
    assert devices.doubts(request_.device, request_.expectation(), 10.0) == doubts


def test_trace_is_bounded() -> None:
    trace = Trace(3)
    for time in range(5):
        trace.add(time, "out", bytes([time]))
    assert [frame_.data for frame_ in trace.frames()] == [b"\2", b"\3", b"\4"]


def write(value: int, register: int = 8502, *, replaceable: bool = True) -> Job:
    request = WriteOne(1, register, value)
    return Job(request, Priority.OPERATOR_WRITE, WIDE, replaceable=replaceable)


def test_newer_reference_replaces_a_waiting_one() -> None:
    queue = JobQueue(20)
    other, first, second = job(Priority.OPERATOR_WRITE), write(300), write(500)
    for each in (first, other, second):
        queue.put(each)
    with pytest.raises(Superseded, match="8502 of device 1"):
        first.answer.result(0)
    assert [queue.take(now, 0.0)[0] for _ in range(3)] == [second, other, None]


@pytest.mark.parametrize(
    ("older", "between", "newer"),
    [
        (write(6, 8501, replaceable=False), None, write(7, 8501, replaceable=False)),
        (write(6, 8501, replaceable=False), None, write(7, 8501)),
        (write(300), write(15, 8501, replaceable=False), write(500)),
        (write(300), None, write(500, 8602)),
    ],
    ids=["commands", "a reference after a command", "a command between", "another register"],
)
def test_only_references_are_replaced(older: Job, between: Job | None, newer: Job) -> None:
    queue = JobQueue(20)
    jobs = [each for each in (older, between, newer) if each is not None]
    for each in jobs:
        queue.put(each)
    assert [queue.take(now, 0.0)[0] for _ in jobs] == jobs


def test_reference_in_flight_is_not_replaced() -> None:
    queue = JobQueue(20)
    first, second = write(300), write(500)
    queue.put(first)
    assert queue.take(now, 0.0)[0] is first
    first.begun = True
    queue.put(second)
    assert not first.answer.done()


def test_keep_alive_read_avoids_forms_of_late_replies_without_waiting() -> None:
    devices = Devices(Timing(), mistakable=True)
    request = Read(1, 3201, 1)
    devices.silent(1, request.expectation(), 10.0, 11.0)
    assert devices.not_before(1, request.expectation(), Priority.POLL, 11.0) > 11.0
    assert devices.not_before(1, request.expectation(), Priority.FEED, 11.0) == 0.0
    assert devices.backed_off(1, Priority.FEED, 11.0) is None
    assert devices.doubts(1, request.expectation(), 11.0) == (False, 1)


def test_new_owner_knows_late_and_repeated_replies() -> None:
    owner, heir = (Devices(Timing(), mistakable=True) for _ in range(2))
    expectation = Read(1, 3201, 1).expectation()
    reply = Piece(frame(1, bytes([3, 2, 0, 7])), whole=True)
    owner.silent(1, expectation, 10.0, 10.3)
    assert owner.stray(reply, 10.8)
    owner.answered(1, expectation, 0.005, 11.0)
    assert owner.stray(reply, 11.4)
    heir.copy(1, owner.state(1))
    assert heir.state(1) == owner.state(1)
    # the copy of a reply to the first request of the next owner is not taken for that to its second
    heir.answered(1, expectation, 0.005, 12.0)
    assert heir.not_before(1, expectation, Priority.POLL, 12.1) == pytest.approx(12.8)
    # and the line is left quiet for one that is late, as the owner would leave it
    heir.silent(1, expectation, 13.0, 13.3)
    assert heir.quiet_until > 13.3


def test_time_of_the_last_reply_of_a_device() -> None:
    devices = Devices(Timing(), mistakable=True)
    expectation = Read(1, 3201, 1).expectation()
    assert devices.state(1).heard is None
    devices.answered(1, expectation, 0.005, 5.0)
    devices.silent(1, expectation, 6.0, 7.0)
    assert devices.state(1).heard == 5.0


@pytest.mark.parametrize(
    ("priority", "stops"),
    [(Priority.STOP, True), (Priority.FEED, True), (Priority.OPERATOR_WRITE, False)],
)
def test_writes_until_the_repeat_of_a_stop_are_stop_words(priority: Priority, stops: bool) -> None:
    assert is_stop_word(Job(WriteOne(1, 8501, 0), priority, WIDE)) is stops
    assert not is_stop_word(Job(Read(1, 8501, 1), priority, WIDE))


# -- places of stops and kinds ---------------------------------------------------------------------


def sent_stops(*tries: bool, last: bool = True) -> SentStops:
    """The stop words of device 1 were sent at 10 s; `tries` were acknowledged or not."""
    stops = SentStops()
    for acknowledged in tries:
        stops.count(stop_job(1), 10.0, acknowledged=acknowledged)
    if not last:
        stops.count(job(Priority.POLL), 10.0, acknowledged=True)
    return stops


@pytest.mark.parametrize(
    ("tries", "last", "now", "yields"),
    [
        ([True], True, 10.0, True),
        ([True], True, 12.9, True),
        ([True], True, 13.0, False),
        ([True], False, 10.0, False),  # another request went between
        ([False], True, 10.0, False),
        ([False] * 4, True, 10.0, False),
        ([False] * 5, True, 10.0, True),
        ([False] * 7, True, 10.0, True),
        ([True, False], True, 10.0, False),
        ([False] * 4 + [True], True, 10.0, True),
    ],
)
def test_repeated_stop_yields_to_one_request(
    tries: list[bool], last: bool, now: float, yields: bool
) -> None:
    stops = sent_stops(*tries, last=last)
    assert stops.yields(stop_job(1), now) == yields
    assert not stops.yields(stop_job(2), now), "another drive's"
    assert not stops.yields(Job(WriteOne(1, 8501, 2), Priority.STOP, WIDE), now), "another word"
    assert not stops.yields(job(Priority.POLL), now)


@pytest.mark.parametrize(("device", "again"), [(1, False), (2, True), (0, False)])
def test_command_makes_the_same_stop_a_first_one(device: int, again: bool) -> None:
    stops = sent_stops(True)
    command = Job(WriteOne(device, 8501, 15), Priority.OPERATOR_WRITE, WIDE)
    stops.count(command, 10.0, acknowledged=True)
    stops.count(stop_job(3), 10.0, acknowledged=True)
    assert stops.yields(stop_job(1), 10.0) == again


def test_stops_of_earlier_are_forgotten() -> None:
    stops = sent_stops(True)
    stops.count(stop_job(2), 12.9, acknowledged=True)
    assert len(stops._sent) == 2
    stops.count(stop_job(2), 13.0, acknowledged=True)
    assert list(stops._sent) == [(2, stop_job(2).pdu)]


def test_rank_is_stops_then_kinds_that_are_owed_then_kinds_and_their_programs() -> None:
    shares = LineShares()
    poll, stop = job(Priority.POLL), stop_job(1)
    patient = job(Priority.PATIENT)
    stop.order, poll.order, patient.order = 4, 5, 6
    poll.program = patient.program = "a"
    assert shares.rank(stop) == (0.0, 0.0, 0.0, 0.0, 4)
    assert shares.rank(poll) == (2.0, Priority.POLL, 0.0, Priority.POLL, 5)
    assert shares.rank(patient) == (2.0, Priority.BACKGROUND, 0.0, Priority.PATIENT, 6)
    shares._had[Priority.POLL, "a"] = shares._had[Priority.BACKGROUND, "a"] = 0.75
    shares._owed[Priority.POLL] = shares._owed[Priority.BACKGROUND] = 0.1
    assert shares.rank(poll) == (2.0, Priority.POLL, 0.75, Priority.POLL, 5)
    shares._owed[Priority.POLL] = shares._owed[Priority.BACKGROUND] = 0.2
    assert shares.rank(poll) == (1.0, -0.2, 0.75, Priority.POLL, 5)
    assert shares.rank(patient) == (1.0, -0.2, 0.75, Priority.PATIENT, 6)


def test_program_that_comes_back_has_had_as_much_as_the_others() -> None:
    queue = JobQueue(20)
    polls = [job(Priority.POLL, address) for address in range(3)]
    for each, program in zip(polls, "aab", strict=True):
        each.program = program
    queue.put(polls[0])
    queue.take(now, 0.0)
    queue.put(polls[1])
    queue.count(polls[0], 0.0, 2.0, acknowledged=True)
    queue.put(polls[2])
    assert queue._shares._had == {(Priority.POLL, "a"): 2.0, (Priority.POLL, "b"): 2.0}
    assert queue.take(now, 2.0)[0] is polls[1], "it makes up for no time without a request"


def test_time_of_an_exchange_is_counted_for_its_program() -> None:
    counted: list[tuple[str, float]] = []
    use = ProgramUse()
    use.count = lambda *those: counted.append(those)  # type: ignore[method-assign]
    queue = JobQueue(20, use)
    poll = job(Priority.POLL)
    poll.program = "a"
    queue.count(poll, 10.0, 10.5, acknowledged=True)
    assert counted == [("a", 0.5)]


def test_full_queue_reports_the_number_that_waits() -> None:
    queue = JobQueue(2)
    queue.put(job(Priority.POLL))
    with pytest.raises(LineBusy, match=r"^1 requests wait for the line already; try again\.$"):
        queue.put(job(Priority.POLL, 1))
