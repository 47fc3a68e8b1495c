"""Blocks and scanner while monitoring: used where they save time, never one value as another."""

from __future__ import annotations

import asyncio
import itertools
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

import pytest
import pytest_asyncio

from tests.blocks import block_of
from tests.programs import rtu_tcp
from tests.waiting import until
from tui.bus.api import ModbusLine, Priority
from tui.bus.fake import FakeLine
from tui.drive.profile import library
from tui.session.connect.limits import limits_of
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.drive import DriveSession
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.snapshot import Snapshot
from tui.session.read.reader import Reader
from tui.session.read.slots import Slots
from tui.session.reading import Reading
from tui.session.shown import Quality
from tui.simulator import DriveSpec, LineTiming, Simulation

from .fake_clock import FakeClock

pytestmark = pytest.mark.long

INPUTS = next(b.address for b in library.load("atv71").data.blocks if b.direction == "read")
"""First register of the scanner's inputs."""
TRIES = 5
SCATTERED = {"NCV": 7, "VCAL": 2, "INV": 120, "LSP": 41, "HSP": 523, "ACC": 37, "DEC": 59}
"""Words of an Altivar 71 that lie apart from each other and stay as they are set."""


@pytest.fixture
def start() -> Iterator[Start]:
    """A simulated drive and a line to it, closed afterwards."""
    opened: list[tuple[Simulation, OpenLine]] = []

    def begin(spec: DriveSpec, timing: LineTiming | None = None) -> tuple[Simulation, OpenLine]:
        simulation = Simulation([spec], timing=timing)
        simulation.start()
        line = open_line(rtu_tcp(simulation), wait=5.0)
        opened.append((simulation, line))
        return opened[-1]

    yield begin
    for simulation, line in opened:
        line.close()
        simulation.stop()


class Start(Protocol):
    """Begins a simulated drive; its line is as fast as it can be, or as slow as a real one."""

    def __call__(
        self, spec: DriveSpec, timing: LineTiming | None = None
    ) -> tuple[Simulation, OpenLine]: ...


def scattered(count: int) -> dict[str, int]:
    """Writable words of the Altivar 71, far apart, each with its own value."""
    profile = library.load("atv71")
    found: dict[str, int] = {}
    last = -100
    for parameter in sorted(profile.data.parameters, key=lambda p: p.address):
        apart = parameter.address > last + 30
        plain = parameter.type == "uint16" and parameter.access == "rw" and not parameter.bits
        wide = (parameter.max or 0) - (parameter.min or 0) > 200
        if apart and plain and wide and not parameter.min_from and parameter.scale_by is None:
            found[parameter.code] = (parameter.min or 0) + 17 + 3 * len(found)
            last = parameter.address
        if len(found) == count:
            return found
    raise AssertionError("not so many words lie apart")


def assignment(codes: list[str]) -> dict[str, int]:
    profile = library.load("atv71")
    addresses = [profile[code].address for code in codes]
    return {f"NMA{place}": address for place, address in enumerate(addresses, start=1)}


def requests(monitor: Monitor, codes: Iterable[str]) -> int:
    """Count the requests that return these words."""
    plan = monitor.reader._plans.plan(frozenset(codes), monitor.reader.in_force)
    return len(plan.requests) + len(plan.checks)


def wrong(snapshots: list[Snapshot], expected: Mapping[str, int]) -> list[tuple[str, int | None]]:
    return [
        (code, reading.raw)
        for snapshot in snapshots
        for code, reading in snapshot.readings.items()
        if code in expected and reading.quality is Quality.GOOD and reading.raw != expected[code]
    ]


async def test_scanner_is_used_once_it_saves_time(start: Start) -> None:
    words = scattered(6)
    simulation, opened = start(DriveSpec("atv71", 1, sets=words))
    monitor = Monitor(DriveSession(opened.line, 1, library.load("atv71")))
    monitor.start(list(words), period=0.1)
    snapshots: list[Snapshot] = []
    monitor.listen(snapshots.append)
    await until(lambda: len(snapshots) > 3)
    assert snapshots[-1].block == ""
    assert requests(monitor, words) == len(words)
    for slot, address in assignment(list(words)).items():
        simulation.drive(1).set(slot, address)
    await until(lambda: bool(snapshots[-1].block))
    assert snapshots[-1].block == "Scanner inputs"
    assert requests(monitor, words) == 2
    assert not wrong(snapshots, words)
    monitor.stop()


