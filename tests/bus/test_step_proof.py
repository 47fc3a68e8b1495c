"""A line whose holder was killed: late replies to it are never taken for other replies."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineLost, NoAnswer
from tui.bus.limits import Limits
from tui.bus.line import Line
from tui.bus.master import ExchangeResult, ResultKind, Sending
from tui.bus.requests import Read, Request, WriteOne
from tui.bus.schedule.queue import Job
from tui.bus.schedule.step_proof import StepProof

from .conftest import NO_ECHO, WIDE, OpenLine, Share, sent
from .peer import PtyPeer, Step, eventually, reply
from .sharing import QUICK, OtherProgram, other_program

LATE = 2.5
"""Seconds for which a reply may be late."""
SLOW, OTHER = 77, 8


def slow(request: bytes, _count: int) -> Sequence[Step]:
    return [0.5, reply(request)] if request[3] == SLOW else [reply(request)]


def never_echoes(request: bytes, count: int) -> Sequence[Step]:
    return [] if request[1] == 8 else slow(request, count)


def functions(peer: PtyPeer) -> list[int]:
    return [request[1] for request in peer.requests]


async def killed_while_it_waits(owner: OtherProgram, peer: PtyPeer) -> float:
    """Kill the holder of a line while a reply to it is on its way; returns when."""
    owner.tell("read 1")
    owner.tell(f"ask {SLOW}")
    await asyncio.to_thread(peer.await_requests, 2)
    return await asyncio.to_thread(owner.kill)


def next_program(share: Share, peer: PtyPeer, limits: Limits, patience: float = 1.5) -> Line:
    """A program that opens the line after it, and waits this many seconds for a reply."""
    timing = replace(QUICK, late_reply=LATE, first_timeout=patience, min_timeout=patience)
    line = share(peer.path).open("watch", timing=timing)
    line.describe(1, limits)
    return line


async def test_values_return_once_the_drive_has_echoed_a_number(
    share: Share, tmp_path: Path
) -> None:
    with PtyPeer(slow) as peer, other_program(peer.path, tmp_path, "run", LATE) as owner:
        killed = await killed_while_it_waits(owner, peer)
        line = await asyncio.to_thread(next_program, share, peer, WIDE)
        # the reply to the killed program arrives first, and has the form of the reply to this read
        assert (await line.read(1, OTHER)).words == (OTHER,)
        assert time.monotonic() - killed < 1.0
        # the read between shows if the adapter echoes
        assert functions(peer) == [3, 3, 3, 8, 3]
        await line.read(1, OTHER)
        assert functions(peer) == [3, 3, 3, 8, 3, 3], "once is enough"


@pytest.mark.parametrize("why", ["it has no echo", "it never echoes"])
async def test_drive_without_echo_waits_until_no_late_reply_can_come(
    share: Share, tmp_path: Path, why: str
) -> None:
    drive, limits = (slow, NO_ECHO) if why == "it has no echo" else (never_echoes, WIDE)
    with PtyPeer(drive) as peer, other_program(peer.path, tmp_path, "run", LATE) as owner:
        killed = await killed_while_it_waits(owner, peer)
        line = await asyncio.to_thread(next_program, share, peer, limits, 0.8)
        assert (await line.read(1, OTHER)).words == (OTHER,)
        assert time.monotonic() - killed >= LATE
        assert functions(peer).count(8) <= 2


async def test_stop_words_do_not_wait_for_the_proof(share: Share, tmp_path: Path) -> None:
    with PtyPeer(slow) as peer, other_program(peer.path, tmp_path, "run", LATE) as owner:
        killed = await killed_while_it_waits(owner, peer)
        line = await asyncio.to_thread(next_program, share, peer, NO_ECHO)
        other = asyncio.create_task(line.write(1, 1, [15]))
        stop = asyncio.create_task(line.write(1, 1, [0], priority=Priority.STOP))
        await asyncio.to_thread(eventually, lambda: 6 in functions(peer))
        assert time.monotonic() - killed < 1.0
        assert peer.requests[-1][5] == 0
        await asyncio.gather(stop, other, return_exceptions=True)
        assert time.monotonic() - killed >= LATE


def busy_once(request: bytes, count: int) -> Sequence[Step]:
    """A drive that receives all requests and answers them in order."""
    return [0.55 if count == 0 else 0.03, reply(request)]


def doubting(open_line: OpenLine, peer: PtyPeer, seconds: float) -> Line:
    """A line whose last holder was killed: a late reply may arrive for this many seconds."""
    timing = replace(QUICK, late_reply=LATE, first_timeout=0.2, min_timeout=0.2)
    line = open_line(peer.path, timing)
    line._engine._dispatcher.proof.doubt(time.monotonic() + seconds)
    return line


async def test_late_replies_to_a_failed_proof_are_not_used(
    open_line: OpenLine,
) -> None:
    with PtyPeer(busy_once) as peer:
        line = doubting(open_line, peer, 0.3)
        found = []
        for register in (SLOW, OTHER, 9, 10):
            with suppress(NoAnswer):
                answer = await line.read(1, register, priority=Priority.OPERATOR_READ)
                found.append((register, answer.words[0]))
        assert [wanted for wanted, _ in found] == [word for _, word in found]
        assert len(found) >= 3


async def test_write_that_waits_for_a_proof_can_be_cancelled(open_line: OpenLine) -> None:
    with PtyPeer(never_echoes) as peer:
        line = doubting(open_line, peer, 1.2)
        write = asyncio.create_task(line.write(1, 1, [15]))
        await asyncio.to_thread(eventually, lambda: 8 in functions(peer))
        write.cancel()
        await line.read(1, OTHER)
        assert 6 not in functions(peer)


async def test_stop_waits_for_one_request_of_a_proof_at_most(open_line: OpenLine) -> None:
    def silent_at_1(request: bytes, _count: int) -> Sequence[Step]:
        return [] if request[0] == 1 else [reply(request)]

    with PtyPeer(silent_at_1) as peer:
        line = doubting(open_line, peer, 5.0)
        reading = asyncio.create_task(line.read(1, OTHER))
        await asyncio.to_thread(peer.await_requests, 1)
        await line.write(2, 1, [0], priority=Priority.STOP)
        # nor does a healthy drive wait for a silent one
        await line.read(2, OTHER)
        assert [data[0] for data in peer.requests][:2] == [1, 2]
        assert [data[0] for data in peer.requests].count(1) == 1
        reading.cancel()


def writes(peer: PtyPeer) -> list[int]:
    """The words that were written, in their order."""
    return [word for _, word in peer.words_written]


async def test_stop_is_repeated_when_line_is_quiet(open_line: OpenLine) -> None:
    with PtyPeer(slow) as peer:
        line = doubting(open_line, peer, 0.6)
        line.describe(1, NO_ECHO)
        until = time.monotonic() + 0.6
        run = asyncio.create_task(line.write(1, 1, [15]))
        await line.write(1, 1, [0], priority=Priority.STOP)
        assert time.monotonic() < until
        await run
        assert writes(peer) == [0, 0, 15], "before what starts the motor again"
        times = [at for at, number in zip(sent(line), functions(peer), strict=True) if number == 6]
        assert times[0] < until - 0.3 < until - 0.1 < times[1]


async def test_stop_is_repeated_when_drive_has_echoed_a_number(open_line: OpenLine) -> None:
    with PtyPeer(slow) as peer:
        line = doubting(open_line, peer, 60.0)
        await line.write(1, 1, [0], priority=Priority.STOP)
        await asyncio.to_thread(eventually, lambda: writes(peer) == [0, 0])
        assert functions(peer) == [6, 3, 8, 6]
        await line.write(1, 1, [0], priority=Priority.STOP)
        await line.read(1, OTHER)
        assert functions(peer) == [6, 3, 8, 6, 6, 3], "once is enough"


async def test_unanswered_stop_is_repeated(open_line: OpenLine) -> None:
    def deaf_at_first(request: bytes, count: int) -> Sequence[Step]:
        return [] if count == 0 else [reply(request)]

    with PtyPeer(deaf_at_first) as peer:
        line = doubting(open_line, peer, 0.6)
        line.describe(1, NO_ECHO)
        with pytest.raises(NoAnswer):
            await line.write(1, 1, [0], priority=Priority.STOP)
        await asyncio.to_thread(eventually, lambda: writes(peer) == [0, 0])


async def test_only_last_stop_of_a_drive_is_repeated(open_line: OpenLine) -> None:
    with PtyPeer(slow) as peer:
        line = doubting(open_line, peer, 0.6)
        line.describe(1, NO_ECHO)
        for word in (7, 0):
            await line.write(1, 1, [word], priority=Priority.STOP)
        await line.read(1, OTHER)
        assert writes(peer) == [7, 0, 0]


async def test_stop_of_one_drive_precedes_the_repeat_of_another(open_line: OpenLine) -> None:
    with PtyPeer(never_echoes) as peer:
        line = doubting(open_line, peer, 60.0)
        await line.write(1, 1, [0], priority=Priority.STOP)
        before = len(peer.requests)
        await line.write(2, 1, [0], priority=Priority.STOP)
        # one of them may have been on the line
        assert 2 in [request[0] for request in peer.requests[before : before + 2]]


# -- without a line --------------------------------------------------------------------------------

STOP_WORDS = WriteOne(1, 8501, 0)
LAST = 100.0
"""The line's time until which a late reply may come."""


