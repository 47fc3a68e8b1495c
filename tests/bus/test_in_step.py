"""Replies that belong to other requests than they seem to: found, named, and never shown."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, cast

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineBehind, LineError, LineLost, NoAnswer
from tui.bus.limits import Limits
from tui.bus.line import Line, LineStatus, Timing
from tui.bus.link import RtuTcpLink
from tui.bus.master import ExchangeResult, Master, Piece, ResultKind, Sending
from tui.bus.requests import Diagnose, Identify, Read, Request, WriteOne
from tui.bus.schedule.dispatcher import Dispatcher
from tui.bus.schedule.in_step import InStep
from tui.bus.schedule.outcomes import Outcomes
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import Job
from tui.bus.shared_state import SharedState
from tui.bus.tally import Tally
from tui.wire.frames import frame

from .conftest import NO_ECHO, WIDE, OpenLine
from .peer import PtyPeer, Step, TcpPeer, eventually, honest, reply

SHORT = Timing(
    first_timeout=0.15, min_timeout=0.15, late_reply=0.3, reconnect_first=0.02, connect_timeout=3.0
)
SINGLE = replace(WIDE, functions=frozenset({3, 6, 43}), max_read=1, single_words_only=True)
SILENT = replace(NO_ECHO, functions=frozenset({3, 6, 16}), answers_all=False)
"""May answer a longer read with silence."""
"""Reads single words, and has no echo."""
LIMITS = {"echo": WIDE, "no echo": NO_ECHO, "single words": SINGLE, "silent": SILENT}


class Behind:
    """A converter that holds each reply until this many further requests have arrived."""

    def __init__(self, held: int = 1) -> None:
        self.held = held
        self._replies: list[bytes] = []

    def __call__(self, request: bytes, _count: int) -> Sequence[Step]:
        self._replies.append(self.made(request))
        return [self._replies.pop(0)] if len(self._replies) > self.held else []

    def made(self, request: bytes) -> bytes:
        return reply(request)

    def mend(self) -> None:
        self.held = 0
        self._replies.clear()


async def values(line: Line, count: int, seconds: float = 15.0) -> list[tuple[int, int]]:
    """Registers read, with their values; in turn, for this many tries."""
    found = []
    async with asyncio.timeout(seconds):
        for at in range(count):
            with suppress(LineError):
                register = 100 + at % 7
                answer = await line.read(1, register, priority=Priority.OPERATOR_READ)
                found.append((register, answer.words[0]))
            await asyncio.sleep(0.02)
    return found


def right(found: list[tuple[int, int]]) -> bool:
    return all(register == word for register, word in found)


def is_named(line: Line) -> bool:
    state = line.state
    return state.status is LineStatus.LOST and state.reason.startswith("Replies are one behind")


async def until_named(line: Line) -> list[tuple[int, int]]:
    found = []
    async with asyncio.timeout(20.0):
        while not is_named(line):
            found += await values(line, 2)
    return found


def opened(open_line: OpenLine, path: str | RtuTcpLink, limits: Limits) -> Line:
    line = open_line(path, SHORT, probes=True)
    line.describe(1, limits)
    return line


@pytest.mark.parametrize("kind", LIMITS)
async def test_replies_one_behind_are_reported_and_never_used(
    open_line: OpenLine, kind: str
) -> None:
    with PtyPeer(Behind()) as peer:
        line = opened(open_line, peer.path, LIMITS[kind])
        assert right(await until_named(line))
        with pytest.raises(LineLost, match="one behind"):
            await line.read(1, 100)
        with pytest.raises(LineLost, match="one behind"):
            await line.write(1, 100, [7])
        assert 6 not in [request[1] for request in peer.requests]


@pytest.mark.parametrize("kind", LIMITS)
async def test_converter_that_falls_behind_later_yields_no_wrong_value(
    open_line: OpenLine, kind: str
) -> None:
    converter = Behind(0)
    with PtyPeer(converter) as peer:
        line = opened(open_line, peer.path, LIMITS[kind])
        assert len(await values(line, 8)) == 8
        converter.held = 1
        assert right(await until_named(line))


async def test_drive_with_few_reply_lengths_yields_no_wrong_value(open_line: OpenLine) -> None:
    """Its identification is the only reply that is unlike that of a read."""
    with PtyPeer(Behind()) as peer:
        line = opened(open_line, peer.path, SINGLE)
        for _ in range(2):
            with suppress(LineError):
                await line.identify(1)
        assert right(await until_named(line))


async def test_replies_one_behind_over_rtu_tcp_are_reported(open_line: OpenLine) -> None:
    with TcpPeer(Behind()) as peer:
        line = opened(open_line, RtuTcpLink("127.0.0.1", peer.port), WIDE)
        assert right(await until_named(line))
        before = len(peer.requests)
        await asyncio.to_thread(peer.await_requests, before + 2)
        assert is_named(line), "it is looked again whether they are in step"


async def test_stop_is_sent_on_a_line_with_replies_one_behind(open_line: OpenLine) -> None:
    with PtyPeer(Behind()) as peer:
        line = opened(open_line, peer.path, NO_ECHO)
        await until_named(line)
        await asyncio.to_thread(eventually, lambda: _stopped(line, peer))


def _stopped(line: Line, peer: PtyPeer) -> bool:
    """Send a stop; while the port is opened again, it may fail."""
    with suppress(LineError):
        asyncio.run(line.write(1, 1, [0], priority=Priority.STOP))
    return any(request[1] == 6 for request in peer.requests)


async def test_stop_is_kept_while_a_line_one_behind_cannot_be_reopened(
    open_line: OpenLine,
) -> None:
    """A gateway may refuse the next connection for some seconds: the stop fails, and is sent."""
    with TcpPeer(Behind()) as peer:
        line = opened(open_line, RtuTcpLink("127.0.0.1", peer.port), WIDE)
        await until_named(line)
    await asyncio.to_thread(eventually, lambda: "cannot be reached" in line.state.reason)
    with pytest.raises(NoAnswer):  # so that the stop continues without a read
        await line.read(1, 100, priority=Priority.STOP)
    for _ in range(2):
        with pytest.raises(LineLost, match="cannot be reached"):
            await line.write(1, 1, [0], priority=Priority.STOP)
    with pytest.raises(LineLost):
        await line.write(1, 2, [7])
    with TcpPeer(honest, port=peer.port) as again:
        await asyncio.to_thread(again.await_requests, 2)
        assert [request[1] for request in again.requests].count(6) == 1
        assert again.requests[0][1:6] == bytes([6, 0, 1, 0, 0]), "before anything else"


async def test_line_is_used_again_once_replies_are_in_step(open_line: OpenLine) -> None:
    converter = Behind()
    with PtyPeer(converter) as peer:
        line = opened(open_line, peer.path, WIDE)
        await until_named(line)
        converter.mend()
        await asyncio.to_thread(eventually, lambda: line.state.status is LineStatus.CONNECTED, 15.0)
        found = await values(line, 5)
        assert right(found)
        assert len(found) >= 4


async def test_slow_drive_is_not_reported_as_one_behind(open_line: OpenLine) -> None:
    """Its replies come after the timeout, by themselves."""
    slow = [0.2]

    def late(request: bytes, _count: int) -> Sequence[Step]:
        return [slow[0], reply(request)]

    with PtyPeer(late) as peer:
        line = opened(open_line, peer.path, NO_ECHO)
        found = await values(line, 8)
        assert right(found)
        assert line.state.status is LineStatus.CONNECTED


@pytest.mark.parametrize("kind", LIMITS)
async def test_first_value_costs_one_additional_exchange(open_line: OpenLine, kind: str) -> None:
    with PtyPeer(honest) as peer:
        line = opened(open_line, peer.path, LIMITS[kind])
        assert (await line.read(1, 100)).words == (100,)
        assert len(peer.requests) == 2
        for register in range(101, 110):
            await line.read(1, register)
        assert len(peer.requests) == 11, "once is enough"


async def test_probe_adds_no_cost_for_an_absent_drive(open_line: OpenLine) -> None:
    with PtyPeer(lambda _request, _count: []) as peer:
        line = opened(open_line, peer.path, WIDE)
        with pytest.raises(LineError):
            await line.read(1, 100)
        assert len(peer.requests) == 1


async def test_stop_does_not_wait_for_a_probe(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = opened(open_line, peer.path, WIDE)
        await line.write(1, 1, [0], priority=Priority.STOP)
        assert peer.requests[0][1] == 6


async def test_write_is_not_sent_before_replies_are_proved_in_step(
    open_line: OpenLine,
) -> None:
    with PtyPeer(lambda _request, _count: []) as peer:
        line = opened(open_line, peer.path, WIDE)
        with pytest.raises(LineError, match="Nothing was written"):
            await line.write(1, 1, [7])
        assert 6 not in [request[1] for request in peer.requests]


async def test_read_after_a_lost_reply_is_lengthened_and_does_not_wait(
    open_line: OpenLine,
) -> None:
    def loses_the_third(request: bytes, count: int) -> Sequence[Step]:
        return [] if count == 2 else [reply(request)]

    timing = replace(SHORT, late_reply=60.0, retries=0)
    with PtyPeer(loses_the_third) as peer:
        line = open_line(peer.path, timing, probes=True)
        await line.read(1, 100)
        with pytest.raises(LineError):
            await line.read(1, 101)
        async with asyncio.timeout(30.0):
            answer = await line.read(1, 102)
        assert answer.words == (102,)
        assert answer.pdu == bytes([3, 2, 0, 102]), "the reply to what was wanted"
        assert peer.requests[-1][5] > 1


def test_lengthened_read_avoids_the_length_of_a_late_reply() -> None:
    devices, timing = Devices(Timing(), mistakable=True), Timing()
    outcomes = Outcomes(devices, Tally(), timing, lambda: 1.0, SharedState(), gateway=False)
    steps = InStep(devices, outcomes, lambda: 1.0, timing, buffers=False)
    for count in (1, 2):
        devices.may_come(1, Read(1, 0, count).expectation(), 0.5, 0.6)
    job = Job(Read(1, 100, 1), Priority.POLL, WIDE)
    assert steps.lengthen(job)
    assert (job.form, job.own_part(bytes([3, 6, 0, 1, 0, 2, 0, 3]))) == (
        Read(1, 100, 3), bytes([3, 2, 0, 1]),
    )  # fmt: skip


async def test_refused_longer_read_is_replaced(open_line: OpenLine) -> None:
    """The register after the last one does not exist."""

    def refuses(request: bytes, count: int) -> Sequence[Step]:
        if count == 2:
            return []
        too_long = int.from_bytes(request[2:4], "big") + request[5] > 103
        refused = request[1] == 3 and too_long
        return [frame(1, bytes([0x83, 2])) if refused else reply(request)]

    timing = replace(SHORT, late_reply=0.6, retries=0)
    with PtyPeer(refuses) as peer:
        line = open_line(peer.path, timing, probes=True)
        await line.read(1, 100)
        with pytest.raises(LineError):
            await line.read(1, 101)
        assert (await line.read(1, 102)).words == (102,)


async def test_late_reply_is_not_taken_for_the_reply_to_a_longer_read(open_line: OpenLine) -> None:
    """Replies out of order, as no echo between them could find."""

    def out_of_order(request: bytes, count: int) -> Sequence[Step]:
        if count == 2:
            held.append(reply(request))
            return []
        return [held.pop() + reply(request)] if held and count == 4 else [reply(request)]

    held: list[bytes] = []
    with PtyPeer(out_of_order) as peer:
        line = open_line(peer.path, replace(SHORT, late_reply=60.0, retries=0), probes=True)
        await line.read(1, 100)
        with pytest.raises(LineError):
            await line.read(1, 101)
        for register in (102, 103, 104):
            assert (await line.read(1, register)).words == (register,)


@pytest.mark.parametrize(("buffers", "longer"), [(False, 0), (True, 5)])
def test_buffering_connection_is_probed_every_ten_seconds(buffers: bool, longer: int) -> None:
    now = 0.0
    devices, timing = Devices(Timing(), mistakable=True), Timing()

    def clock() -> float:
        return now

    outcomes = Outcomes(devices, Tally(), timing, clock, SharedState(), gateway=False)
    steps = InStep(devices, outcomes, clock, timing, buffers=buffers)
    steps.opened()
    probes, counts = 0, []
    for at in range(600):
        now = at * 0.1
        job = Job(Read(1, 100 + at % 5, 2), Priority.POLL, NO_ECHO)
        while (probe := steps.prepare(job)) is not None:
            steps.note(job, probe.expectation(), ExchangeResult(ResultKind.REPLY, sent=now))
            probes += 1
        assert job.expectation is not None
        steps.note(job, job.expectation, ExchangeResult(ResultKind.REPLY, sent=now))
        counts.append((job.form or Read(1, 0, 2)).count)
    assert probes == 1, "a longer read costs no exchange"
    assert sum(count > 2 for count in counts) == longer


class _Line:
    """Replies of a drive without a wire; the clock does not advance."""

    def __init__(self, *, gateway: bool = False) -> None:
        self.now = 1.0
        timing = Timing()
        self.devices = Devices(timing, mistakable=not gateway)
        self.outcomes = Outcomes(
            self.devices, Tally(), timing, lambda: self.now, SharedState(), gateway=gateway
        )
        self.steps = InStep(self.devices, self.outcomes, lambda: self.now, timing, False, gateway)

    def note(self, job: Job, kind: ResultKind, *earlier: bytes, code: int = 0) -> None:
        strays = [Piece(data, whole=True) for data in earlier]
        result = ExchangeResult(kind, sent=self.now, strays=strays, exception=code)
        self.outcomes.hear_gateway(job, result)
        assert job.expectation is not None
        self.steps.note(job, job.expectation, result)


def test_write_is_sent_after_refused_probes() -> None:
    """A drive may refuse the echo that its profile gives it."""
    line = _Line()
    write = Job(WriteOne(1, 1, 7), Priority.OPERATOR_WRITE, WIDE)
    probes = 0
    while (probe := line.steps.prepare(write)) is not None:
        probes += 1
        assert probes < 10, "it would never be sent"
        line.steps.note(write, probe.expectation(), ExchangeResult(ResultKind.EXCEPTION))


def test_lost_request_does_not_break_the_next_connection() -> None:
    line = _Line()
    few = replace(SINGLE, functions=frozenset({3}))
    line.note(Job(Read(1, 100, 1), Priority.POLL, few), ResultKind.NOTHING)
    job = Job(Read(1, 101, 1), Priority.POLL, few)
    assert line.steps.prepare(job) is None
    line.steps.opened()
    line.note(job, ResultKind.REPLY)


def test_gateway_is_probed_again_after_a_lost_reply() -> None:
    """The reply that it gave up may be given to the next request."""
    line = _Line(gateway=True)
    line.note(Job(Read(1, 100, 2), Priority.POLL, NO_ECHO), ResultKind.REPLY)
    line.note(Job(Read(1, 100, 1), Priority.POLL, NO_ECHO), ResultKind.REPLY)
    line.note(Job(Read(1, 101, 1), Priority.POLL, NO_ECHO), ResultKind.EXCEPTION, code=11)
    job = Job(Read(1, 102, 1), Priority.POLL, NO_ECHO)
    line.steps.prepare(job)
    assert job.form is not None


def test_late_reply_after_the_drain_is_not_reported_as_one_behind() -> None:
    """The first exchange after it brought nothing: no reply was held back."""
    line = _Line()
    jobs = [Job(Read(1, 100, count), Priority.POLL, NO_ECHO) for count in (1, 2, 3, 4, 5)]
    late = [reply(bytes([1]) + job.pdu + bytes(2)) for job in jobs]
    line.note(jobs[0], ResultKind.NOTHING)
    line.note(jobs[1], ResultKind.WRONG, late[0])
    line.note(jobs[2], ResultKind.WRONG, late[1])
    line.now = line.steps.quiet_until + 0.1
    line.note(jobs[3], ResultKind.NOTHING)
    line.note(jobs[4], ResultKind.WRONG, late[3])
    assert not line.steps.behind


def test_keep_alive_read_does_not_wait_for_the_drain() -> None:
    timing = Timing()
    devices = Devices(timing, mistakable=True)
    dispatcher = Dispatcher(devices, Tally(), timing, lambda: 1.0, gateway=False)
    dispatcher.steps.quiet_until = 5.0
    read = Read(1, 100, 1)
    assert dispatcher._not_before(Job(read, Priority.FEED, WIDE)) <= 1.0
    assert dispatcher._not_before(Job(read, Priority.POLL, WIDE)) == 5.0


class _Answers:
    """A master whose exchange has one given end."""

    def __init__(self, kind: ResultKind, code: int = 0) -> None:
        self._result = ExchangeResult(kind, exception=code, sent=1.0)

    async def exchange(self, _sending: Sending) -> ExchangeResult:
        return self._result


@pytest.mark.parametrize(("code", "answered"), [(2, True), (10, False), (11, False)])
async def test_gateway_exception_is_not_a_reply_of_the_drive(code: int, answered: bool) -> None:
    line = _Line(gateway=True)
    job = Job(Read(1, 100, 1), Priority.POLL, NO_ECHO)
    master = cast(Master, _Answers(ResultKind.EXCEPTION, code))
    result = await line.steps.prove(master, job, Read(1, 100, 2))
    assert result.kind is (ResultKind.EXCEPTION if answered else ResultKind.NOTHING)
    assert line.devices[1].ever_answered is answered


@pytest.mark.parametrize(("now", "due"), [(4.9, 5.0), (5.0, None), (5.1, None)])
def test_drain_ends_at_its_time_and_leaves_requests_to_other_rules(
    now: float, due: float | None
) -> None:
    line = _Line()
    line.steps.quiet_until = 5.0
    assert line.steps.not_before(Job(Read(1, 100, 1), Priority.POLL, WIDE), now) == due


STOP_WORDS = Job(WriteOne(1, 1, 0), Priority.STOP, WIDE)
FEW = replace(SINGLE, functions=frozenset({3, 6}))
"""A reading and a writing form, and no other."""


def poll(count: int = 1, limits: Limits = NO_ECHO, *, device: int = 1, register: int = 100) -> Job:
    return Job(Read(device, register, count), Priority.POLL, limits)


def test_line_that_is_behind_fails_everything_but_stop_words() -> None:
    steps = _Line().steps
    assert not steps.refuses(poll())
    steps.behind = "Replies are one behind."
    assert not steps.refuses(STOP_WORDS)
    for refused in (poll(), Job(WriteOne(1, 1, 7), Priority.OPERATOR_WRITE, WIDE)):
        assert steps.not_before(refused, 1.0) == 0.0, "immediately"
        assert steps.refuses(refused)
        with pytest.raises(LineBehind, match="one behind"):
            refused.answer.result(0)
    assert steps.not_before(STOP_WORDS, 1.0) is None


def test_drain_holds_polls_back_and_neither_stops_nor_keep_alive_reads() -> None:
    steps = _Line().steps
    steps.quiet_until = 5.0
    read = Read(1, 100, 1)
    for priority, due in ((Priority.STOP, None), (Priority.FEED, None), (Priority.POLL, 5.0)):
        assert steps.not_before(Job(read, priority, WIDE), 1.0) == due, priority
        assert steps.not_before(Job(read, priority, WIDE), 5.0) is None


@pytest.mark.parametrize("kind", [ResultKind.NOTHING, ResultKind.DAMAGED, ResultKind.WRONG])
def test_reply_of_a_form_of_its_own_proves_the_step_until_a_reply_is_missing(
    kind: ResultKind,
) -> None:
    line = _Line()
    line.note(poll(1), ResultKind.REPLY)
    assert line.steps._proved == set(), "nothing is known of the requests before"
    line.note(poll(1), ResultKind.REPLY)
    assert line.steps._proved == set()
    line.note(poll(2), ResultKind.EXCEPTION)
    assert line.steps._proved == set()
    line.note(poll(3), ResultKind.REPLY)
    assert line.steps._proved == {1}
    line.note(poll(1, device=2), kind)
    assert line.steps._proved == {1}, "each drive has its own"
    line.note(poll(1), kind)
    assert line.steps._proved == set()


def test_missing_reply_behind_a_gateway_ends_the_proof_of_every_drive() -> None:
    line = _Line(gateway=True)
    line.steps._proved |= {1, 2}
    line.note(poll(1, device=3), ResultKind.NOTHING)
    assert line.steps._proved == set()


@pytest.mark.parametrize(("takes", "seconds"), [(0.0, 10.0), (0.05, 10.0), (0.5, 50.0)])
def test_buffering_connection_is_checked_at_its_time_and_seldom_if_it_is_slow(
    takes: float, seconds: float
) -> None:
    line = _Line()
    steps = line.steps
    steps._buffers = True
    line.note(poll(1), ResultKind.REPLY)
    line.now += takes
    sent = ExchangeResult(ResultKind.REPLY, sent=line.now - takes)
    steps.note(poll(2), Read(1, 100, 2).expectation(), sent)
    begun = line.now
    for line.now, proved in ((begun + seconds - 0.01, True), (begun + seconds, False)):
        steps.prepare(poll(2))
        assert (1 in steps._proved) == proved


def test_drive_of_few_forms_proves_its_step_by_a_reply_unlike_the_last_one() -> None:
    line = _Line()
    steps = line.steps
    write = Job(WriteOne(1, 1, 7), Priority.OPERATOR_WRITE, FEW)
    for job in (poll(limits=FEW), write):
        line.note(job, ResultKind.REPLY)
    steps._proved.clear()
    line.note(poll(limits=FEW), ResultKind.REPLY)
    assert steps._proved == set(), "it was not sent to prove anything"
    line.note(write, ResultKind.REPLY)
    assert steps.prepare(poll(limits=FEW)) is None
    assert steps._weak == {1}
    line.note(poll(limits=FEW), ResultKind.REPLY)
    assert (steps._proved, steps._weak) == ({1}, set())
    steps._proved.clear()
    line.note(write, ResultKind.REPLY)
    assert steps._proved == set(), "it counts for the next reply only"


def test_reads_that_were_answered_can_be_probes() -> None:
    line = _Line()
    good: list[Read] = []
    line.steps._probes.note_good = good.append  # type: ignore[assignment,method-assign]
    line.note(poll(2), ResultKind.REPLY)
    lengthened = poll(2)
    lengthened.take_form(Read(1, 100, 4))
    line.note(lengthened, ResultKind.REPLY)
    assert good == [Read(1, 100, 2), Read(1, 100, 4)]
    line.note(poll(5), ResultKind.EXCEPTION)
    line.note(Job(WriteOne(1, 1, 7), Priority.OPERATOR_WRITE, WIDE), ResultKind.REPLY)
    echo = Diagnose(1, 0, 77).expectation()
    line.steps.note(poll(6), echo, ExchangeResult(ResultKind.REPLY, sent=1.0), number=True)
    assert len(good) == 2


def test_proof_ends_every_suspicion_and_reports_a_line_that_was_behind_once() -> None:
    line = _Line()
    steps, recovered = line.steps, []
    steps.recovered = lambda: recovered.append(steps.behind)
    line.note(poll(1), ResultKind.REPLY)
    for count, behind in ((2, ""), (3, "Replies are one behind."), (4, "")):
        steps.behind, steps._shifts, steps.quiet_until = behind, 1, 5.0
        line.note(poll(count), ResultKind.REPLY)
        assert (steps.behind, steps._shifts, steps.quiet_until) == ("", 0, 0.0)
        assert recovered == ([] if count == 2 else [""])


def test_only_replies_that_no_adapter_can_make_are_heard() -> None:
    line = _Line()
    probes = line.steps._probes
    line.note(poll(1), ResultKind.EXCEPTION)
    echo = Diagnose(1, 0, 77).expectation()
    line.steps.note(poll(1), echo, ExchangeResult(ResultKind.REPLY, sent=1.0), number=True)
    assert not probes.heard
    line.note(poll(1), ResultKind.REPLY)
    assert probes.heard
    line.note(poll(1), ResultKind.NOTHING)
    assert probes.heard


@pytest.mark.parametrize("gateway", [True, False])
def test_request_without_a_reply_is_remembered_until_the_next_one(gateway: bool) -> None:
    line = _Line(gateway=gateway)
    steps, other = line.steps, poll(3, device=2)
    line.note(poll(1), ResultKind.NOTHING)
    assert steps._missed == {1: poll(1).pdu}
    probe = ExchangeResult(ResultKind.NOTHING, sent=1.0)
    steps.note(other, Read(2, 100, 4).expectation(), probe)
    assert steps._missed == ({} if gateway else {1: poll(1).pdu}), "a probe is not the request"
    line.note(other, ResultKind.DAMAGED)
    assert 2 not in steps._missed
    line.note(poll(2), ResultKind.REPLY)
    assert steps._missed == {}


def test_drive_that_answers_short_reads_only_is_sent_no_longer_ones() -> None:
    line = _Line()
    noted: list[object] = []
    probes = line.steps._probes
    probes.forms.note_silence = noted.append  # type: ignore[assignment,method-assign]
    for kind, silences in ((ResultKind.EXCEPTION, 0), (ResultKind.REPLY, 1), (ResultKind.REPLY, 1)):
        if silences == len(noted):
            probes.silent.add(2)
        if kind is ResultKind.REPLY and not noted:
            probes.silent.add(1)
        line.note(poll(1), kind)
        assert noted == [1] * silences
        assert 1 not in probes.silent


def test_stray_frame_of_another_drive_ends_the_proof_of_that_drive() -> None:
    line = _Line()
    line.steps._proved |= {1, 2, 3}
    line.note(poll(1), ResultKind.REPLY, reply(bytes([2]) + poll().pdu + bytes(2)))
    assert line.steps._proved == {1, 3}


@pytest.mark.parametrize(("code", "earlier"), [(0x83, True), (0x86, False)])
def test_refusal_of_an_earlier_function_may_be_an_earlier_reply(code: int, earlier: bool) -> None:
    line = _Line()
    line.note(poll(1), ResultKind.REPLY)
    piece = Piece(frame(1, bytes([code, 2])), whole=True)
    assert line.steps._is_earlier(piece) == earlier
    assert line.steps._is_earlier(Piece(reply(bytes([1]) + poll().pdu + bytes(2)), whole=True))
    assert not line.steps._is_earlier(Piece(reply(bytes([1]) + poll(2).pdu + bytes(2)), whole=True))


def test_line_is_behind_if_the_request_after_the_drain_was_sent_after_it() -> None:
    line = _Line()
    steps = line.steps
    earlier = reply(bytes([1]) + poll(1).pdu + bytes(2))
    line.note(poll(1), ResultKind.NOTHING)
    steps._shifts, steps.quiet_until = 1, 5.0
    for sent, ended, behind in ((4.9, 5.2, False), (5.0, 5.2, True)):
        line.now = ended
        pieces = [Piece(earlier, whole=True)]
        result = ExchangeResult(ResultKind.WRONG, sent=sent, strays=pieces)
        steps.note(poll(2), Read(1, 100, 2).expectation(), result)
        assert bool(steps.behind) == behind


def test_write_whose_reply_is_like_the_last_one_is_preceded_by_another_form() -> None:
    line = _Line()
    write = Job(WriteOne(1, 7, 7), Priority.OPERATOR_WRITE, FEW)
    for job in (poll(limits=FEW), write):
        line.note(job, ResultKind.NOTHING)
    line.devices[1].outstanding.clear()
    again = Job(WriteOne(1, 7, 7), Priority.OPERATOR_WRITE, FEW)
    assert line.steps.prepare(again) == Read(1, 7, 1), "unlike the last one at least"
    assert again.probes == 1
    line.note(poll(limits=FEW), ResultKind.NOTHING)
    assert line.steps.prepare(again) is None, "the write itself is unlike the last one"
    assert again.probes == 2
    again.probes = 4
    line.steps._weak.clear()
    assert line.steps.prepare(again) is None
    assert (again.probes, line.steps._weak) == (4, set())


class _Sent(_Answers):
    """A master that keeps what it was given; without an answer, the line is lost."""

    def __init__(self, kind: ResultKind | None, line: _Line) -> None:
        super().__init__(kind or ResultKind.NOTHING)
        self._result.sent, self._result.turnaround, self._result.end = 1.25, 0.125, 1.5
        self.lost, self.line = kind is None, line
        self.sent: list[Sending] = []

    async def exchange(self, sending: Sending) -> ExchangeResult:
        self.sent.append(sending)
        self.line.now += 0.5
        if self.lost:
            raise LineLost("unplugged")
        return self._result


@pytest.mark.parametrize("kind", [*ResultKind, None])
async def test_probe_is_sent_like_its_job_and_its_end_is_noted(kind: ResultKind | None) -> None:
    line = _Line()
    counted: list[int] = []
    strays: list[float] = []
    late: list[tuple[object, ...]] = []
    line.outcomes.count_beside = (  # type: ignore[method-assign]
        lambda device, result: counted.append(device)
    )
    line.outcomes.note_strays = lambda _, end: strays.append(end) or set()  # type: ignore
    line.devices.may_come = lambda *those: late.append(those)  # type: ignore
    job = Job(Read(1, 100, 1), Priority.BACKGROUND, SILENT)
    probe = Read(1, 100, 2)
    seconds = line.devices.time_out(1, 3, Priority.BACKGROUND, None)
    master = _Sent(kind, line)
    if kind is None:
        with pytest.raises(LineLost):
            await line.steps.prove(cast(Master, master), job, probe)
        assert late == [(1, probe.expectation(), 1.0, 1.5)]
        assert line.steps._missed == {}
        return
    result = await line.steps.prove(cast(Master, master), job, probe)
    (sending,) = master.sent
    assert (sending.device, sending.pdu) == (1, probe.pdu())
    assert (sending.expectation, sending.time_out) == (probe.expectation(), seconds)
    answered = kind in (ResultKind.REPLY, ResultKind.EXCEPTION)
    assert result.kind is kind
    assert (counted, strays) == (([1], [1.5]) if answered else ([], []))
    unanswered = kind in (ResultKind.NOTHING, ResultKind.DAMAGED, ResultKind.WRONG)
    assert late == ([(1, probe.expectation(), 1.25, 1.5)] if unanswered else [])
    record = line.devices[1]
    assert (record.ever_answered, record.refused) == (answered, kind is ResultKind.EXCEPTION)
    assert (record.heard == 1.5) == answered
    assert (1 in line.steps._probes.silent) == (kind is ResultKind.NOTHING)


async def test_silence_to_an_echo_is_not_one_to_a_longer_read() -> None:
    line = _Line()
    job = Job(Read(1, 100, 1), Priority.POLL, SILENT)
    await line.steps.prove(cast(Master, _Sent(ResultKind.NOTHING, line)), job, Diagnose(1, 0, 7))
    assert line.steps._probes.silent == set()


@pytest.mark.parametrize(
    ("kind", "last", "gateway", "quiet_until", "cleared"),
    [
        (ResultKind.REPLY, 2, False, 0.0, True),
        (ResultKind.REPLY, 1, False, 0.0, False),
        (ResultKind.REPLY, 2, True, 0.0, False),
        (ResultKind.NOTHING, 2, False, 0.0, False),
        (ResultKind.NOTHING, 1, False, 1.0, True),
        (ResultKind.NOTHING, 1, False, 1.1, False),
        (ResultKind.EXCEPTION, 1, True, 0.9, True),
    ],
)
def test_exchange_without_an_earlier_reply_ends_a_suspicion(
    kind: ResultKind, last: int, gateway: bool, quiet_until: float, cleared: bool
) -> None:
    line = _Line(gateway=gateway)
    steps = line.steps
    steps._last, steps._shifts, steps.quiet_until = last, 1, quiet_until
    line.note(poll(1), kind)
    assert steps._shifts == (0 if cleared else 1)
    assert steps.quiet_until == (0.0 if cleared else quiet_until)
    assert steps._last == 1


def test_two_earlier_replies_in_a_row_drain_the_line_and_two_after_it_are_one_behind() -> None:
    line = _Line()
    steps = line.steps
    jobs = [poll(count) for count in (1, 2, 3, 4)]
    earlier = [reply(bytes([1]) + job.pdu + bytes(2)) for job in jobs]
    line.note(jobs[0], ResultKind.NOTHING)
    line.note(jobs[1], ResultKind.WRONG, earlier[0])
    assert steps.quiet_until == 0.0
    line.note(jobs[2], ResultKind.WRONG, earlier[1])
    due = steps.quiet_until
    assert line.now + Timing().first_timeout <= due <= line.now + 10.0
    line.now = due - 0.01
    line.note(jobs[3], ResultKind.WRONG, earlier[2])
    assert not steps.behind, "sent before the line was quiet"
    line.now = due
    line.note(jobs[0], ResultKind.WRONG, earlier[3])
    assert steps.behind.startswith("Replies are one behind")
    assert steps.reopen
    assert steps._witness is jobs[0]


def test_frame_between_exchanges_is_late_and_not_held_back() -> None:
    line = _Line()
    steps = line.steps
    steps._proved |= {1, 2}
    steps._shifts, steps.quiet_until = 1, 5.0
    steps.stray(Piece(reply(bytes([1]) + poll().pdu + bytes(2)), whole=True))
    assert (steps._proved, steps._shifts, steps.quiet_until) == ({2}, 0, 0.0)


@pytest.mark.parametrize("kind", list(ResultKind))
def test_lengthened_read_that_is_refused_waits_again_as_itself(kind: ResultKind) -> None:
    line = _Line()
    noted: list[tuple[Read, ResultKind]] = []
    line.steps._probes.forms.note = (  # type: ignore[method-assign]
        lambda form, result: noted.append((form, result.kind))
    )
    strays: list[tuple[object, float]] = []
    counted: list[object] = []

    def note_strays(these: object, end: float) -> set[int]:
        strays.append((these, end))
        return set()

    line.outcomes.note_strays = note_strays  # type: ignore[method-assign,assignment]
    line.outcomes.count_beside = (  # type: ignore[method-assign]
        lambda device, result: counted.append((device, result))
    )
    result = ExchangeResult(kind, sent=0.9, end=0.95)
    assert not line.steps.end_form(poll(), result)
    assert noted == []
    assert strays == []
    job, form = poll(), Read(1, 100, 3)
    job.take_form(form)
    refused = kind is ResultKind.EXCEPTION
    assert line.steps.end_form(job, result) == refused
    assert noted == [(form, kind)]
    assert strays == [(result.strays, 0.95)] * refused
    assert counted == [(1, result)] * refused
    assert job.form == (None if refused else form)
    late = line.devices.not_before(1, form.expectation(), Priority.POLL, 1.0) > 1.0
    assert late == refused, "a copy of the refusal may come"


@pytest.mark.parametrize(
    ("request_", "within", "probes"),
    [
        (Identify(1), None, True),
        (Read(1, 100, 1), 0.5, True),
        (Read(1, 100, 1), None, False),
    ],
)
def test_request_that_needs_no_proof_is_sent_as_it_is(
    request_: Request, within: float | None, probes: bool
) -> None:
    line = _Line()
    line.note(poll(1), ResultKind.NOTHING)
    job = Job(request_, Priority.POLL, WIDE, within=within)
    line.steps._timing = replace(Timing(), probes=probes)
    assert line.steps.prepare(job) is None
    assert (job.form, job.probes) == (None, 0)


def test_repeat_of_a_request_without_a_reply_is_sent_as_it_was() -> None:
    line = _Line()
    line.note(poll(2), ResultKind.REPLY)
    line.note(poll(1), ResultKind.NOTHING)
    repeat, other = poll(1), poll(1, register=101)
    repeat.repeats = other.repeats = 1
    line.steps.prepare(repeat)
    assert repeat.form is None
    line.steps.prepare(other)
    assert other.form is not None, "a late reply to the first one has its length"


def test_new_connection_trusts_no_drive_and_forgets_requests_unless_it_is_behind() -> None:
    fields = (
        "_proved", "_weak", "_missed", "_shifts", "_tries", "_next_try", "_waited", "quiet_until",
        "reopen",
    )  # fmt: skip
    for behind in ("", "Replies are one behind."):
        line, new = _Line(), _Line()
        steps = line.steps
        steps._proved, steps._weak, steps._missed = {1}, {1}, {1: b"read"}
        steps._shifts, steps._tries, steps._next_try, steps._waited = 3, 3, 3.0, 3.0
        steps.quiet_until, steps.reopen, steps.behind = 3.0, True, behind
        steps._probes.heard = True
        steps._probes.sent(1).append(Read(1, 100, 1).expectation())
        steps.opened()
        for name in fields:
            value = getattr(steps, name)
            assert value == getattr(new.steps, name), name
            assert not value, name
        assert not steps._probes.heard
        assert len(steps._probes.sent(1)) == (1 if behind else 0)


class _Quiet(_Answers):
    """A master that notes when it kept the line quiet."""

    quiets = 0

    async def quiet(self) -> None:
        self.quiets += 1


def _behind(kind: ResultKind, witness: Job) -> tuple[_Line, Master, InStep]:
    line = _Line()
    steps = line.steps
    steps.behind, steps._witness = "Replies are one behind.", witness
    return line, cast(Master, _Quiet(kind)), steps


@pytest.mark.parametrize(
    ("kind", "recovers"),
    [
        (ResultKind.REPLY, True),
        (ResultKind.NOTHING, False),
        (ResultKind.EXCEPTION, False),
    ],
)
async def test_line_that_is_behind_is_checked_by_two_requests(
    kind: ResultKind, recovers: bool
) -> None:
    line, master, steps = _behind(kind, poll(2))
    line.steps._probes.sent(1).append(Read(1, 100, 2).expectation())
    steps._shifts = 1
    steps._next_try = 3.0
    assert await steps.attend(master) == 2.0
    assert cast(Any, master).quiets == 0
    line.now = 3.0
    assert await steps.attend(master) == 0.0
    assert cast(Any, master).quiets == 1
    assert bool(steps.behind) == (not recovers)
    if recovers:
        return
    assert (steps._tries, steps._rounds) == (1, 0)
    steps._next_try = 0.0
    assert await steps.attend(master) == 0.0
    assert (steps._tries, steps._rounds) == (2, 1)
    assert steps._next_try == 3.0 + Timing().first_timeout
    assert steps.behind, "an earlier reply came last"
    assert not steps.reopen
    line.now = steps._next_try
    assert await steps.attend(master) == 0.0
    assert steps.reopen
    assert cast(Any, master).quiets == 2


async def test_line_without_any_further_sign_is_in_step_and_is_checked_seldom_later() -> None:
    line, master, steps = _behind(ResultKind.EXCEPTION, poll(2))
    steps._tries, steps._rounds = 1, 2
    await steps.attend(master)
    assert steps.behind == ""
    assert steps._next_try == line.now + 10.0


async def test_line_with_one_form_waits_until_a_probe_is_unlike_late_replies() -> None:
    line, master, steps = _behind(ResultKind.REPLY, poll(1, replace(FEW, max_read=1)))
    read = Read(1, 100, 1).expectation()
    for register in (100, 101):
        steps._probes.sent(1).append(Read(1, register, 1).expectation())
    waits = 0
    while (seconds := await steps.attend(master)) > 0.0:
        assert seconds == 0.2
        waits += 1
        assert waits < 100
    assert waits in (50, 51), "ten seconds"
    assert cast(Any, master).quiets == 0
    assert steps._tries == 2
    assert steps.behind, "nothing was sent that could prove it"
    assert read in steps._probes.sent(1)
    assert line.steps._rounds == 1