@dataclass(slots=True)
class Shared:
    """A drive that another program reads as well: its values are reused for a minute."""

    simulation: Simulation
    line: ModbusLine
    reader: Reader
    codes: list[str]
    words: dict[str, int]

    def change_slots(self) -> None:
        """Reverse the order of the scanner's values."""
        for slot, address in assignment(self.codes[::-1]).items():
            self.simulation.drive(1).set(slot, address)

    async def another_reads(self, address: int) -> None:
        """Another program has just read the words from an address on."""
        count = len(self.codes)
        await self.line.read(1, address, count, priority=Priority.POLL, max_age=1e-9)

    async def read(self) -> dict[str, int]:
        """Values of the reader that are wrong."""
        found = await self.reader.read(self.codes, priority=Priority.POLL)
        good = {
            code: reading.raw for code, reading in found.items() if reading.quality is Quality.GOOD
        }
        return {code: raw for code, raw in good.items() if raw not in (None, self.words[code])}


@pytest_asyncio.fixture
async def shared(start: Start) -> Shared:
    words = scattered(6)
    codes = list(words)
    simulation, opened = start(DriveSpec("atv71", 1, sets=words | assignment(codes)))
    reader = Reader(DriveSession(opened.line, 1, library.load("atv71")), max_age=60.0)
    await reader.learn_slots()
    made = Shared(simulation, opened.line, reader, codes, words)
    assert await made.read() == {}
    assert reader.using == "Scanner inputs"
    return made


async def test_slots_read_before_the_block_are_read_again(shared: Shared) -> None:
    shared.change_slots()
    await shared.another_reads(INPUTS)
    assert await shared.read() == {}


async def test_block_read_before_its_slots_is_read_again(shared: Shared) -> None:
    await shared.another_reads(INPUTS)
    shared.change_slots()
    await shared.another_reads(library.load("atv71")["NMA1"].address)
    await shared.reader.learn_slots()
    assert await shared.read() == {}


async def test_own_values_are_read_again_but_shared_ones_are_not(
    shared: Shared,
) -> None:
    reads = len(shared.line.trace)
    assert await shared.read() == {}
    assert len(shared.line.trace) > reads
    for _ in range(TRIES):  # on a busy machine what was read may be old by then
        await shared.another_reads(INPUTS)
        await shared.another_reads(library.load("atv71")["NMA1"].address)
        reads = len(shared.line.trace)
        assert await shared.read() == {}
        if len(shared.line.trace) == reads:
            return
    raise AssertionError("what another program has just read was read again")


async def test_scanner_changed_while_monitoring_never_mixes_values(start: Start) -> None:
    words = scattered(6)
    codes = list(words)
    simulation, opened = start(DriveSpec("atv71", 1, sets=words | assignment(codes)))
    monitor = Monitor(DriveSession(opened.line, 1, library.load("atv71")))
    snapshots: list[Snapshot] = []
    monitor.listen(snapshots.append)
    monitor.start(codes, period=0.05)
    await until(lambda: bool(snapshots and snapshots[-1].block))
    orders = itertools.cycle(itertools.permutations(codes))
    end = time.monotonic() + 6.0
    changes = 0
    while time.monotonic() < end:
        for slot, address in assignment(list(next(orders))).items():
            simulation.drive(1).set(slot, address)
        changes += 1
        await asyncio.sleep(0.003 * (changes % 37))
    assert changes > 50
    assert sum(bool(snapshot.block) for snapshot in snapshots) > 5
    assert not wrong(snapshots, words)
    monitor.stop()


BLOCK_CODES = ["FD01", "FD00", "FE03", "FE05", "FE90"]
BLOCK = {"F875": 1, "F876": 2, "F877": 3, "F878": 4, "F879": 11}


async def test_fault_discards_the_confirmed_slots(start: Start) -> None:
    simulation, opened = start(DriveSpec("atv21", 1, sets=BLOCK, run_hz=35.0))
    monitor = Monitor(DriveSession(opened.line, 1, library.load("atv21")))
    monitor.start(period=0.1)
    await until(lambda: bool(monitor.latest and monitor.latest.block))
    simulation.drive(1).provoke("OC1")
    await until(lambda: bool(monitor.latest and not monitor.latest.block))
    assert monitor.latest is not None
    assert monitor.latest.state.kind == "fault"
    monitor.stop()