class Doubts:
    """A proof whose time the test sets; `answers` are the ends of its exchanges, in order."""

    def __init__(self, *answers: ResultKind, echo: bool | None = None) -> None:
        self.now = LAST - 1.0
        self.repeats: list[Job] = []
        self.sent: list[tuple[bytes, float]] = []
        self.late: list[tuple[object, ...]] = []
        self.noted: list[tuple[ResultKind | None, bool]] = []
        self.counted: list[tuple[int, object]] = []
        self.recorded: list[tuple[object, ...]] = []
        self.echo = echo
        self._answers = list(answers)
        devices = SimpleNamespace(
            time_out=lambda *about: float(len(about)),
            may_come=lambda *those: self.late.append(those),
        )
        steps = SimpleNamespace(
            note=lambda job, form, result, number: self.noted.append(
                (result and result.kind, number)
            )
        )
        outcomes = SimpleNamespace(
            count_beside=lambda *those: self.counted.append(those),
            record=lambda *those: self.recorded.append(those),
        )
        self.proof = StepProof(
            cast(Any, devices), cast(Any, outcomes), lambda: self.now, self.repeats.append,
            cast(Any, steps),
        )  # fmt: skip
        self.proof.doubt(LAST)

    async def exchange(self, sending: Sending) -> ExchangeResult:
        """Answer as the wire would."""
        assert self.proof.busy
        self.sent.append((sending.pdu, sending.time_out))
        self.now += 0.25
        if not self._answers:
            raise LineLost("unplugged")
        return ExchangeResult(self._answers.pop(0), sent=self.now - 0.125)

    async def prove(self, job: Job) -> None:
        await self.proof.prove(cast(Any, self), job)
        assert not self.proof.busy


