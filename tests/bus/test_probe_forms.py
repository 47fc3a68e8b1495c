"""Longer reads by which a drive proves its step: those that it takes, and those given up."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import pytest

from tui.bus.expectation import Expectation
from tui.bus.limits import Limits
from tui.bus.master import ExchangeResult, ResultKind
from tui.bus.model import Priority
from tui.bus.requests import Diagnose, Read, Request, WriteOne
from tui.bus.schedule.probes import LOOKED_BACK, REMEMBERED, Forms, Probes, may_be_silent
from tui.bus.schedule.queue import Job

from .conftest import WIDE

OWN = Read(1, 100, 2)
MINUTE = 60.0


class Timed(Forms):
    """Forms by a clock of the test's own."""

    def __init__(self) -> None:
        self.now = 1000.0
        super().__init__(lambda: self.now)

    def ends(self, count: int, *kinds: ResultKind) -> None:
        for kind in kinds:
            self.note(replace(OWN, count=count), ExchangeResult(kind))

    def counts(self, read: Read = OWN) -> list[int]:
        return [form.count for form in self.longer(read, WIDE)]


@pytest.fixture
def forms() -> Timed:
    return Timed()


def test_up_to_eight_registers_more_are_read(forms: Timed) -> None:
    assert forms.counts() == list(range(3, 11))
    assert [form.address for form in forms.longer(OWN, WIDE)] == [100] * 8


def test_no_longer_read_than_the_device_takes(forms: Timed) -> None:
    found = [form.count for form in forms.longer(OWN, replace(WIDE, max_read=4))]
    assert found == [3, 4]


def test_read_that_was_refused_is_not_sent_again_nor_a_longer_one(forms: Timed) -> None:
    forms.ends(5, ResultKind.EXCEPTION)
    forms.now += 100 * MINUTE
    assert forms.counts() == [3, 4]


@pytest.mark.parametrize("kind", [ResultKind.NOTHING, ResultKind.DAMAGED, ResultKind.WRONG])
def test_second_read_in_a_row_without_a_reply_is_given_up_for_a_minute(
    forms: Timed, kind: ResultKind
) -> None:
    forms.ends(5, kind)
    assert 5 in forms.counts()
    forms.ends(5, kind)
    forms.now += MINUTE - 1
    assert forms.counts() == [3, 4]
    forms.now += 2
    assert forms.counts() == list(range(3, 11))
    forms.ends(5, kind)
    assert 5 in forms.counts(), "it counts from the start again"


def test_reply_between_two_silences_ends_the_count(forms: Timed) -> None:
    forms.ends(5, ResultKind.NOTHING, ResultKind.REPLY, ResultKind.NOTHING)
    assert forms.counts() == list(range(3, 11))


def test_silence_is_that_of_the_registers_alone(forms: Timed) -> None:
    forms.ends(5, ResultKind.NOTHING, ResultKind.NOTHING)
    assert forms.counts(replace(OWN, address=101)) == list(range(3, 11))
    assert forms.counts(replace(OWN, device=2)) == list(range(3, 11))
    assert forms.may_be_longer(1)


def test_drive_that_is_silent_to_longer_reads_gets_none_for_five_minutes(forms: Timed) -> None:
    forms.note_silence(1)
    assert forms.may_be_longer(1)
    forms.note_silence(1)
    forms.now += 5 * MINUTE - 1
    assert (forms.may_be_longer(1), forms.may_be_longer(2)) == (False, True)
    forms.now += 2
    assert forms.may_be_longer(1)


def test_reply_to_a_longer_read_ends_the_silence_of_a_drive(forms: Timed) -> None:
    forms.note_silence(1)
    forms.note_silence(1)
    forms.ends(3, ResultKind.REPLY)
    assert forms.may_be_longer(1)


