"""Monitoring over failed requests: values that stay known, are read again, or are dropped."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Iterable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest

from tests.waiting import until
from tui.bus.api import LineWorker, Priority
from tui.bus.errors import ChecksumFault, LineLost, NoAnswer
from tui.session.drive import DriveSession
from tui.session.monitor.monitor import FORGOTTEN_AFTER, Monitor
from tui.session.monitor.snapshot import Snapshot
from tui.session.read.rotation import Rotation
from tui.session.shown import Quality

from .fakes import OneDrive, parameter, profile_of
from .test_prover import OwnTime

Cycles = list[tuple[Snapshot, list[int]]]
"""Each snapshot with the addresses requested for it."""
STATE, SPEED, REFUSED, FIRST_SLOW = 10, 20, 900, 1000
SLOW = 12
RUNNING, FAULT = 1, 2

PROFILE = profile_of(
    parameter("STATE", STATE),
    parameter("SPEED", SPEED),
    parameter("NOT", REFUSED),
    *(parameter(f"SLOW{i}", FIRST_SLOW + 100 * i) for i in range(SLOW)),
    monitoring={
        "values": [
            {"parameter": "STATE"},
            {"parameter": "SPEED"},
            {"parameter": "NOT", "rate": "slow"},
            *({"parameter": f"SLOW{i}", "rate": "slow"} for i in range(SLOW)),
        ]
    },
    charts=[
        {
            "id": "drivecom",
            "name": "Drivecom",
            "kind": "drivecom",
            "status": "STATE",
            "states": [
                {"id": "run", "name": "Run", "kind": "running", "mask": 3, "value": RUNNING},
                {"id": "fault", "name": "Fault", "kind": "fault", "mask": 3, "value": FAULT},
            ],
        }
    ],
)


class FaultyLine(OneDrive):
    """The next requests fail with the errors in `faults`."""

    def __init__(self) -> None:
        registers = {FIRST_SLOW + 100 * i: i for i in range(SLOW)}
        super().__init__({STATE: RUNNING, SPEED: 500, **registers})
        self.fail_read(1, REFUSED, 2)
        self.faults: list[Exception | None] = []
        self.addresses: list[int] = []
        """Requests, answered or not."""
        self.task: asyncio.Task[object] | None = None

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        fault = self.faults.pop(0) if self.faults else None
        self.addresses.append(registers.start)
        if fault is not None:
            raise fault

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        worker = super().spawn(work, name)
        assert isinstance(worker, asyncio.Task)
        self.task = worker
        return worker


class Bench:
    """A monitor, its line, and the requests of each cycle."""

    def __init__(self) -> None:
        self.line = FaultyLine()
        self.monitor = Monitor(DriveSession(self.line, 1, PROFILE))
        self.cycles: Cycles = []
        self.monitor.listen(self._take)

    def _take(self, snapshot: Snapshot) -> None:
        self.cycles.append((snapshot, list(self.line.addresses)))
        self.line.addresses.clear()

    async def run(self, cycles: int) -> Cycles:
        """The next cycles."""
        self.cycles.clear()
        if self.line.task is None:
            self.monitor.start(period=0.01)
        end = time.monotonic() + 60
        while len(self.cycles) < cycles:
            assert self.line.task is not None
            assert not self.line.task.done()
            assert time.monotonic() < end
            await asyncio.sleep(0.005)
        return self.cycles[:cycles]

    async def fail(self, *faults: Exception | None, cycles: int) -> Cycles:
        """The next cycles, of which the first requests fail so."""
        self.line.faults.extend(faults)
        return await self.run(cycles)

    async def end(self) -> None:
        self.monitor.stop()
        if self.line.task is not None:
            with suppress(asyncio.CancelledError):
                await self.line.task


@pytest.fixture
async def bench() -> Any:
    made = Bench()
    yield made
    await made.end()


def silence() -> NoAnswer:
    return NoAnswer(1, 3, STATE)


async def test_one_failed_request_repeats_only_its_cycle(bench: Bench) -> None:
    await bench.run(12)
    failed, after = await bench.fail(silence(), cycles=2)
    assert failed[0].error
    assert not after[0].error
    assert STATE in after[1]
    assert len(after[1]) <= 4  # the fast values and one turn of the slow ones
    assert REFUSED not in after[1]  # it is still known that the drive does not have it


async def test_failed_cycle_shows_its_error_and_no_new_values(bench: Bench) -> None:
    await bench.run(3)
    (before, _), *_ = await bench.run(1)
    bench.line.registers[SPEED] = 777
    # one request of the cycle is answered, the next is not
    ((failed, _),) = await bench.fail(None, silence(), cycles=1)
    assert failed.error
    times = {code: reading.time for code, reading in before.readings.items()}
    assert all(r.time <= max(times[c], before.time) for c, r in failed.readings.items())
    assert failed.readings["SPEED"].raw == 500
    (after, _), *_ = await bench.run(1)
    assert after.readings["SPEED"].raw == 777


async def test_monitor_that_begins_on_a_silent_drive_shows_what_is_known(bench: Bench) -> None:
    (before, _), *_ = await bench.run(1)
    await bench.end()
    bench.line.task = None
    ((failed, _),) = await bench.fail(silence(), cycles=1)
    assert failed.error
    assert failed.readings["SPEED"].raw == 500
    assert failed.readings["SPEED"].time == before.readings["SPEED"].time


@pytest.mark.parametrize("fault", [LineLost("gone"), None], ids=["line lost", "many failures"])
async def test_value_possibly_of_another_drive_is_read_again(
    bench: Bench, fault: Exception | None
) -> None:
    await bench.run(12)
    faults = [fault] if fault else [silence() for _ in range(FORGOTTEN_AFTER)]
    cycles = await bench.fail(*faults, cycles=len(faults) + 12)
    assert [bool(s.error) for s, _ in cycles] == [True] * len(faults) + [False] * 12
    requested = {address for _, addresses in cycles[len(faults) :] for address in addresses}
    assert {REFUSED, *(FIRST_SLOW + 100 * i for i in range(SLOW))} <= requested


async def test_refused_words_are_read_again_after_a_failure_in_fault(bench: Bench) -> None:
    bench.line.registers[STATE] = FAULT
    await bench.run(12)
    cycles = await bench.fail(silence(), cycles=10)
    assert [bool(s.error) for s, _ in cycles] == [True] + [False] * 9
    assert any(REFUSED in addresses for _, addresses in cycles)


async def test_snapshot_is_stale_after_three_cycles(bench: Bench) -> None:
    ((snapshot, _),) = await bench.run(1)
    slow = replace(snapshot, period=2.0)
    assert not slow.is_stale(slow.time + 5.9)
    assert slow.is_stale(slow.time + 6.1)
    # however fast the cycles are, a terminal is a moment behind them
    fast = replace(snapshot, period=0.05)
    assert not fast.is_stale(fast.time + 1.4)
    assert fast.is_stale(fast.time + 1.6)


async def test_values_are_stale_after_three_failed_cycles(bench: Bench) -> None:
    await bench.run(3)
    bench.line.silence(1)
    cycles = await bench.run(12)
    for snapshot, _ in cycles:
        reading = snapshot.readings["SPEED"]
        stale = reading.quality is Quality.STALE
        assert stale is (snapshot.time - reading.time > 3 * snapshot.period)
    assert reading.quality is Quality.STALE
    # stale words give no state
    assert snapshot.state.kind == "unknown"


async def test_failed_cycle_leaves_a_gap_in_the_trend(bench: Bench) -> None:
    bench.monitor._trend._codes = ["SPEED", None, None]
    await bench.run(2)
    await bench.fail(silence(), cycles=1)
    await bench.run(1)
    frequencies = [point.values[0] for point in bench.monitor.trend[:4]]
    assert frequencies == [500, 500, None, 500]


def one_each(codes: Iterable[str]) -> list[tuple[str, ...]]:
    return [(code,) for code in codes]


def test_failed_range_is_halved_then_doubled() -> None:
    due, codes = Rotation(10), tuple("abcdefgh")
    due.add(codes)
    requested = []
    for fails in (True, True, False, False, False, False):
        requested.append(due.turn(codes, one_each))
        if fails:
            due.failed(one_each)
        else:
            due.came()
    assert ["".join(turn) for turn in requested[:5]] == ["abcdefgh", "abcd", "ab", "cdef", "gh"]
    assert len(requested[5]) <= 1  # the usual turns again


def test_all_parameters_get_their_turn_although_some_fail() -> None:
    due, codes = Rotation(10), tuple("abcdefghijklmnopqrstuvwxyz")
    read: set[str] = set()
    for cycle in range(120):
        turn = due.turn(codes, one_each)
        if cycle % 2:
            due.failed(one_each)
        else:
            read.update(turn)
            due.came()
    assert read == set(codes)


def test_unreadable_values_are_not_retried_forever() -> None:
    due = Rotation(10)
    due.add("ab")
    due.turn("ab", one_each)
    due.failed(one_each)
    for _ in range(3):
        due.turn("ab", lambda codes: [])
        due.came()
    assert due.turn("ab", lambda codes: []) == ()


async def test_paused_drive_is_not_polled_and_has_a_reason(bench: Bench) -> None:
    await bench.run(2)
    bench.monitor.pause_reason = lambda: "Left alone."
    reported = await bench.run(FORGOTTEN_AFTER + 2)
    assert [requested for _, requested in reported[1:]] == [[]] * (len(reported) - 1)
    assert reported[-1][0].error == "Left alone."
    bench.monitor.pause_reason = lambda: ""
    assert not (await bench.run(3))[-1][0].error


@pytest.mark.parametrize(
    ("fault", "contact"),
    [
        (NoAnswer(1, 3, STATE), "silent"),
        (ChecksumFault(1, 3, STATE), "damaged"),
        (LineLost("The line is lost."), "not_polled"),
    ],
)
async def test_failed_cycle_is_silent_damaged_or_not_polled(
    bench: Bench, fault: Exception, contact: str
) -> None:
    good, _ = (await bench.run(1))[0]
    assert good.contact == "answers"
    failed, _ = (await bench.fail(fault, cycles=2))[-1]
    found = {snapshot.contact for snapshot, _ in bench.cycles if snapshot.error}
    assert found == {contact}, failed


async def test_drive_that_refuses_every_read_is_neither_silent_nor_read(bench: Bench) -> None:
    for address in (STATE, SPEED, *(FIRST_SLOW + 100 * i for i in range(SLOW))):
        bench.line.fail_read(1, address, 2)
    seen, _ = (await bench.run(2))[-1]
    assert seen.contact == "refused"


async def test_claim_of_another_program_lengthens_the_first_cycle(bench: Bench) -> None:
    before_read = bench.line.before_read

    async def claimed(device: int, registers: range, priority: Priority) -> None:
        bench.line.pace.claim("another", 2, 1.0, 0.1)
        await before_read(device, registers, priority)

    bench.line.before_read = claimed  # type: ignore[method-assign]
    seen, _ = (await bench.run(1))[0]
    assert seen.period >= 10 * seen.wished
    assert seen.too_slow


async def test_cycle_without_any_value_is_not_a_refusal(bench: Bench) -> None:
    bench.monitor.start([], period=0.01)
    for snapshot, _ in await bench.run(2):
        assert not snapshot.readings
        assert snapshot.contact != "refused"


async def test_measured_period_is_the_average_of_the_last_cycles() -> None:
    class Slow(FaultyLine):
        """Each cycle takes a tenth of a second longer than the one before."""

        async def before_read(self, device: int, registers: range, priority: Priority) -> None:
            if registers.start == STATE:
                clock.now += 0.6 + len(found) / 10

    clock, line = OwnTime(), Slow()
    session = DriveSession(line, 1, PROFILE, clock=clock)
    monitor = Monitor(session)
    found: list[Snapshot] = []
    monitor.listen(lambda cycle: monitor.stop() if len(found) == 9 else found.append(cycle))
    monitor.start(("STATE",), period=0.5)
    await until(lambda: not monitor.running)
    took = [0.6 + number / 10 for number in range(9)]
    spans = [took[max(0, number - 5) : number] for number in range(9)]
    periods = [sum(span) / len(span) if span else 0.5 for span in spans]
    assert [cycle.period for cycle in found] == pytest.approx(periods)
    assert [cycle.rate for cycle in found] == pytest.approx([1 / period for period in periods])
    assert [cycle.cycle for cycle in found] == list(range(1, 10))
    assert {cycle.wished for cycle in found} == {0.5}
    assert [cycle.time - found[0].time for cycle in found] == pytest.approx(
        [sum(took[1:number]) for number in range(1, 10)]
    )