def job(
    request: Request = Read(1, OTHER, 1),  # noqa: B008 - never changed
    priority: Priority = Priority.OPERATOR_READ,
    limits: Limits = WIDE,
) -> Job:
    return Job(request, priority, limits)


def test_reply_is_doubted_until_the_time_and_not_at_it() -> None:
    doubts = Doubts()
    proof, waiting = doubts.proof, job()
    for doubts.now, doubted in ((LAST - 1, True), (LAST, False), (LAST + 1, False)):
        assert (proof.is_due(waiting), proof.doubts_refusal(1)) == (doubted, doubted)
    proof._proved.add(1)
    doubts.now = LAST - 1
    assert (proof.is_due(waiting), proof.doubts_refusal(1)) == (False, False)
    assert proof.doubts_refusal(2), "each drive proves its own step"
    proof.doubt(LAST)
    assert proof.is_due(waiting), "a new holder that was killed ends every proof"


def test_request_waits_for_the_time_if_its_drive_cannot_echo() -> None:
    proof = Doubts().proof
    before = LAST - 1.0
    no_echo = replace(WIDE, subfunctions=frozenset({10}))
    assert proof.not_before(job(), before) == 0.0
    for limits in (NO_ECHO, no_echo):
        assert proof.not_before(job(limits=limits), before) == LAST
        assert proof.not_before(job(limits=limits), LAST) == 0.0
    assert proof.not_before(job(WriteOne(0, 8501, 0)), before) == LAST, "a broadcast has no echo"
    for tries, ready in ((2, 0.0), (3, LAST)):
        proof._tries[1] = tries
        assert proof.not_before(job(), before) == ready
        assert proof.not_before(job(Read(2, OTHER, 1)), before) == 0.0


