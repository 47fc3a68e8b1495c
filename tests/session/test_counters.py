"""Counters of a drive and own counts: the meaning of each difference, over real lines too."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.bus.api import DeviceCounters, LineCounters, Priority
from tui.bus.errors import ExchangeError, RequestRefused
from tui.bus.line import Line, Timing
from tui.bus.link import SerialLink, TcpLink
from tui.bus.trace import Frame
from tui.drive.profile import library
from tui.session.counters.compare import (
    Bounds,
    Comparison,
    DriveCount,
    device_since,
    differences,
    frames_since,
    load_of,
)
from tui.session.counters.watch import THIS_PORT, CounterWatch, stray_difference
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.journal_reading import entries_of
from tui.simulator.simulation import Simulation
from tui.simulator.spec import DriveSpec
from tui.simulator.troubles import FaultRates
from tui.wire.frames import frame

QUICK = Timing(first_timeout=0.4, min_timeout=0.4, late_reply=0.5, retries=0)


def exactly(number: int) -> Bounds:
    return Bounds(number, number)


def count(frames: int, damaged: int = 0, *, sent: int = 0, answered: int = 0) -> DriveCount:
    return DriveCount(frames, damaged, exactly(sent), exactly(answered))


def reported(before: DriveCount, now: DriveCount) -> dict[str, int]:
    found = Comparison(before, before).with_look(now)
    return {difference.kind: difference.count for difference in differences(found)}


@pytest.mark.parametrize(
    ("now", "shown"),
    [
        (count(120, 3, sent=20, answered=20), {}),
        (count(120, 3, sent=20, answered=17), {"not-answered": 3}),
        (count(120, 5, sent=20, answered=18), {"damaged-there": 2}),
        (count(115, 3, sent=20, answered=15), {"never-arrived": 5}),
        (count(114, 4, sent=20, answered=11),
         {"never-arrived": 6, "damaged-there": 1, "not-answered": 2}),
        (count(150, 3, sent=20, answered=20), {"not-from-here": 30}),
        (count(150, 3, sent=20, answered=16), {"not-from-here": 30, "not-answered": 4}),
        (count(100, 3, sent=20, answered=20), {"another-port": 20}),
        (count(12, 0, sent=20, answered=20), {"counted-anew": 0}),
        # a count of errors never decreases without a reset
        (count(120, 0, sent=20, answered=20), {"counted-anew": 0}),
    ],
)  # fmt: skip
def test_counter_differences_are_reported(now: DriveCount, shown: dict[str, int]) -> None:
    assert reported(count(100, 3), now) == shown


def test_frames_roll_over_and_errors_stay() -> None:
    before = count(65530, 65535)
    assert before.saturated
    assert reported(before, count(14, 65535, sent=20, answered=20)) == {}


def test_uncertain_difference_is_not_reported() -> None:
    """Another request may have been on its way at the moment of the look."""
    before = DriveCount(100, 0, Bounds(50, 51), Bounds(49, 51))
    now = DriveCount(120, 0, Bounds(70, 72), Bounds(69, 71))
    assert differences(Comparison(before, before).with_look(now)) == []
    late = replace(now, answered=Bounds(60, 62))
    assert reported(before, late) == {"not-answered": 6}


def test_new_owner_restarts_counts_without_reporting_a_difference() -> None:
    first = count(100, 0, sent=500, answered=500)
    found = Comparison(first, first).with_look(count(140, 0, sent=2, answered=2))
    assert differences(found) == []
    assert found.first.frames == 140


@given(
    start=st.integers(0, 65535),
    steps=st.lists(st.tuples(st.integers(1, 90_000), st.integers(0, 500)), max_size=8),
)
def test_roll_overs_are_corrected_whatever_was_sent(
    start: int, steps: list[tuple[int, int]]
) -> None:
    first = count(start)
    found, sent, seen = Comparison(first, first), 0, 0
    for ours, foreign in steps:
        sent, seen = sent + ours, seen + ours + foreign
        found = found.with_look(count((start + seen) % 65536, sent=sent, answered=sent))
    assert found.frames == seen
    kinds = {difference.kind: difference.count for difference in differences(found)}
    assert kinds == ({"not-from-here": seen - sent} if seen > sent else {})


def test_count_that_fell_by_less_than_was_sent_rolled_over() -> None:
    assert frames_since(60_000, 1_000, exactly(6_536)) == 6_536
    assert frames_since(60_000, 1_000, exactly(10)) == 6_536
    assert frames_since(500, 10, exactly(20)) is None


def test_own_counts_are_subtracted_since_a_moment() -> None:
    before = DeviceCounters(10, 8, 2, exceptions={2: 1}, turnarounds=(1, 2))
    now = DeviceCounters(15, 12, 3, exceptions={2: 1, 4: 2}, turnarounds=(1, 6))
    assert device_since(now, before) == DeviceCounters(
        5, 4, 1, exceptions={4: 2}, turnarounds=(0, 4)
    )
    # another program counts now, and has counted less
    assert device_since(before, now) == before


def test_load_is_busy_time_per_interval() -> None:
    before, now = LineCounters(busy_seconds=1.0), LineCounters(busy_seconds=2.5)
    assert load_of(now, before, 3.0) == 0.5
    assert load_of(before, now, 3.0) is None
    assert load_of(now, before, 0.0) is None


@contextmanager
def simulated(family: str = "atv71", *, tcp: bool = False) -> Iterator[tuple[Simulation, Line]]:
    """A drive at 2 and an open line to it."""
    with Simulation([DriveSpec(family, 2)]) as simulation:
        link = TcpLink(*simulation.serve_tcp()) if tcp else SerialLink(simulation.serve_pty())
        line = Line(link, timing=QUICK)
        try:
            line.open(wait=5.0)
            yield simulation, line
        finally:
            line.close()


async def ask(line: Line, times: int) -> None:
    for _ in range(times):
        with suppress(ExchangeError):
            await line.read(2, 3201, priority=Priority.OPERATOR_READ)


@pytest.mark.parametrize("tcp", [False, True], ids=["serial", "tcp"])
async def test_replies_lost_on_the_way_back_are_reported(tcp: bool) -> None:
    with simulated(tcp=tcp) as (simulation, line):
        watch = CounterWatch(DriveSession(line, 2, library.load("atv71")))
        await watch.look()
        await ask(line, 5)
        await watch.look()
        assert watch.now().agree
        simulation.faults.rates = FaultRates(lost=1.0)
        await ask(line, 3)
        simulation.faults.rates = FaultRates()
        await watch.look()
        now = watch.now()
        assert [(difference.kind, difference.count) for difference in now.differences] == [
            ("not-answered", 3)
        ]
        assert now.since.timeouts == 3
        counted = dict(now.drive)
        # both functions return the same counters; the keypad port has received nothing
        assert counted[THIS_PORT].frames > 8
        assert counted["Modbus network"].counts_this_line
        assert counted["Keypad port"].counts_this_line is False


@pytest.mark.parametrize("tcp", [False, True], ids=["serial", "tcp"])
async def test_frames_without_a_request_are_explained(tcp: bool) -> None:
    with simulated(tcp=tcp) as (simulation, line):
        watch = CounterWatch(DriveSession(line, 2, library.load("atv71")))
        await watch.look()
        simulation.faults.rates = FaultRates(duplicated=1.0)
        await ask(line, 3)
        simulation.faults.rates = FaultRates()
        await asyncio.sleep(0.1)
        await watch.look()
        (strays,) = (
            difference for difference in watch.now().differences if difference.kind == "strays"
        )
        assert strays.count == 3
        assert "3 copies of replies" in strays.text
        watch.reset_ours()
        assert watch.now().agree


def test_stray_frames_indicate_another_master() -> None:
    request = frame(5, bytes.fromhex("030C810001"))
    frames = [Frame(1.0, "in", request, "late or repeated, device 5")]
    (found,) = stray_difference(1, frames, 0.5, 2, tcp=False)
    assert found.text.startswith("1 frame answers no program's request")
    assert "Address 5: read of register 3201" in found.text
    (older,) = stray_difference(1, frames, 1.0, 2, tcp=False)
    assert "Address 5" not in older.text
    assert stray_difference(0, frames, 0.5, 2, tcp=False) == []


async def test_damaged_and_foreign_frames_are_reported() -> None:
    with simulated() as (simulation, line):
        watch = CounterWatch(DriveSession(line, 2, library.load("atv71")))
        await watch.look()
        drive = simulation.drive(2)
        drive.line_side.answer(2, b"\x03\x0c\x81\x00\x01")
        drive.line_side.count_checksum_error()
        await watch.look()
        kinds = {difference.kind: difference.count for difference in watch.now().differences}
        assert kinds == {"damaged-there": 1, "not-from-here": 2}


async def test_drive_counters_are_reset_and_compared_from_zero(tmp_path: Path) -> None:
    with simulated() as (_, line):
        watch = CounterWatch(DriveSession(line, 2, library.load("atv71")))
        await ask(line, 7)
        await watch.look()
        assert dict(watch.now().drive)[THIS_PORT].last.frames > 7
        journal = Journal(tmp_path)
        await watch.reset_drive(journal)
        assert dict(watch.now().drive)[THIS_PORT].last.frames < 5
        (entry,) = entries_of(journal, watch.session.line_text, 2)
        assert (entry.kind, entry.code, entry.new, entry.answer) == (
            "reset", "function 8, 0A", "0", "ok",
        )  # fmt: skip
        await ask(line, 4)
        await watch.look()
        now = watch.now()
        assert now.agree
        # own counts of the line stay, for other users of them
        assert now.total.requests > now.since.requests


async def test_counters_reset_by_another_source_are_reported() -> None:
    with simulated() as (_, line):
        session = DriveSession(line, 2, library.load("atv71"))
        watch = CounterWatch(session)
        await ask(line, 60)
        await watch.look()
        await line.diagnose(2, 0x0A)
        await watch.look()
        assert [difference.kind for difference in watch.now().differences] == ["counted-anew"]
        await ask(line, 3)
        await watch.look()
        watch.reset_ours()
        assert watch.now().agree


async def test_read_only_line_resets_no_counters(tmp_path: Path) -> None:
    with Simulation([DriveSpec("atv71", 2)]) as simulation:
        line = Line(SerialLink(simulation.serve_pty()), timing=QUICK, read_only=True)
        try:
            line.open(wait=5.0)
            watch = CounterWatch(DriveSession(line, 2, library.load("atv71")))
            assert not watch.can_reset_drive
            with pytest.raises(RequestRefused):
                await watch.reset_drive(Journal(tmp_path))
            await watch.look()
            assert not watch.trouble
        finally:
            line.close()


async def test_drive_without_counters_shows_own_counts_only() -> None:
    with simulated("atv312") as (simulation, line):
        watch = CounterWatch(DriveSession(line, 2, library.load("atv312")))
        assert await watch.echo(5) == 5
        await watch.look()
        assert watch.now().agree
        simulation.faults.rates = FaultRates(lost=1.0)
        assert await watch.echo(2) == 0
        now = watch.now()
        assert [(difference.kind, difference.count) for difference in now.differences] == [
            ("no-answer", 2)
        ]
        assert now.drive == ()


async def test_silent_drive_is_reported_with_own_counts() -> None:
    with simulated() as (simulation, line):
        watch = CounterWatch(DriveSession(line, 2, library.load("atv71")))
        simulation.faults.rates = FaultRates(lost=1.0)
        await watch.look()
        now = watch.now()
        assert "did not answer" in now.trouble
        assert [difference.kind for difference in now.differences] == ["no-answer"]