def test_failures_of_4096_reads_are_remembered_at_most(forms: Timed) -> None:
    forms.ends(5, ResultKind.EXCEPTION)
    for address in range(4095):
        assert forms.counts() == [3, 4]
        forms.note(Read(2, address, 3), ExchangeResult(ResultKind.EXCEPTION))
    forms.note(Read(3, 1, 3), ExchangeResult(ResultKind.EXCEPTION))
    assert forms.counts() == list(range(3, 11))
    assert 3 not in forms.counts(Read(3, 1, 2))


@pytest.mark.parametrize("kept", [REMEMBERED - 1, REMEMBERED])
def test_so_many_failures_are_remembered_and_no_more(forms: Timed, kept: int) -> None:
    forms._refused = {replace(OWN, address=address) for address in range(1000, 999 + kept)}
    forms.ends(9, ResultKind.NOTHING)
    assert len(forms._refused) == kept - 1
    forms.ends(5, ResultKind.EXCEPTION)
    assert len(forms._refused) == (kept if kept < REMEMBERED else 1)
    assert len(forms._silences) == (1 if kept < REMEMBERED else 0)


@pytest.mark.parametrize("gateway", [False, True])
def test_probe_is_unlike_the_last_requests_to_its_drive_or_gateway(gateway: bool) -> None:
    """Behind a gateway a reply has the address of its request, also if another drive replied."""
    probes = Probes(cast(Any, None), lambda: 0.0, gateway=gateway)
    first, second = probes.sent(1), probes.sent(2)
    assert (first is second) == gateway
    assert probes.sent(1) is first
    first.extend(replace(OWN, count=count).expectation() for count in range(1, 9))
    assert len(first) == LOOKED_BACK
    reads = [replace(OWN, count=2), replace(OWN, count=3), replace(OWN, device=2, count=2)]
    for read in reads:
        probes.note_good(read)
    probes.note_good(newer := replace(OWN, address=200))
    two, three = (read.expectation() for read in reads[:2])
    assert probes._good == {1: {two: newer, three: reads[1]}, 2: {two: reads[2]}}
    probes.forget_sent()
    assert not probes.sent(1)


class AllForms:
    """Probes for one job after another, each of which is not free for another use."""

    def __init__(self, *, failures: int = 0, silent: bool = False, heard: bool = True) -> None:
        self.taken: list[Expectation] = []
        self.failures = failures
        self.quiet_until = 7.0
        self.probes = Probes(cast(Any, self), lambda: 5.0, gateway=False)
        self.probes.heard = heard
        if silent:
            self.probes.silent.add(1)

    def __getitem__(self, device: int) -> AllForms:
        assert device == 1
        return self

    def not_before(
        self, device: int, expectation: Expectation, priority: Priority, now: float
    ) -> float:
        assert (device, priority, now) == (1, Priority.POLL, 5.0)
        # what is free before the line is quiet is no later than the job itself
        # each echo has other data
        taken = [each for each in self.taken if each.function != 8 or expectation.function != 8]
        is_taken = expectation in taken or taken != self.taken
        return 7.1 if is_taken else 7.0

    def found(self, request: Request, limits: Limits, *, alone: bool = False) -> list[str]:
        """In short, all requests that may prove the step, in the order of their choice."""
        job, names = Job(request, Priority.POLL, limits), []
        while (
            form := self.probes.find_alone(job, LOOKED_BACK) if alone else self.probes.find(job)
        ) is not None:
            self.taken.append(form.expectation())
            count = form.count if isinstance(form, Read) else ""
            names.append(f"{form.function}:{form.register}:{count}")
        return names


SILENT = replace(WIDE, answers_all=False)
FEWER, MORE = ["3:100:1"], [f"3:100:{count}" for count in range(3, 11)]
ECHOES, IDENTITY = ["8:0:"], ["43:0:"]