def test_only_the_words_of_a_stop_go_out_unproved() -> None:
    proof = Doubts().proof
    before = LAST - 1.0
    assert not proof.is_due(job(STOP_WORDS, Priority.STOP))
    assert proof.is_due(job(STOP_WORDS, Priority.OPERATOR_WRITE))
    assert proof.is_due(job(priority=Priority.STOP)), "a read before a stop"
    assert proof.not_before(job(STOP_WORDS, Priority.STOP, NO_ECHO), before) == 0.0


def test_stop_that_was_sent_unproved_is_repeated_once_as_background_work() -> None:
    doubts = Doubts()
    proof, stop = doubts.proof, job(STOP_WORDS, Priority.STOP, NO_ECHO)
    assert not proof.repeats_wait
    proof.sent(job(STOP_WORDS, Priority.OPERATOR_WRITE), LAST - 1)
    proof.sent(stop, LAST)
    assert doubts.repeats == []
    proof.sent(stop, LAST - 1)
    (first,) = doubts.repeats
    assert (first.request, first.priority, first.limits) == (STOP_WORDS, Priority.FEED, NO_ECHO)
    assert first.requested == LAST - 1
    assert proof.repeats_wait
    proof.sent(stop, LAST - 0.5)
    second = doubts.repeats[1]
    assert first.answer.cancelled(), "only the last one is repeated"
    assert not second.answer.done()
    proof._proved.add(1)
    proof.sent(stop, LAST - 0.5)
    assert len(doubts.repeats) == 2
    proof.doubt(LAST + 10)
    assert second.answer.cancelled()
    assert not proof.repeats_wait


async def test_drive_proves_its_step_by_an_echo_after_a_read_that_shows_the_adapters_own() -> None:
    doubts = Doubts(ResultKind.REPLY, ResultKind.REPLY)
    waiting = job(limits=WIDE)
    await doubts.prove(waiting)
    assert doubts.proof.is_due(waiting), "the reply to a read proves nothing"
    doubts.echo = False
    await doubts.prove(waiting)
    assert not doubts.proof.is_due(waiting)
    (read, seconds), (echo, _) = doubts.sent
    assert (read, seconds) == (Read(1, OTHER, 1).pdu(), 4.0)
    assert echo[:3] == bytes([8, 0, 0])
    assert doubts.noted == [(ResultKind.REPLY, False), (ResultKind.REPLY, True)]
    assert [device for device, _ in doubts.counted] == [1, 1]
    assert doubts.late == []


@pytest.mark.parametrize(
    ("limits", "tries"), [(WIDE, 2), (replace(WIDE, functions=frozenset({6, 8})), 0)]
)
async def test_echo_is_requested_without_a_read_at_the_last_try_or_if_none_is_allowed(
    limits: Limits, tries: int
) -> None:
    doubts = Doubts(ResultKind.REPLY)
    doubts.proof._tries[1] = tries
    await doubts.prove(job(limits=limits))
    assert [pdu[0] for pdu, _ in doubts.sent] == [8]
    assert doubts.proof._tries[1] == tries + 1


@pytest.mark.parametrize("answer", [ResultKind.NOTHING, ResultKind.EXCEPTION, ResultKind.DAMAGED])
async def test_failed_proof_leaves_its_reply_expected_and_a_silent_drive_waits(
    answer: ResultKind,
) -> None:
    doubts = Doubts(answer, echo=False)
    waiting = job()
    await doubts.prove(waiting)
    assert doubts.proof.is_due(waiting)
    silent = answer is ResultKind.NOTHING
    assert doubts.proof.not_before(waiting, LAST - 1) == (LAST if silent else 0.0)
    if answer is ResultKind.EXCEPTION:
        assert doubts.late == []
    else:
        ((device, _, sent_at, now),) = doubts.late
        assert (device, sent_at, now) == (1, LAST - 0.875, LAST - 0.75)


async def test_proof_on_a_lost_line_leaves_its_reply_expected_from_its_start() -> None:
    doubts = Doubts(echo=False)
    with pytest.raises(LineLost):
        await doubts.prove(job())
    assert not doubts.proof.busy
    ((device, _, sent_at, now),) = doubts.late
    assert (device, sent_at, now) == (1, LAST - 1.0, LAST - 0.75)
    assert doubts.noted == []
