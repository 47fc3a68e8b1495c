"""Steps of the check of replies without a wire: what is probed, and what each end means."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any
from unittest.mock import AsyncMock, MagicMock, Mock

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineBehind, LineLost
from tui.bus.line import Timing
from tui.bus.master import ExchangeResult, Piece, ResultKind
from tui.bus.requests import BROADCAST, Diagnose, Identify, Read, ReportId, Request, WriteOne
from tui.bus.schedule import in_step
from tui.bus.schedule.in_step import (
    BEHIND,
    CHECK_EVERY,
    LONGEST_DRAIN,
    LONGEST_FREE,
    PROBE_AGAIN,
    PROBES,
    REOPENINGS,
    RETRY,
    InStep,
)
from tui.bus.schedule.probes import LOOKED_BACK
from tui.bus.schedule.queue import Job

from .conftest import NO_ECHO, WIDE

NOW, SENT, END = 1000.0, 990.0, 995.0
READ, OTHER, WRITE = Read(1, 100, 1), Read(1, 100, 2), WriteOne(1, 100, 7)
PDU = bytes([3, 2, 0, 100])
REPLY, EXCEPTION, NOTHING, WRONG = (
    ResultKind.REPLY, ResultKind.EXCEPTION, ResultKind.NOTHING, ResultKind.WRONG,
)  # fmt: skip


def ended(kind: ResultKind, *strays: bytes, **more: Any) -> ExchangeResult:
    pieces = [Piece(bytes([1, *pdu, 0, 0]), True) for pdu in strays]
    more.setdefault("sent", SENT)
    return ExchangeResult(kind, strays=pieces, end=END, turnaround=0.25, **more)


def job_of(request: Request = READ, priority: Priority = Priority.POLL, **more: Any) -> Job:
    return Job(request, priority, more.pop("limits", WIDE), **more)


class Rig:
    """The check, with parts that note their calls; the time is theirs."""

    def __init__(self, *, buffers: bool = False, gateway: bool = False) -> None:
        self.now = NOW
        self.devices, self.outcomes = MagicMock(), Mock()
        self.devices.time_out.return_value = 0.5
        self.devices.last_reply_by.return_value = NOW + 3
        timing = Timing(first_timeout=1.0, probes=True)
        self.it: Any = InStep(
            self.devices, self.outcomes, lambda: self.now, timing, buffers, gateway
        )
        self.earlier: deque[Any] = deque()
        self.it._probes = self.probes = Mock(heard=False, silent=set())
        self.probes.sent.return_value = self.earlier
        self.probes.find.return_value = OTHER
        self.it.lengthen = self.lengthen = Mock(return_value=False)
        self.devices.__getitem__.return_value = Mock(guess=None)

    def note(self, kind: ResultKind, *strays: bytes, **more: Any) -> Job:
        job = more.pop("job", None) or job_of()
        number = more.pop("number", False)
        self.it.note(job, job.expectation, ended(kind, *strays, **more), number=number)
        return job


@pytest.mark.parametrize(
    ("priority", "behind", "quiet", "when"),
    [
        (Priority.POLL, "", NOW + 5, NOW + 5), (Priority.POLL, "", NOW, None),
        (Priority.FEED, "", NOW + 5, None), (Priority.POLL, "x", NOW + 5, 0.0),
        (Priority.STOP, "x", NOW + 5, None),
    ],
)  # fmt: skip
def test_quiet_line_holds_back_all_but_stops_and_keep_alive_reads(
    priority: Priority, behind: str, quiet: float, when: float | None
) -> None:
    rig = Rig()
    rig.it.behind, rig.it.quiet_until = behind, quiet
    assert rig.it.not_before(job_of(priority=priority), NOW) == when


@pytest.mark.parametrize(
    ("job", "probed"),
    [
        (job_of(), True),
        (job_of(WriteOne(BROADCAST, 100, 7)), False),
        (job_of(WRITE, Priority.STOP), False),
        (job_of(WRITE, Priority.OPERATOR_WRITE), True),
        (job_of(READ, Priority.STOP), False),
        (job_of(Identify(1)), False),
        (job_of(ReportId(1)), False),
        (job_of(within=0.1), False),
        (job_of(probes=LOOKED_BACK), False),
        (job_of(probes=LOOKED_BACK - 1), True),
    ],
)
def test_request_is_probed_unless_it_may_not_wait_or_proves_itself(job: Job, probed: bool) -> None:
    rig, before = Rig(), job.probes
    assert rig.it.prepare(job) == (OTHER if probed else None)
    assert job.probes == before + probed
    rig.it._timing = replace(rig.it._timing, probes=False)
    assert rig.it.prepare(job) is None


@pytest.mark.parametrize(
    ("proved", "earlier", "request_", "lengthens", "probed"),
    [
        (True, READ, READ, False, False),
        (False, READ, READ, False, True),
        (False, OTHER, READ, False, False),
        (False, OTHER, WRITE, False, True),
        (False, READ, READ, True, False),
        (False, None, READ, True, True),
        (True, None, READ, False, False),
    ],
)
def test_request_unlike_those_before_is_its_own_proof(
    proved: bool, earlier: Request | None, request_: Request, lengthens: bool, probed: bool
) -> None:
    rig = Rig()
    if proved:
        rig.it._proved.add(1)
    if earlier is not None:
        rig.earlier.append(earlier.expectation())
    rig.lengthen.return_value = lengthens
    assert rig.it.prepare(job_of(request_)) == (OTHER if probed else None)
    rig.probes.sent.assert_called_with(1)


@pytest.mark.parametrize(
    ("earlier", "expected"), [((READ, READ), OTHER), ((READ, OTHER), None), ((), None)]
)
def test_drive_of_few_forms_is_probed_by_one_unlike_the_last(
    earlier: tuple[Request, ...], expected: Request | None
) -> None:
    rig = Rig()
    rig.earlier.extend(request.expectation() for request in earlier)
    rig.probes.find.side_effect = lambda job, depth=None: OTHER if depth == 1 else None
    assert rig.it.prepare(job_of()) == expected
    assert rig.it._weak == ({1} if earlier else set())


@pytest.mark.parametrize(
    ("buffers", "check", "probed"),
    [(True, NOW, True), (True, NOW + 1, False), (False, NOW, False)],
)
def test_proof_on_a_connection_that_buffers_is_for_a_time(
    buffers: bool, check: float, probed: bool
) -> None:
    rig = Rig(buffers=buffers)
    rig.it._proved.add(1)
    rig.it._next_check = check
    assert rig.it.prepare(job_of()) == (OTHER if probed else None)


def test_repeat_of_a_request_that_nothing_answered_needs_no_probe() -> None:
    rig = Rig()
    job = rig.note(NOTHING)
    assert rig.it.prepare(job) is OTHER, "it is no repeat"
    job.repeats = 1
    assert rig.it.prepare(job) is None
    rig.note(NOTHING, job=job_of(Read(1, 500, 3)))
    assert rig.it.prepare(job) is OTHER
    rig.it._missed[1] = job.pdu
    rig.note(REPLY)
    assert rig.it._missed == {}


@pytest.mark.parametrize("kind", [REPLY, EXCEPTION, NOTHING, WRONG])
@pytest.mark.parametrize("probe", [OTHER, Diagnose(1, 0, 77)])
async def test_probe_is_sent_recorded_and_noted(kind: ResultKind, probe: Request) -> None:
    rig, job = Rig(), job_of(within=0.1)
    result = ended(kind, PDU, pdu=PDU)
    master = Mock(exchange=AsyncMock(return_value=result))
    rig.it.note = Mock()
    assert await rig.it.prove(master, job, probe) is result
    (sending,), _ = master.exchange.await_args
    expectation = probe.expectation()
    assert (sending.device, sending.pdu, sending.expectation, sending.time_out) == (
        1, probe.pdu(), expectation, 0.5,
    )  # fmt: skip
    rig.devices.time_out.assert_called_once_with(1, 3, job.priority, 0.1)
    rig.outcomes.hear_gateway.assert_called_once_with(job, result)
    rig.outcomes.record.assert_called_once_with(1, probe.pdu(), result, job)
    is_number = isinstance(probe, Diagnose)
    rig.it.note.assert_called_once_with(job, expectation, result, number=is_number)
    if is_number:
        rig.probes.forms.note.assert_not_called()
    else:
        rig.probes.forms.note.assert_called_once_with(probe, result)
    if kind in (REPLY, EXCEPTION):
        rig.devices.may_come.assert_not_called()
        rig.outcomes.count_beside.assert_called_once_with(1, result)
        rig.outcomes.note_strays.assert_called_once_with(result.strays, END)
        rig.devices.answered.assert_called_once_with(
            1, expectation, 0.25, NOW, (probe.pdu(), PDU), refused=kind is EXCEPTION
        )
    else:
        rig.devices.may_come.assert_called_once_with(1, expectation, SENT, NOW)
        rig.devices.answered.assert_not_called()
        rig.outcomes.count_beside.assert_not_called()


async def test_reply_to_a_probe_that_is_cut_may_still_come() -> None:
    rig = Rig()
    rig.it._clock = iter((NOW, NOW + 2)).__next__
    with pytest.raises(LineLost):
        await rig.it.prove(Mock(exchange=AsyncMock(side_effect=LineLost("x"))), job_of(), OTHER)
    rig.devices.may_come.assert_called_once_with(1, OTHER.expectation(), NOW, NOW + 2)


@pytest.mark.parametrize(
    ("kind", "answers_all", "silent"),
    [(NOTHING, False, {1}), (NOTHING, True, set()), (WRONG, False, set())],
)
async def test_drive_that_may_be_silent_to_a_longer_read_is_remembered(
    kind: ResultKind, answers_all: bool, silent: set[int]
) -> None:
    rig = Rig()
    job = job_of(limits=replace(NO_ECHO, answers_all=answers_all))
    rig.it.note = Mock()
    await rig.it.prove(Mock(exchange=AsyncMock(return_value=ended(kind))), job, OTHER)
    assert rig.probes.silent == silent


@pytest.mark.parametrize(
    ("kind", "earlier", "number", "weak", "proved"),
    [
        (REPLY, OTHER, False, False, True), (REPLY, READ, False, False, False),
        (REPLY, READ, True, False, True), (REPLY, None, False, False, False),
        (EXCEPTION, OTHER, False, False, False), (NOTHING, OTHER, False, False, False),
        (REPLY, READ, False, True, False),
    ],
)  # fmt: skip
def test_reply_unlike_earlier_ones_proves_the_step(
    kind: ResultKind, earlier: Request | None, number: bool, weak: bool, proved: bool
) -> None:
    rig = Rig()
    if earlier is not None:
        rig.earlier.append(earlier.expectation())
    if weak:
        rig.it._weak.add(1)
    job = rig.note(kind, number=number, sent=NOW - 0.05)
    assert (1 in rig.it._proved) == proved
    assert rig.it._weak == set()
    assert rig.earlier[-1] == job.expectation
    assert rig.it._next_check == (NOW + CHECK_EVERY if proved else 0.0)
    assert rig.it._missed == ({1: job.pdu} if kind is NOTHING else {})
    assert rig.probes.heard == (kind is REPLY and not number)
    assert rig.probes.note_good.called == (kind is REPLY)
    assert rig.it._last == 1


def test_reply_of_a_weak_form_proves_the_step_if_it_differs_from_the_last() -> None:
    rig = Rig()
    rig.earlier.extend((READ.expectation(), OTHER.expectation()))
    rig.it._weak.add(1)
    rig.note(REPLY, sent=NOW - 2000.0)
    assert rig.it._proved == {1}
    assert rig.it._next_check == NOW + 2000.0 / in_step.CHECK_SHARE


@pytest.mark.parametrize("weak", [True, False])
def test_reply_that_may_be_that_of_an_earlier_request_proves_nothing(weak: bool) -> None:
    rig, job = Rig(), job_of(mistakable=True)
    rig.earlier.append(OTHER.expectation())
    if weak:
        rig.it._weak.add(1)
        rig.earlier.extend((READ.expectation(), OTHER.expectation()))
    rig.note(REPLY, job=job)
    assert rig.it._proved == set()


def test_proof_ends_the_suspicion() -> None:
    rig = Rig()
    rig.earlier.append(OTHER.expectation())
    rig.it._shifts, rig.it.quiet_until, rig.it.behind = 1, NOW + 5, BEHIND
    rig.note(REPLY)
    assert (rig.it._shifts, rig.it.quiet_until, rig.it.behind) == (0, 0.0, "")


@pytest.mark.parametrize("gateway", [True, False])
def test_unanswered_request_ends_the_proof_of_its_device_or_of_all_of_a_gateway(
    gateway: bool,
) -> None:
    for kind, strays in ((NOTHING, ()), (REPLY, (PDU,))):
        rig = Rig(gateway=gateway)
        rig.it._proved.update((1, 2))
        rig.it._missed[2] = b"x"
        rig.note(kind, *strays)
        assert rig.it._proved == (set() if gateway else {2})
        assert (2 in rig.it._missed) is not gateway


@pytest.mark.parametrize(
    ("strays", "gateway", "judged"), [((), False, True), ((PDU,), False, False), ((), True, False)]
)
def test_timeout_is_judged_by_a_certain_reply_alone(
    strays: tuple[bytes, ...], gateway: bool, judged: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[object] = []
    monkeypatch.setattr(in_step, "judge_guess", lambda *of: calls.append(of))
    rig = Rig(gateway=gateway)
    rig.earlier.append(OTHER.expectation())
    rig.note(REPLY, *strays)
    assert calls == ([(rig.devices[1], SENT, NOW)] if judged else [])


def test_silence_to_a_longer_read_counts_once_the_drive_answers() -> None:
    for silent in (True, False):
        rig = Rig()
        rig.probes.silent = {1, 2} if silent else {2}
        job = rig.note(REPLY)
        rig.probes.note_good.assert_called_once_with(job.request)
        assert rig.probes.forms.note_silence.call_args_list == ([((1,),)] if silent else [])
        assert rig.probes.silent == {2}
    rig = Rig()
    rig.it.note(job_of(), OTHER.expectation(), ended(REPLY))
    rig.probes.note_good.assert_not_called()


LATE = bytes([3, 4, 0, 1, 0, 2])
"""The reply to OTHER."""


def shifted(rig: Rig, times: int, kind: ResultKind = WRONG, stray: bytes = LATE) -> None:
    for _ in range(times):
        rig.earlier.append(OTHER.expectation())
        rig.note(kind, stray)


def test_earlier_replies_in_a_row_leave_the_line_quiet_then_name_it_behind() -> None:
    rig = Rig()
    shifted(rig, 1)
    assert (rig.it.quiet_until, rig.it.behind) == (0.0, "")
    shifted(rig, 1)
    assert (rig.it.quiet_until, rig.it.behind) == (NOW + 3, "")
    shifted(rig, 1)
    assert rig.it.behind == "", "it was sent before the line was quiet"
    rig.it.quiet_until = SENT
    first = job_of()
    rig.it._rounds = 7
    rig.earlier.append(OTHER.expectation())
    rig.note(WRONG, LATE, job=first)
    assert (rig.it.behind, rig.it.reopen, rig.it._rounds) == (BEHIND, True, 0)
    shifted(rig, 1)
    assert rig.it._witness is first


@pytest.mark.parametrize(("by", "quiet"), [(NOW, 1.0), (NOW + 99, LONGEST_DRAIN)])
def test_line_is_quiet_for_a_late_reply_within_bounds(by: float, quiet: float) -> None:
    rig = Rig()
    rig.devices.last_reply_by.return_value = by
    shifted(rig, 2)
    assert rig.it.quiet_until == NOW + quiet
    rig.devices.last_reply_by.assert_called_with(NOW)


@pytest.mark.parametrize(
    ("kind", "stray", "counts"),
    [
        (WRONG, LATE, True), (WRONG, bytes([3, 6, *bytes(6)]), False),
        (WRONG, bytes([0x83, 2]), True), (WRONG, bytes([0x84, 2]), False), (REPLY, LATE, False),
        (NOTHING, LATE, True),
    ],
)  # fmt: skip
def test_frame_is_an_earlier_reply_if_it_fits_an_earlier_request(
    kind: ResultKind, stray: bytes, counts: bool
) -> None:
    rig = Rig()
    shifted(rig, 1, kind, stray)
    assert rig.it._shifts == counts
    rig = Rig()
    rig.earlier.append(OTHER.expectation())
    rig.note(WRONG, stray, instead=Piece(bytes([1, *PDU, 0, 0]), True))
    assert rig.it._shifts == 0, "over Modbus TCP the reply of the transaction decides"


@pytest.mark.parametrize(
    ("kind", "last", "quiet", "gateway", "cleared"),
    [
        (REPLY, 2, 0.0, False, True), (REPLY, 1, 0.0, False, False), (REPLY, 2, 0.0, True, False),
        (EXCEPTION, 2, 0.0, False, False), (NOTHING, 1, SENT, False, True),
        (NOTHING, 1, SENT + 1, False, False), (NOTHING, 1, 0.0, False, False),
    ],
)  # fmt: skip
def test_suspicion_ends_with_a_reply_of_another_device_or_after_the_quiet(
    kind: ResultKind, last: int, quiet: float, gateway: bool, cleared: bool
) -> None:
    rig = Rig(gateway=gateway)
    rig.it._shifts, rig.it._last, rig.it.quiet_until = 1, last, quiet
    rig.note(kind)
    assert (rig.it._shifts, rig.it.quiet_until) == ((0, 0.0) if cleared else (1, quiet))


def test_line_that_is_in_step_again_is_reported_once() -> None:
    rig = Rig()
    rig.it.recovered = Mock()
    rig.it.behind, rig.it._shifts, rig.it.quiet_until = BEHIND, 2, NOW
    rig.it._fall_in()
    rig.it._fall_in()
    rig.it.recovered.assert_called_once_with()
    assert (rig.it.behind, rig.it._shifts, rig.it.quiet_until) == ("", 0, 0.0)


def test_frame_while_none_is_due_ends_the_proof_and_the_suspicion() -> None:
    rig = Rig()
    rig.it._proved.update((1, 2))
    rig.it._shifts, rig.it.quiet_until = 2, NOW
    rig.it.stray(Piece(bytes([1, *PDU, 0, 0]), True))
    assert (rig.it._proved, rig.it._shifts, rig.it.quiet_until) == ({2}, 0, 0.0)


@pytest.mark.parametrize("kind", [None, REPLY, EXCEPTION])
def test_longer_read_that_is_refused_is_sent_as_it_was_requested(kind: ResultKind | None) -> None:
    rig, job = Rig(), job_of()
    result = ended(kind or REPLY, PDU)
    if kind is not None:
        job.take_form(OTHER)
    assert rig.it.end_form(job, result) == (kind is EXCEPTION)
    if kind is None:
        rig.probes.forms.note.assert_not_called()
    else:
        rig.probes.forms.note.assert_called_once_with(OTHER, result)
    if kind is EXCEPTION:
        rig.devices.may_come.assert_called_once_with(1, OTHER.expectation(), SENT, NOW)
        rig.outcomes.count_beside.assert_called_once_with(1, result)
        rig.outcomes.note_strays.assert_called_once_with(result.strays, END)
        assert (job.form, job.pdu) == (None, READ.pdu())
    else:
        rig.devices.may_come.assert_not_called()


@pytest.mark.parametrize("behind", ["", BEHIND])
def test_nothing_is_proved_on_a_new_connection(behind: str) -> None:
    rig = Rig()
    for part in (rig.it._proved, rig.it._weak):
        part.add(1)
    rig.it._missed[1], rig.probes.heard, rig.it.behind = b"x", True, behind
    rig.it._shifts = rig.it._tries = 2
    rig.it._next_try = rig.it._waited = rig.it.quiet_until = 9.0
    rig.it.reopen = True
    rig.it.opened()
    assert (rig.it._proved, rig.it._weak, rig.it._missed) == (set(), set(), {})
    assert (rig.it._shifts, rig.it._tries, rig.it._next_try) == (0, 0, 0.0)
    assert (rig.it._waited, rig.it.quiet_until, rig.it.reopen) == (0.0, 0.0, False)
    assert rig.probes.heard is False
    assert rig.probes.forget_sent.called is not bool(behind)


# -- a line that is behind -------------------------------------------------------------------------


class Attended(Rig):
    """A line that is behind, with the results of its probes."""

    def __init__(self, *kinds: ResultKind) -> None:
        super().__init__()
        self.it.behind, self.it._witness = BEHIND, job_of()
        self.results = [ended(kind, PDU) for kind in kinds]
        self.master = Mock(quiet=AsyncMock())
        self.it.prove = AsyncMock(side_effect=self.results)
        self.probes.find_alone.return_value = OTHER

    async def attend(self) -> float:
        return float(await self.it.attend(self.master))


async def test_line_that_is_behind_is_checked_by_probes_then_opened_again() -> None:
    here = Attended(NOTHING, WRONG)
    here.it._shifts = 1
    for tries in range(1, PROBES + 1):
        assert (await here.attend(), here.it._tries) == (0.0, tries)
        here.it.prove.assert_awaited_with(here.master, here.it._witness, OTHER)
        assert here.it._next_try == (NOW + 1.0 if tries == PROBES else 0.0)
    assert here.master.quiet.await_count == PROBES
    assert [call.args for call in here.outcomes.note_strays.call_args_list] == [
        (result.strays, END) for result in here.results
    ]
    here.probes.find_alone.assert_called_with(here.it._witness, LOOKED_BACK)
    assert (here.it._rounds, here.it.behind, here.it.reopen) == (1, BEHIND, False)
    assert await here.attend() == 1.0
    here.now += 1.0
    assert (await here.attend(), here.it.reopen) == (0.0, True)


@pytest.mark.parametrize(("rounds", "seconds"), [(REOPENINGS - 2, 1.0), (REOPENINGS - 1, RETRY)])
async def test_line_is_opened_again_more_rarely_after_some_rounds(
    rounds: int, seconds: float
) -> None:
    here = Attended(NOTHING)
    here.it._tries, here.it._rounds, here.it._shifts = PROBES - 1, rounds, 1
    await here.attend()
    assert here.it._next_try == NOW + seconds


@pytest.mark.parametrize(("shifts", "probe"), [(0, OTHER), (1, OTHER), (0, None)])
async def test_line_without_a_further_sign_is_in_step_again(
    shifts: int, probe: Request | None
) -> None:
    here = Attended(NOTHING)
    here.it._tries, here.it._shifts, here.it._waited = PROBES - 1, shifts, LONGEST_DRAIN
    here.probes.find_alone.return_value = probe
    await here.attend()
    assert (here.it.behind == "") == (not shifts and probe is not None)


async def test_reply_to_a_probe_notes_no_strays_itself_and_ends_the_attention() -> None:
    here = Attended(REPLY)
    here.it._tries, here.it.behind = PROBES - 1, ""
    await here.attend()
    here.outcomes.note_strays.assert_not_called()
    assert here.it._rounds == 0


@pytest.mark.parametrize(
    ("waited", "depth", "seconds"),
    [
        (0.0, LOOKED_BACK, PROBE_AGAIN), (LONGEST_FREE - 0.1, LOOKED_BACK, PROBE_AGAIN),
        (LONGEST_FREE, 1, PROBE_AGAIN), (LONGEST_DRAIN, 1, 0.0),
    ],
)  # fmt: skip
async def test_line_without_a_free_probe_waits_for_one(
    waited: float, depth: int, seconds: float
) -> None:
    here = Attended()
    here.it._waited = waited
    here.probes.find_alone.return_value = None
    assert await here.attend() == seconds
    here.probes.find_alone.assert_called_once_with(here.it._witness, depth)
    assert here.it._waited == waited + seconds
    assert here.it._tries == (0 if seconds else PROBES)
    here.master.quiet.assert_not_awaited()


@pytest.mark.parametrize(
    ("behind", "job", "refused"),
    [
        ("", job_of(), False), (BEHIND, job_of(), True),
        (BEHIND, job_of(WRITE, Priority.STOP), False),
        (BEHIND, job_of(WRITE, Priority.OPERATOR_WRITE), True),
    ],
)  # fmt: skip
def test_line_that_is_behind_refuses_all_but_stop_words(
    behind: str, job: Job, refused: bool
) -> None:
    rig = Rig()
    rig.it.behind = behind
    assert rig.it.refuses(job) is refused
    assert job.answer.done() == refused
    if refused:
        error = job.answer.exception(0)
        assert (type(error), str(error)) == (LineBehind, BEHIND)
