"""Steps of the dispatcher without a wire: what it sends, repeats, holds back and fails."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import AsyncMock, Mock

import pytest

from tui.bus.api import Priority
from tui.bus.errors import (
    LineBehind,
    LineBusy,
    LineClosed,
    LineError,
    LineFailed,
    LineLost,
    RequestRefused,
)
from tui.bus.line import Timing
from tui.bus.master import ExchangeResult, Piece, ResultKind, Sending
from tui.bus.model import Reply
from tui.bus.requests import BROADCAST, Read, Request, WriteOne
from tui.bus.schedule import dispatcher as dispatchers
from tui.bus.schedule.dispatcher import HELD_LOOK, Dispatcher
from tui.bus.schedule.outcomes import Next
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import Job
from tui.bus.tally import Tally

from .conftest import NO_ECHO, WIDE

READ, WRITE = Read(1, 100, 1), WriteOne(1, 100, 7)
PDU = bytes([3, 2, 0, 100])
NOW = 1000.0


def job_of(
    request: Request = READ, priority: Priority = Priority.POLL, requested: float = NOW, **more: Any
) -> Job:
    return Job(request, priority, more.pop("limits", WIDE), requested=requested, **more)


def result_of(kind: ResultKind, **more: Any) -> ExchangeResult:
    return ExchangeResult(kind, sent=NOW + 1, end=NOW + 2, **more)


REPLY = result_of(ResultKind.REPLY, pdu=PDU)
NOTHING = result_of(ResultKind.NOTHING)


class Rig:
    """A dispatcher whose parts note their calls, and a master with given results."""

    def __init__(self, *results: ExchangeResult | BaseException) -> None:
        self.now = NOW
        timing = Timing(queue_length=4)
        devices = Devices(timing, mistakable=True)
        self.it: Any = Dispatcher(devices, Tally(), timing, lambda: self.now, gateway=False)
        self.it._outcomes = self.outcomes = Mock()
        self.it.steps = self.steps = Mock(behind="", reopen=False)
        self.it.proof = self.proof = Mock()
        self.it._devices = self.devices = Mock(quiet_until=0.0)
        self.it._back_to_back = self.back_to_back = Mock()
        self.it._alive_reads = Mock()
        self.it._alive_reads.put_due.return_value = math.inf
        self.outcomes.values.find.return_value = None
        self.outcomes.waited_for_us.return_value = False
        self.outcomes.conclude.return_value = Next.NOTHING
        self.steps.refuses.return_value = False
        self.steps.prepare.return_value = None
        self.steps.not_before.return_value = None
        self.steps.end_form.return_value = False
        self.steps.lengthen.return_value = False
        self.proof.is_due.return_value = False
        self.proof.not_before.return_value = 0.0
        self.proof.doubts_refusal.return_value = False
        self.back_to_back.not_before.return_value = 0.0
        self.devices.backed_off.return_value = None
        self.devices.not_before.return_value = 0.0
        self.devices.is_repeat.return_value = False
        self.devices.doubts.return_value = (True, 2)
        self.devices.time_out.return_value = 0.5
        self.master: Any = SimpleNamespace(
            echo=None, failure=None, quiet=AsyncMock(), exchange=self._exchange
        )
        self.results = list(results)
        self.sent: list[Sending] = []
        self.flights: list[bool] = []

    async def _exchange(self, sending: Sending) -> ExchangeResult:
        sending.look()
        self.sent.append(sending)
        self.flights.append(self.it.in_flight)
        self.now += 3.0
        result = self.results.pop(0)
        if isinstance(result, BaseException):
            raise result
        return result

    @property
    def waiting(self) -> list[Job]:
        return list(self.it._queue._jobs)

    async def run(self, job: Job) -> None:
        await self.it._run(self.master, job)


def error_of(job: Job) -> BaseException:
    error = job.answer.exception(0)
    assert error is not None
    return error


# -- the queue -------------------------------------------------------------------------------------


def test_submitted_job_waits_and_wakes_the_line() -> None:
    rig, job = Rig(), job_of()
    rig.it.submit(job)
    assert (rig.waiting, rig.it._wake.is_set()) == ([job], True)
    for priority in (Priority.STOP, Priority.POLL):
        jobs = [job_of(priority=priority) for _ in range(3)]
        for each in jobs:
            rig.it.submit(each)
        assert (jobs[-1] in rig.waiting) == (priority is Priority.STOP)
        if priority is Priority.POLL:
            assert isinstance(error_of(jobs[-1]), LineBusy)


@pytest.mark.parametrize("refused", [True, False])
def test_job_that_ends_unsent_does_not_wait(refused: bool) -> None:
    rig, job = Rig(), job_of()
    rig.steps.refuses.return_value = refused
    rig.devices.backed_off.return_value = None if refused else 2.0
    rig.it.submit(job)
    assert rig.waiting == []
    assert job.answer.done() is not refused
    rig.it.wake()
    assert rig.it._wake.is_set()


def test_read_is_answered_by_words_that_are_recent_enough() -> None:
    rig, job = Rig(), job_of(max_age=1.5)
    rig.outcomes.values.find.return_value = reply = Reply((100,), NOW)
    rig.it.submit(job)
    rig.outcomes.values.find.assert_called_once_with(READ, NOW - 1.5)
    assert job.answer.result(0) is reply


def test_refusal_is_that_of_the_state_that_the_programs_share() -> None:
    rig = Rig()
    rig.it.facts = Mock(paused={1: ("another", "polling is paused")})
    assert rig.it.refusal(job_of(program="this")) == "polling is paused"


async def test_all_that_waits_is_taken_out_once_something_does() -> None:
    rig, job = Rig(), job_of()
    rig.it.wake()
    taking = asyncio.create_task(rig.it.all_waiting())
    for _ in range(3):
        await asyncio.sleep(0)
    assert not taking.done()
    rig.it.put_back(job)
    assert await asyncio.wait_for(taking, 5.0) == [job]
    assert rig.waiting == []
    rig.it.put_back(job)
    assert rig.it._wake.is_set()
    assert await asyncio.wait_for(rig.it.all_waiting(), 5.0) == [job]


@pytest.mark.parametrize(
    ("behind", "kind", "kept"),
    [
        ("one behind", LineLost, 1), ("", LineLost, 0), ("one behind", LineClosed, 0),
        ("one behind", LineBehind, 1),
    ],
)  # fmt: skip
def test_waiting_jobs_fail_without_a_line_and_a_stop_word_may_be_kept(
    behind: str, kind: type[LineError], kept: int
) -> None:
    rig = Rig()
    jobs = [job_of(), job_of(WRITE, Priority.STOP)]
    for job in jobs:
        rig.it.put_back(job)
    rig.steps.behind = behind
    rig.it.fail_all("unplugged", kind)
    assert [(type(error_of(job)), str(error_of(job))) for job in jobs] == [(kind, "unplugged")] * 2
    assert [job.request for job in rig.waiting] == [WRITE] * kept
    job = job_of()
    rig.it.fail(job, "unplugged")
    assert type(error_of(job)) is LineLost


def test_stop_refuses_older_commands_that_wait() -> None:
    rig = Rig()
    at = {name: job_of(WRITE, Priority.OPERATOR_WRITE, NOW + n) for n, name in enumerate("abc")}
    stop, poll = job_of(WRITE, Priority.STOP, NOW - 9), job_of(requested=NOW - 9)
    for job in (*at.values(), stop, poll):
        rig.it.put_back(job)
    rig.it.void_older(NOW + 1, "a stop came")
    assert rig.waiting == [at["b"], at["c"], stop, poll]
    assert (type(error_of(at["a"])), str(error_of(at["a"]))) == (RequestRefused, "a stop came")
    rig.it.refusal = lambda job: "void" if job is at["b"] else ""
    rig.it.void()
    assert rig.waiting == [at["c"], stop, poll]
    assert str(error_of(at["b"])) == "void"


def test_stray_frame_is_noted_and_wakes_the_line() -> None:
    rig, piece = Rig(), Piece(bytes([5, *PDU, 0, 0]), True)
    rig.it.stray(piece, 7.0)
    (device, pdu, alone), _ = rig.outcomes.record.call_args
    assert (device, pdu, alone.kind, alone.strays) == (5, b"", ResultKind.NOTHING, [piece])
    assert (alone.sent, alone.end) == (7.0, 7.0)
    rig.outcomes.note_stray.assert_called_once_with(piece, 7.0)
    rig.steps.stray.assert_called_once_with(piece)
    assert rig.it._wake.is_set()


# -- serving ---------------------------------------------------------------------------------------


async def served(rig: Rig, seconds: float = 5.0) -> BaseException | None:
    """The error that ends the dispatcher, or None if it sleeps then."""
    try:
        async with asyncio.timeout(seconds):
            await rig.it.serve(rig.master)
    except TimeoutError:
        return None
    except BaseException as error:
        return error
    raise AssertionError("it serves until the line is lost")


async def test_jobs_are_sent_after_the_silence_until_the_line_is_lost() -> None:
    rig = Rig(REPLY, LineLost("unplugged"))
    jobs = [job_of(priority=Priority.OPERATOR_READ), job_of(priority=Priority.STOP)]
    for job in jobs:
        rig.it.submit(job)
    error = await served(rig)
    assert (type(error), str(error)) == (LineLost, "unplugged")
    rig.steps.opened.assert_called_once_with()
    assert rig.master.quiet.await_count == 2
    assert [sending.pdu for sending in rig.sent] == [READ.pdu()] * 2
    assert rig.waiting == [jobs[0]], "the stop was first"


async def test_failure_and_replies_behind_end_the_line_but_a_stop_is_sent_first() -> None:
    rig = Rig()
    rig.master.failure = LineLost("closed by the peer")
    assert str(await served(rig)) == "closed by the peer"
    rig.master.failure = None
    rig.steps.reopen, rig.steps.behind = True, "one behind"
    error = await served(rig)
    assert (type(error), str(error)) == (LineBehind, "one behind")
    rig.results = [LineLost("unplugged")]
    rig.it._queue.put_back(job_of(WRITE, Priority.STOP))
    assert str(await served(rig)) == "unplugged"


@pytest.mark.parametrize("waits", [True, False])
async def test_prepared_frames_go_before_the_queue(waits: bool) -> None:
    rig = Rig()
    rig.master.failure = LineLost("end")
    rig.it.last_way = Mock(waits=waits, send_waiting=AsyncMock())
    await served(rig)
    assert rig.it.last_way.send_waiting.await_count == waits


async def test_line_sleeps_until_the_earliest_time_that_is_due(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pauses: list[float] = []
    rig = Rig()

    async def sleep(pause: float) -> None:
        assert not rig.it._wake.is_set()
        pauses.append(pause)
        rig.master.failure = LineLost("end")

    rig.it._sleep = sleep
    waits = job_of()
    for due, ready, behind, pause in (
        (math.inf, None, math.inf, math.inf), (NOW + 5, None, math.inf, 5.0),
        (NOW + 5, NOW + 2, math.inf, 2.0), (NOW + 2, NOW + 5, math.inf, 2.0),
        (NOW + 5, NOW + 4, 3.0, 3.0), (NOW - 5, None, math.inf, 0.0),
    ):  # fmt: skip
        rig.master.failure = None
        rig.it._alive_reads.put_due.return_value = due
        rig.it._queue._jobs = [] if ready is None else [waits]
        monkeypatch.setattr(rig.it, "_not_before", lambda _, ready=ready: ready)
        rig.steps.behind = "" if behind == math.inf else "one behind"
        rig.steps.attend = AsyncMock(return_value=behind)
        rig.it.wake()
        await served(rig)
        assert pauses.pop() == pause


async def test_sleep_ends_with_its_pause_or_with_a_wake() -> None:
    rig = Rig()
    async with asyncio.timeout(5.0):
        await rig.it._sleep(0.001)
    for pause in (math.inf, 60.0):
        sleep = asyncio.create_task(rig.it._sleep(pause))
        for _ in range(5):
            await asyncio.sleep(0)
        assert not sleep.done()
        rig.it.wake()
        await asyncio.wait_for(sleep, 5.0)
        rig.it._wake.clear()


def test_request_waits_for_the_last_of_what_holds_it_back() -> None:
    rig, job = Rig(), job_of(within=0.1)
    assert rig.it._not_before(job) == 0.0
    rig.devices.not_before.return_value = NOW + 4
    for part in (rig.back_to_back, rig.proof):
        part.not_before.return_value = NOW  # no longer than now
    assert rig.it._not_before(job) == NOW + 4
    rig.steps.not_before.assert_called_with(job, NOW)
    rig.proof.not_before.assert_called_with(job, NOW)
    rig.back_to_back.not_before.assert_called_with(job)
    rig.devices.not_before.assert_called_with(1, job.expectation, job.priority, NOW, job.tries)
    rig.devices.backed_off.return_value = 2.0
    assert rig.it._not_before(job) == 0.0
    rig.devices.backed_off.assert_called_with(1, job.priority, NOW, 0.1)
    for part, later in ((rig.back_to_back, 3), (rig.proof, 2), (rig.steps, 1)):
        part.not_before.return_value = NOW + later
        assert rig.it._not_before(job) == NOW + later
    rig.it.held_back = lambda: True
    assert rig.it._not_before(job) == NOW + HELD_LOOK
    assert rig.it._not_before(job_of(priority=Priority.STOP)) == NOW + 1


@pytest.mark.parametrize(
    ("ready", "quiet", "lengthens", "longer"),
    [(5.0, 0.0, True, True), (5.0, 0.0, False, False), (5.0, 5.0, True, False),
     (0.0, 0.0, True, False), (5.0, 4.0, True, True)],
)  # fmt: skip
def test_request_that_must_wait_for_a_late_reply_is_lengthened_instead(
    ready: float, quiet: float, lengthens: bool, longer: bool
) -> None:
    rig = Rig()
    rig.devices.quiet_until = NOW + quiet
    rig.steps.lengthen.return_value = lengthens
    rig.devices.not_before.side_effect = [NOW + ready, NOW + 1]
    assert rig.it._not_before(job_of()) == NOW + (1 if longer else ready)


# -- one request -----------------------------------------------------------------------------------


@pytest.mark.parametrize("why", ["", "a stop came"])
async def test_request_is_sent_unless_it_is_forbidden(why: str) -> None:
    rig = Rig(REPLY)
    reply = Reply((100,), NOW)
    rig.outcomes.conclude.return_value = reply
    job = job_of(WRITE, forbidden=lambda: why)
    await rig.run(job)
    assert len(rig.sent) == (not why)
    if why:
        assert (type(error_of(job)), str(error_of(job))) == (RequestRefused, why)
        return
    rig.steps.end_form.assert_called_once_with(job, REPLY)
    rig.outcomes.waited_for_us.assert_called_once_with(job, REPLY)
    assert (rig.flights, rig.it.in_flight, job.begun) == ([True], False, True)
    assert job.answer.result(0) is reply
    rig.outcomes.values.drop.assert_called_once_with(1)
    rig.outcomes.record.assert_called_once_with(1, job.pdu, REPLY, job)
    rig.outcomes.hear_gateway.assert_called_once_with(job, REPLY)
    rig.steps.note.assert_called_once_with(job, job.expectation, REPLY)
    rig.back_to_back.count.assert_called_once_with(job, NOW, NOW + 3)
    rig.proof.sent.assert_called_once_with(job, NOW)
    rig.outcomes.conclude.assert_called_once_with(job, REPLY, unsent=False)


async def test_request_is_not_sent_if_it_is_withdrawn_or_its_device_is_not_polled() -> None:
    rig, job = Rig(), job_of()
    job.answer.cancel()
    await rig.run(job)
    rig.devices.backed_off.return_value = 2.0
    await rig.run(job_of())
    assert (rig.sent, rig.waiting) == ([], [])
    rig.outcomes.values.drop.assert_not_called()


async def test_read_drops_no_values_and_a_repeat_is_begun_already() -> None:
    rig = Rig(REPLY)
    job = job_of()
    job.answer.set_running_or_notify_cancel()
    job.begun = True
    await rig.run(job)
    assert len(rig.sent) == 1
    rig.outcomes.values.drop.assert_not_called()


async def test_proof_and_probe_go_before_the_request_that_needs_them() -> None:
    rig, job = Rig(NOTHING), job_of()
    rig.proof.is_due.return_value, rig.proof.prove = True, AsyncMock()
    await rig.run(job)
    rig.proof.prove.assert_awaited_once_with(rig.master, job)
    assert (rig.waiting, rig.sent) == ([job], [])
    rig.it._queue._jobs.clear()
    rig.proof.is_due.return_value, rig.steps.prepare.return_value = False, Read(1, 100, 2)
    rig.it._prove = AsyncMock()
    await rig.run(job)
    rig.it._prove.assert_awaited_once_with(rig.master, job, Read(1, 100, 2))
    assert (rig.waiting, rig.sent, job.begun) == ([job], [], False)


@pytest.mark.parametrize(
    ("kind", "is_silent", "waits", "ends"),
    [
        (ResultKind.NOTHING, False, True, True), (ResultKind.NOTHING, True, True, False),
        (ResultKind.REPLY, False, True, False), (ResultKind.DAMAGED, False, True, True),
        (ResultKind.NOTHING, False, False, False), (ResultKind.DAMAGED, True, True, True),
    ],
)  # fmt: skip
async def test_probe_without_a_reply_ends_the_request_that_waits_for_it(
    kind: ResultKind, is_silent: bool, waits: bool, ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, job, probe = Rig(), job_of(), Read(1, 100, 2)
    result = result_of(kind)
    seen: list[object] = []

    async def prove(*of: object) -> ExchangeResult:
        seen.extend((*of, rig.it.in_flight))
        return result

    monkeypatch.setattr(dispatchers, "may_be_silent", lambda *of: of == (job, probe) and is_silent)
    rig.steps.prove = prove
    if waits:
        rig.it.put_back(job)
    await rig.it._prove(rig.master, job, probe)
    assert seen == [rig.master, job, probe, True]
    assert not rig.it.in_flight
    assert rig.waiting == ([job] if waits and not ends else [])
    if ends:
        rig.outcomes.conclude.assert_called_once_with(job, result, unsent=True)
    else:
        rig.outcomes.conclude.assert_not_called()


async def test_request_of_a_lost_line_waits_and_its_reply_may_still_come() -> None:
    rig, job = Rig(LineLost("unplugged")), job_of(WRITE)
    with pytest.raises(LineLost, match="unplugged"):
        await rig.run(job)
    assert (rig.waiting, rig.it.in_flight, job.answer.done()) == ([job], False, False)
    (device, pdu, cut, of), _ = rig.outcomes.record.call_args
    assert (device, pdu, of) == (1, job.pdu, job)
    assert (cut.kind, cut.sent, cut.end) == (ResultKind.NOTHING, NOW, NOW + 3)
    rig.devices.may_come.assert_called_once_with(1, job.expectation, NOW, NOW + 3)
    broadcast = job_of(WriteOne(BROADCAST, 100, 7))
    rig.results = [LineLost("unplugged")]
    with pytest.raises(LineLost):
        await rig.run(broadcast)
    assert rig.devices.may_come.call_count == 1


@pytest.mark.parametrize(
    ("error", "kind", "text"),
    [
        (asyncio.CancelledError(), LineClosed, "The line was closed during the request."),
        (ZeroDivisionError("odd"), LineFailed, "The request failed: ZeroDivisionError('odd')."),
    ],
)
async def test_request_that_is_cut_says_that_its_write_may_have_taken_effect(
    error: BaseException, kind: type[LineError], text: str
) -> None:
    for request in (READ, WRITE):
        rig, job = Rig(error), job_of(request)
        with pytest.raises(type(error)):
            await rig.run(job)
        assert type(error_of(job)) is kind
        assert str(error_of(job)).startswith(text)
        assert (str(error_of(job)) == text) == (request is READ)


@pytest.mark.parametrize(
    ("held", "why", "priority", "sent", "waits"),
    [
        (True, "", Priority.POLL, False, True), (True, "", Priority.STOP, True, False),
        (False, "a stop came", Priority.POLL, False, False),
        (False, "", Priority.POLL, True, False),
    ],
)  # fmt: skip
async def test_request_is_held_back_at_the_last_moment(
    held: bool, why: str, priority: Priority, sent: bool, waits: bool
) -> None:
    rig, job = Rig(REPLY), job_of(priority=priority)
    reasons = ["", why]
    rig.it.refusal = lambda _: reasons.pop(0)
    rig.it.held_back = lambda: held
    await rig.run(job)
    assert (len(rig.sent), rig.waiting, rig.it.in_flight) == (sent, [job] if waits else [], False)
    if why:
        assert (type(error_of(job)), str(error_of(job))) == (RequestRefused, why)
    else:
        assert not job.answer.done()


@pytest.mark.parametrize(
    ("keeps_alive", "skip", "mistakable"),
    [(True, 2, True), (True, 1, True), (True, 0, False), (False, 2, False)],
)
def test_keep_alive_read_does_not_wait_for_the_second_of_two_replies(
    keeps_alive: bool, skip: int, mistakable: bool
) -> None:
    rig, job = Rig(), job_of(keeps_alive=keeps_alive)
    rig.devices.doubts.return_value = (True, skip)
    assert rig.it._sending(job).skip == (0 if mistakable else skip)
    assert job.mistakable == mistakable


@pytest.mark.parametrize("state", ["due", "done", "waits"])
async def test_request_whose_reply_cannot_be_judged_fails(state: str) -> None:
    rig, job = Rig(REPLY), job_of(WRITE)

    def conclude(*_: object) -> None:
        if state == "done":
            job.fail(LineLost("before"))
        elif state == "waits":
            rig.it._queue.put_back(job)
        raise ZeroDivisionError("odd")

    rig.it._conclude = conclude
    with pytest.raises(ZeroDivisionError):
        await rig.run(job)
    assert job.answer.done() == (state != "waits")
    if state == "due":
        assert type(error_of(job)) is LineFailed
        assert str(error_of(job)).startswith(
            "The reply could not be judged: ZeroDivisionError('odd')."
        )
        assert len(str(error_of(job))) > 60, "the write may have taken effect"


def test_request_is_sent_with_its_timeout_and_doubts() -> None:
    rig, job = Rig(), job_of(within=0.1)
    for sure, doubts, form, expected in (
        (True, False, None, True), (False, False, None, False), (True, True, None, False),
        (False, True, Read(1, 100, 2), True),
    ):  # fmt: skip
        rig.devices.doubts.return_value = (sure, 2)
        rig.proof.doubts_refusal.return_value = doubts
        job.form = form
        sending = rig.it._sending(job)
        assert (sending.device, sending.pdu, sending.expectation) == (1, job.pdu, job.expectation)
        assert (sending.time_out, sending.sure, sending.skip) == (0.5, expected, 2)
    rig.devices.doubts.assert_called_with(1, job.expectation, NOW, job.tries)
    rig.devices.time_out.assert_called_with(1, 3, job.priority, 0.1)
    rig.proof.doubts_refusal.assert_called_with(1)
    broadcast = rig.it._sending(job_of(WriteOne(BROADCAST, 100, 7)))
    assert (broadcast.device, broadcast.expectation, broadcast.time_out) == (BROADCAST, None, 0.0)
    assert broadcast.pdu == WriteOne(BROADCAST, 100, 7).pdu()
    rig.it.refusal = lambda _: "void"
    with pytest.raises(Exception, match="void"):
        broadcast.look()


@pytest.mark.parametrize(
    ("echo", "limits", "probes", "kind"),
    [
        (False, WIDE, 1, ResultKind.REPLY), (True, WIDE, 1, ResultKind.NOTHING),
        (None, NO_ECHO, 1, ResultKind.NOTHING),
        (None, replace(WIDE, functions=frozenset({6})), 0, ResultKind.NOTHING),
    ],
)  # fmt: skip
async def test_copy_of_a_write_is_its_reply_only_if_the_adapter_has_no_echo(
    echo: bool | None, limits: Any, probes: int, kind: ResultKind
) -> None:
    unsure, probed = result_of(ResultKind.UNSURE), result_of(ResultKind.REPLY, pdu=PDU)
    rig, job = Rig(unsure, probed), job_of(WRITE, limits=limits)
    rig.master.echo = echo
    await rig.run(job)
    assert (unsure.kind, len(rig.sent)) == (kind, 1 + probes)
    if kind is ResultKind.REPLY:
        assert unsure.pdu == job.pdu
    else:
        assert unsure.detail == "only the adapter's echo of it came back"
    if probes:
        probe = Read(1, 100, 1)
        last = rig.sent[-1]
        assert (last.device, last.pdu, last.expectation, last.time_out) == (
            1, probe.pdu(), probe.expectation(), 0.5,
        )  # fmt: skip
        rig.devices.time_out.assert_called_with(1, 3, job.priority)
        assert rig.outcomes.record.call_args_list[0].args == (1, probe.pdu(), probed, job)
        rig.outcomes.count_beside.assert_called_once_with(1, probed)
        rig.master.quiet.assert_awaited_once_with()


@pytest.mark.parametrize("is_copy", [True, False])
async def test_reply_that_may_be_a_copy_is_requested_again(is_copy: bool) -> None:
    piece = Piece(bytes([1, *PDU, 0, 0]), True)
    doubted = result_of(ResultKind.REPLY, pdu=PDU, strays=[piece], turnaround=0.25)
    other = result_of(ResultKind.REPLY, pdu=bytes([3, 2, 0, 7]) if is_copy else PDU)
    rig, job = Rig(doubted, other), job_of()
    rig.devices.is_repeat.return_value = True
    await rig.run(job)
    rig.devices.is_repeat.assert_called_once_with(1, job.pdu, PDU, 0.25)
    assert len(rig.sent) == 2
    rig.master.quiet.assert_awaited_once_with()
    assert rig.outcomes.record.call_args_list[0].args == (1, job.pdu, doubted, job, "copy")
    rig.outcomes.count_beside.assert_called_once_with(1, doubted)
    rig.outcomes.note_strays.assert_called_once_with([piece], NOW + 2)
    rig.outcomes.conclude.assert_called_once_with(job, other, unsent=False)
    expected = [((1, job.expectation, NOW + 1, NOW + 2),)] if is_copy else []
    assert [tuple(call)[:1] for call in rig.devices.may_come.call_args_list] == expected


async def test_only_a_reply_may_be_a_copy() -> None:
    rig = Rig(NOTHING)
    rig.devices.is_repeat.return_value = True
    await rig.run(job_of())
    assert len(rig.sent) == 1


@pytest.mark.parametrize("part", ["form", "late", "end"])
async def test_request_waits_again_after_a_longer_form_or_a_late_reply(part: str) -> None:
    rig, job = Rig(REPLY), job_of()
    rig.steps.end_form.return_value = part == "form"
    rig.outcomes.waited_for_us.return_value = part == "late"
    await rig.run(job)
    assert rig.waiting == ([] if part == "end" else [job])
    assert rig.outcomes.conclude.called == (part == "end")


@pytest.mark.parametrize(
    ("priority", "kind", "behind"),
    [
        (Priority.POLL, ResultKind.NOTHING, True), (Priority.POLL, ResultKind.DAMAGED, False),
        (Priority.OPERATOR_READ, ResultKind.NOTHING, False),
    ],
)  # fmt: skip
async def test_repeat_of_a_poll_that_was_not_answered_goes_behind_the_others(
    priority: Priority, kind: ResultKind, behind: bool
) -> None:
    result = result_of(kind)
    rig, job = Rig(result), job_of(priority=priority)
    rig.outcomes.conclude.return_value = Next.REPEAT
    job.order = -1
    await rig.run(job)
    assert rig.waiting == [job]
    assert (job.order != -1) == behind
    assert rig.it._wake.is_set()


@pytest.mark.parametrize("kind", [ResultKind.REPLY, ResultKind.NOTHING])
async def test_queue_counts_the_time_that_a_request_has_kept_the_line(kind: ResultKind) -> None:
    rig, job = Rig(result_of(kind)), job_of()
    counted: list[Any] = []
    rig.it._queue.count = lambda *of, **how: counted.append((of, how))
    await rig.run(job)
    assert counted == [((job, NOW, NOW + 3), {"acknowledged": kind is ResultKind.REPLY})]
    assert not cast(Any, job.answer).done()