async def test_indirect_block_is_used_once_confirmed(start: Start) -> None:
    simulation, opened = start(DriveSpec("atv21", 1, sets=BLOCK, run_hz=35.0))
    monitor = Monitor(DriveSession(opened.line, 1, library.load("atv21")))
    snapshots: list[Snapshot] = []
    monitor.listen(snapshots.append)
    monitor.start(period=0.1)
    await until(lambda: bool(snapshots and snapshots[-1].block == "Read block"))
    assert monitor.reader.seconds(["FD01", "FD00", "FE03", "FE05", "FE90"]) > 0
    # the new assignment applies after the next reset: the block keeps returning the same
    for slot, raw in {"F875": 2, "F876": 1}.items():
        opened.line.facts.leases.arm(1, None, monitor.session.care())
        await opened.line.write(1, monitor.profile[slot].address, [raw])
    await until(lambda: not {"F875", "F876"} & monitor.reader.in_force.keys())
    assert simulation.drive(1).raw("F875") == 2
    simulation.drive(1).power_cycle()
    await asyncio.sleep(3.0)
    for snapshot in snapshots:
        status = snapshot.readings.get("FD01")
        if status is not None and status.quality is Quality.GOOD:
            # a frequency of 35.00 Hz or on its way there is no status word of this drive
            assert status.raw is not None
            assert status.raw & 0x6000 or snapshot.state.kind in ("starting", "fault", "blocked")
    monitor.stop()


@pytest.mark.sweep
async def test_every_slot_is_confirmed_on_a_slow_line_with_moving_values(start: Start) -> None:
    _, opened = start(
        DriveSpec("atv21", 1, sets=BLOCK, run_hz=35.0), LineTiming(19200, "8N1", True)
    )
    monitor = Monitor(DriveSession(opened.line, 1, library.load("atv21")))
    monitor.start(period=0.05)
    await until(lambda: monitor.reader.in_force == BLOCK, 60.0)
    # all five in one request, in little more than the time of two words
    assert monitor.reader.seconds(BLOCK_CODES) < 2 * monitor.reader.seconds(["FE22"])
    monitor.stop()


@pytest.mark.sweep
async def test_pending_assignment_is_never_confirmed(start: Start) -> None:
    simulation, opened = start(DriveSpec("atv21", 1, sets=BLOCK, run_hz=35.0))
    monitor = Monitor(DriveSession(opened.line, 1, library.load("atv21")))
    # chosen since the last reset: the block brings what it brought before
    for slot, raw in {"F876": 3, "F877": 2}.items():
        opened.line.facts.leases.arm(1, None, monitor.session.care())
        await opened.line.write(1, monitor.profile[slot].address, [raw])
    assert simulation.drive(1).raw("F876") == 3
    monitor.start(period=0.05)
    await until(lambda: {"F875", "F878", "F879"} <= monitor.reader.in_force.keys(), 60.0)
    await asyncio.sleep(3.0)
    assert not {"F876", "F877"} & monitor.reader.in_force.keys()
    monitor.stop()


async def test_comparison_applies_before_slots_are_read_again() -> None:
    profile = library.load("atv21")
    block = block_of(profile, "read")
    raws = {choice.parameter: choice.raw for choice in block.choices}
    chosen = dict(zip(block.slots, ("FE03", "FE05", "FD01", "FE90", "FD00"), strict=True))
    held = {code: 1000 + 37 * raw for code, raw in raws.items()}
    held |= {slot: raws[code] for slot, code in chosen.items()}
    brings = dict(enumerate((held[code] for code in chosen.values()), start=block.address))
    clock, line = FakeClock(), FakeLine({1: brings})
    line.describe(1, limits_of(profile))
    slots = Slots(line, 1, profile, clock)

    async def ask(codes: Iterable[str]) -> dict[str, Reading]:
        return {
            code: Reading(profile[code], held[code], None, Quality.GOOD, clock.monotonic())
            for code in codes
        }

    slots.heard()
    await slots.learn(ask)
    assert not slots.in_force()
    for _ in range(60):
        await slots.compare(ask)
    assert slots.in_force() == {slot: raws[code] for slot, code in chosen.items()}