@pytest.mark.parametrize(
    ("made", "limits", "found", "alone"),
    [
        (AllForms(), WIDE, FEWER + MORE + ECHOES + IDENTITY, ["3:100:2"]),
        (AllForms(), SILENT, FEWER + MORE + ECHOES, ["3:100:2"]),
        (AllForms(failures=3), SILENT, FEWER + ECHOES, [*MORE, "3:100:2"]),
        (AllForms(failures=2), SILENT, FEWER + MORE + ECHOES, ["3:100:2"]),
        (AllForms(silent=True), SILENT, FEWER + ECHOES, [*MORE, "3:100:2"]),
        (AllForms(silent=True), WIDE, FEWER + MORE + ECHOES + IDENTITY, ["3:100:2"]),
        (AllForms(heard=False), WIDE, FEWER + MORE + IDENTITY, ["3:100:2"]),
        (AllForms(), replace(SILENT, subfunctions=frozenset({1})), FEWER + MORE, ["3:100:2"]),
        (AllForms(), replace(SILENT, functions=frozenset({3, 43})), FEWER + MORE, ["3:100:2"]),
        (AllForms(), replace(SILENT, max_read=4), [*FEWER, "3:100:3", "3:100:4", *ECHOES],
         ["3:100:2"]),
    ],
)  # fmt: skip
def test_all_probes_of_a_read_in_the_order_of_their_choice(
    made: AllForms, limits: Limits, found: list[str], alone: list[str]
) -> None:
    assert made.found(OWN, limits) == found
    assert made.found(OWN, limits, alone=True) == alone


def test_all_probes_of_a_write_begin_at_its_register() -> None:
    write = WriteOne(1, 100, 7)
    single = [f"3:100:{count}" for count in range(1, 10)]
    made = AllForms(silent=True)
    assert made.found(write, SILENT) == ECHOES + single
    assert made.found(write, SILENT, alone=True) == []
    assert AllForms().found(write, WIDE) == ECHOES + IDENTITY + single
    assert AllForms().found(write, replace(WIDE, functions=frozenset({6}))) == []


def test_read_that_was_answered_is_a_probe_before_longer_ones() -> None:
    made = AllForms()
    made.probes.note_good(Read(1, 500, 20))
    made.probes.note_good(Read(2, 600, 30))
    assert made.found(OWN, SILENT)[:3] == ["3:100:1", "3:500:20", "3:100:3"]
    long = AllForms()
    assert long.found(Read(1, 100, 4), SILENT)[:4] == ["3:100:3", "3:100:2", "3:100:1", "3:100:5"]


@pytest.mark.parametrize(
    ("request_", "limits", "count"),
    [
        (OWN, WIDE, 3),
        (OWN, SILENT, None),
        (OWN, replace(WIDE, max_read=2), None),
        (WriteOne(1, 100, 7), WIDE, None),
    ],
)
def test_read_is_lengthened_where_the_drive_answers_all(
    request_: Request, limits: Limits, count: int | None
) -> None:
    made, job = AllForms(), Job(request_, Priority.POLL, limits)
    assert made.probes.lengthen(job) == (count is not None)
    assert job.form == (None if count is None else replace(OWN, count=count))
    made.probes.sent(1).extend(replace(OWN, count=each).expectation() for each in (3, 4))
    again = Job(request_, Priority.POLL, limits)
    assert made.probes.lengthen(again) == (count is not None)
    assert again.form == (None if count is None else replace(OWN, count=5))


@pytest.mark.parametrize("answers_all", [True, False])
@pytest.mark.parametrize(
    ("request_", "probe", "silent"),
    [
        (OWN, replace(OWN, count=3), True),
        (OWN, replace(OWN, count=2), False),
        (OWN, Diagnose(1, 0, 1), False),
        (WriteOne(1, 100, 7), OWN, False),
    ],
)
def test_drive_may_be_silent_to_a_longer_read_alone(
    request_: Request, probe: Request, silent: bool, answers_all: bool
) -> None:
    job = Job(request_, Priority.POLL, replace(WIDE, answers_all=answers_all))
    assert may_be_silent(job, probe) == (silent and not answers_all)
