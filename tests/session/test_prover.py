"""Polling of a drive pauses for longer and longer until it reacts, and the result."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineLost, NoAnswer, RequestRefused
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.session.clock import Clock
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.proof.prover import NothingToProve, Prover
from tui.session.proof.result import Bracket, silences
from tui.session.work import Stopped

from .fakes import OneDrive

PROFILE = library.load("atv312")
STATUS, LAST_FAULT, TIMEOUT, REACTION, HERTZ, COMMAND = (
    PROFILE[code].address for code in ("ETA", "LFt", "ttO", "SLL", "rFr", "CMD")
)
AT_REST, RUNNING, TRIPPED, SLF = 0x0221, 0x0627, 0x0228, 5
EXCHANGE = 0.01


class OwnTime(Clock):
    """Time that advances only during sleeps."""

    now = 1000.0

    def monotonic(self) -> float:
        """Seconds that only go forward."""
        return self.now

    async def sleep(self, seconds: float) -> None:
        """Let other tasks run, and advance the time."""
        await asyncio.sleep(0)
        self.now += seconds

    def line_time(self, reported: float) -> float:
        """The line has no other time."""
        return self.now


class WatchingDrive(OneDrive):
    """An Altivar 312 that trips after `timeout` seconds without a request."""

    def __init__(self, clock: OwnTime, timeout: float, *, held: float | None = None) -> None:
        super().__init__(dict.fromkeys(range(0x10000), 0))
        self.clock = clock
        self.timeout = timeout
        self.registers[TIMEOUT] = round(10 * (timeout if held is None else held))
        self.registers[REACTION] = 1
        self.registers[STATUS] = AT_REST
        self.fault = SLF
        self.at_twelfth: Callable[[], None] = lambda: None
        """Called with the twelfth read."""
        self.priorities: list[Priority] = []
        self._heard = math.inf

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        paused = self.facts.paused.get(device)
        if paused and priority is not Priority.STOP:
            raise RequestRefused(paused[1])
        now = self.clock.monotonic()
        if now - self._heard > self.timeout:
            self.registers[STATUS] = TRIPPED
            self.registers[LAST_FAULT] = self.fault
            self.registers[HERTZ] = 0
        self._heard = now
        self.priorities.append(priority)
        if len(self.priorities) == 12:
            self.at_twelfth()
        self.clock.now += EXCHANGE

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        self._heard = self.clock.monotonic()
        return await super().write(device, address, values, **how)


def bench(clock: OwnTime, drive: WatchingDrive, *, turning: bool = False) -> Prover:
    session = DriveSession(drive, 1, PROFILE, clock=clock)
    session.arming.arm(seconds=math.inf)
    return Prover(session, Journal(), session.work.permit(), turning)


def test_silences_near_a_2_s_timeout_are_at_most_300_ms_apart() -> None:
    around = [silence for silence in silences(2.0) if 1.5 <= silence <= 2.7]
    steps = [b - a for a, b in pairwise(around)]
    assert max(steps) < 0.3
    assert list(silences(2.0)) == sorted(silences(2.0))
    assert max(silences(40.0)) <= 90.0


@pytest.mark.parametrize("timeout", [0.5, 2.0, 10.0])
async def test_timeout_of_a_drive_that_reacts_as_set_is_bracketed(timeout: float) -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, timeout)
    result = await bench(clock, drive).prove()
    assert result.as_set
    assert result.fault.startswith("SLF")
    bracket = result.bracket
    assert bracket.not_after is not None
    assert bracket.not_before <= timeout <= bracket.not_after
    assert bracket.not_after - bracket.not_before <= 0.15 * timeout + 0.1


@pytest.mark.parametrize(("timeout", "held"), [(0.4, 2.0), (1.0, 2.0), (4.0, 2.0)])
async def test_timeout_that_differs_from_its_setting_is_reported(
    timeout: float, held: float
) -> None:
    clock = OwnTime()
    result = await bench(clock, WatchingDrive(clock, timeout, held=held)).prove()
    assert not result.as_set
    assert "NOT AS SET: the timeout is set to 2 s." in result.text
    assert result.bracket.not_after is not None
    assert result.bracket.not_before <= timeout <= result.bracket.not_after


@pytest.mark.parametrize("timeout", [2.0, math.inf])
async def test_connection_closed_in_a_silence_is_read_after_it_returns(timeout: float) -> None:
    clock, texts, lost = OwnTime(), list[str](), dict[float, float]()

    class BehindAGateway(WatchingDrive):
        """A gateway closes the connection after 1.5 s, and takes the next one 0.3 s later."""

        async def before_read(self, device: int, registers: range, priority: Priority) -> None:
            now = clock.monotonic()
            if now - self._heard > 1.5 and self._heard not in lost:
                lost[self._heard] = now + 0.3
            if now < lost.get(self._heard, 0.0):
                raise LineLost("The line was lost: the other end closed it.")
            await super().before_read(device, registers, priority)

    drive = BehindAGateway(clock, timeout, held=2.0)
    prover = bench(clock, drive)
    prover.report = texts.append
    result = await prover.prove()
    assert lost
    assert any("connection closed" in text for text in texts)
    assert result.as_set is (timeout == 2.0)
    assert result.bracket.not_before <= timeout <= (result.bracket.not_after or math.inf)


async def test_line_that_stays_lost_ends_the_test() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 2.0)
    lost_at: list[float] = []

    async def lost(*_: object) -> None:
        lost_at.append(clock.now)
        raise LineLost("The line was lost: no route.")

    prover = bench(clock, drive)
    prover.report = lambda _: setattr(drive, "before_read", lost)
    with pytest.raises(LineLost):
        await prover.prove()
    assert 10.0 <= clock.now - lost_at[0] < 10.2
    assert not drive.facts.paused


async def test_drive_that_never_reacts_is_reported_in_capitals() -> None:
    clock = OwnTime()
    result = await bench(clock, WatchingDrive(clock, math.inf, held=1.0)).prove()
    assert not result.as_set
    assert result.bracket.not_after is None
    assert result.bracket.measured is None
    assert result.text.startswith("DID NOT REACT to 3.0 s")


async def test_fault_other_than_communication_loss_is_not_as_set() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 1.0)
    drive.fault = 9
    result = await bench(clock, drive).prove()
    assert not result.as_set
    assert "the fault should be SLF" in result.text


async def test_polling_is_paused_during_the_test_and_resumes() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 1.0)
    prover = bench(clock, drive)
    task = asyncio.ensure_future(prover.prove())
    refused = 0
    while not task.done():
        await asyncio.sleep(0)
        if drive.facts.paused:
            with pytest.raises(RequestRefused, match="being tested"):
                await drive.read(1, STATUS)
            refused += 1
    assert refused
    # the setting is read before polling is paused, while all programs still poll
    alone = drive.priorities[drive.priorities.index(Priority.STOP) :]
    assert set(alone) == {Priority.STOP}
    await drive.read(1, STATUS)


async def test_stop_ends_the_test_and_resumes_polling() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 5.0)
    prover = bench(clock, drive)
    drive.at_twelfth = lambda: prover.session.work.stop("the stop key")
    with pytest.raises(Stopped):
        await prover.prove()
    assert len(drive.priorities) >= 12
    assert not drive.facts.paused


async def test_turning_motor_is_tested_only_if_confirmed() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 1.0)
    drive.registers[STATUS] = RUNNING
    with pytest.raises(OrderRefused, match="hoist load may fall"):
        await bench(clock, drive).prove()
    result = await bench(clock, drive, turning=True).prove()
    assert result.seen == "trips"
    drive.registers[STATUS] = AT_REST
    with pytest.raises(OrderRefused, match="at standstill"):
        await bench(clock, drive, turning=True).prove()


async def test_motor_that_starts_during_the_test_is_polled_again() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 5.0)

    def terminals_run_it() -> None:
        drive.registers[STATUS] = RUNNING

    drive.at_twelfth = terminals_run_it
    with pytest.raises(OrderRefused, match="started to turn"):
        await bench(clock, drive).prove()
    assert len(drive.priorities) < 25
    assert not drive.facts.paused


async def test_foreign_change_during_the_test_invalidates_it() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 1.0)

    def keypad() -> None:
        drive.registers[TIMEOUT] = 50

    drive.at_twelfth = keypad
    with pytest.raises(OrderRefused, match=r"ttO changed during it, and is now 5.0 s"):
        await bench(clock, drive).prove()


async def test_long_timeout_gets_longer_silences() -> None:
    clock = OwnTime()
    result = await bench(clock, WatchingDrive(clock, 100.0)).prove()
    assert result.as_set
    found = list(silences(100.0))
    assert found == sorted(set(found)), "no silence is kept twice"
    assert max(found) == 160.0


async def test_without_visible_reaction_or_with_fault_is_refused() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 1.0)
    drive.registers[REACTION] = 0
    with pytest.raises(OrderRefused, match="nothing shows at standstill"):
        await bench(clock, drive).prove()
    drive.registers[REACTION], drive.registers[STATUS] = 1, TRIPPED
    with pytest.raises(OrderRefused, match="Reset it first"):
        await bench(clock, drive).prove()


async def test_disabled_timeout_is_not_tested() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 1.0)
    drive.registers[TIMEOUT] = 0
    with pytest.raises(NothingToProve, match="does not react"):
        await bench(clock, drive).prove()
    assert not drive.facts.paused


async def test_reaction_changed_by_another_source_is_reported() -> None:
    clock = OwnTime()
    drive = WatchingDrive(clock, 1.0)
    prover = bench(clock, drive)
    prover.session.image.confirm("ttO", 100, clock.monotonic())
    result = await prover.prove()
    assert result.changed.startswith("ttO is 1.0 s; it was 10.0 s when")


def test_bracket_never_contradicts_itself() -> None:
    bracket = Bracket().alive(1.9).reacted(1.8)
    assert bracket.not_after == 1.9
    assert not Bracket().alive(3.0).holds(1.0)


class WithoutModule(OneDrive):
    """A Powerdrive that is silent at some words, as the family is where it has none."""

    def __init__(self, clock: OwnTime, *codes: str) -> None:
        self.profile = library.load("powerdrive")
        super().__init__({parameter.address: 0 for parameter in self.profile.parameters})
        self.clock = clock
        self.silent = {self.profile[code].address for code in codes}

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        self.clock.now += EXCHANGE
        if self.silent.intersection(registers):
            raise NoAnswer(device, 3, registers.start)


@pytest.mark.parametrize(
    ("codes", "reported"),
    [
        (("15.07",), "11.63 is Off. The drive does not react .* 15.07 cannot be read; perhaps"),
        (("15.07", "11.63"), "Not tested: 15.07 and 11.63 cannot be read; .* is unknown"),
    ],
)
async def test_missing_ports_of_the_drive_are_named(codes: tuple[str, ...], reported: str) -> None:
    clock = OwnTime()
    drive = WithoutModule(clock, *codes)
    session = DriveSession(drive, 1, drive.profile, clock=clock)
    session.arming.arm(seconds=math.inf)
    with pytest.raises(NothingToProve, match=reported):
        await Prover(session, Journal(), session.work.permit()).prove()
    assert not drive.facts.paused


async def test_silent_drive_is_reported_as_such() -> None:
    clock = OwnTime()
    drive = WithoutModule(clock, "15.07", "6.42", "6.43")
    session = DriveSession(drive, 1, drive.profile, clock=clock)
    session.arming.arm(seconds=math.inf)
    with pytest.raises(NoAnswer):
        await Prover(session, Journal(), session.work.permit()).prove()


@pytest.mark.parametrize("timeout", [2.0, 10.0])
def test_silences_are_dense_around_the_timeout(timeout: float) -> None:
    expected = [0.25, 0.5, 0.7, 0.82, 0.94, 1.06, 1.18, 1.6, 2.2, 3.0]
    assert list(silences(timeout)) == pytest.approx([share * timeout for share in expected])
    assert list(silences(40.0))[-3:] == [64.0, 88.0, 90.0]


async def test_reaction_that_shows_a_moment_later_is_named() -> None:
    clock = OwnTime()

    class Slow(WatchingDrive):
        """The fault code is set 0.25 s after the state."""

        tripped = math.inf

        async def before_read(self, device: int, registers: range, priority: Priority) -> None:
            await super().before_read(device, registers, priority)
            if self.registers[STATUS] == TRIPPED:
                self.tripped = min(self.tripped, clock.now)
            is_set = clock.now - self.tripped > 0.25
            self.registers[LAST_FAULT] = SLF if is_set else 0

    drive = Slow(clock, 1.0)
    result = await bench(clock, drive).prove()
    assert result.as_set
    assert result.fault.startswith("SLF")
    assert clock.now - drive.tripped < 1.0


class TurningDrive(WatchingDrive):
    """A drive at 50 Hz; after its timeout it runs on in another state, at another frequency."""

    def __init__(self, clock: OwnTime, status: int, hertz: float) -> None:
        super().__init__(clock, 1.0)
        self.registers[STATUS], self.registers[HERTZ] = RUNNING, 500
        self.after = status, round(10 * hertz)

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        await super().before_read(device, registers, priority)
        if self.registers[STATUS] == TRIPPED:
            self.registers[STATUS], self.registers[HERTZ] = self.after


@pytest.mark.parametrize(
    ("status", "hertz", "seen"),
    [(RUNNING, 39.9, "slows down"), (RUNNING, 40.0, ""), (AT_REST, 0.0, "stops")],
)
async def test_motor_that_slows_down_has_reacted(status: int, hertz: float, seen: str) -> None:
    clock = OwnTime()
    result = await bench(clock, TurningDrive(clock, status, hertz), turning=True).prove()
    assert result.seen == seen
    assert result.fault == ""


async def test_stop_within_a_silence_ends_it_at_once() -> None:
    clock = OwnTime()
    prover = bench(clock, WatchingDrive(clock, math.inf, held=40.0))
    begun: list[float] = []

    def pause(_: str) -> None:
        begun.append(clock.now)
        prover.session.work.stop("the stop key")

    prover.report = pause
    with pytest.raises(Stopped):
        await prover.prove()
    assert [clock.now - since for since in begun] == [0.0], "a pause of 10 s had begun"


async def test_stop_at_the_end_of_a_silence_prevents_the_read() -> None:
    begun: list[float] = []

    class StoppedThen(OwnTime):
        """A stop arrives as the first silence of 0.25 s ends."""

        async def sleep(self, seconds: float) -> None:
            await super().sleep(seconds)
            if begun and self.now - begun[0] > 0.2499:
                prover.session.work.stop("the stop key")

    clock = StoppedThen()
    drive = WatchingDrive(clock, math.inf, held=1.0)
    prover = bench(clock, drive)
    prover.report = lambda _: begun.append(clock.now)
    with pytest.raises(Stopped):
        await prover.prove()
    assert len(begun) == 1
    assert drive._heard < begun[0]


ATV71 = library.load("atv71")


class WatchedFromItsFirstCommand(OneDrive):
    """An Altivar 71 that watches the line once a command was written, and then trips."""

    def __init__(self, clock: OwnTime, *, profile_in_force: int) -> None:
        super().__init__(dict.fromkeys(range(0x10000), 0))
        self.clock = clock
        self.commands: list[tuple[int, Priority]] = []
        self.reads_after_command: list[int] = []
        for code, raw in {"TTO": 10, "SLL": 1, "ETA": AT_REST, "CHCF": profile_in_force}.items():
            self.registers[ATV71[code].address] = raw
        self._heard = math.inf

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        if self.commands and self.clock.now - self._heard > 1.0:
            self.registers[ATV71["ETA"].address] = TRIPPED
            self.registers[ATV71["LFT"].address] = SLF
        self._heard = self.clock.now
        if self.commands:
            self.reads_after_command += registers
        self.clock.now += EXCHANGE

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        assert address == ATV71["CMD"].address
        self.commands.append((values[0], how["priority"]))
        self._heard = self.clock.now
        return await super().write(device, address, values, **how)


def bench_71(clock: OwnTime, drive: OneDrive) -> Prover:
    session = DriveSession(drive, 1, ATV71, clock=clock)
    session.arming.arm(seconds=math.inf)
    return Prover(session, Journal(), session.work.permit())


async def test_timeout_is_started_with_a_command_that_moves_nothing() -> None:
    clock = OwnTime()
    drive = WatchedFromItsFirstCommand(clock, profile_in_force=1)
    prover = bench_71(clock, drive)
    result = await prover.prove()
    assert result.as_set
    assert drive.commands == [(0x0006, Priority.STOP)]
    assert ATV71["CMD"].address not in drive.reads_after_command
    prover.journal.flush()
    entry = prover.journal.recent[-1]
    assert (entry.code, entry.why) == ("CMD", "starts communication monitoring, moves nothing")


async def test_timeout_test_in_a_profile_without_commands_is_refused() -> None:
    clock = OwnTime()
    drive = WatchedFromItsFirstCommand(clock, profile_in_force=0)
    with pytest.raises(OrderRefused, match="state of the drive is unknown"):
        await bench_71(clock, drive).prove()
    assert drive.commands == []


async def test_stop_before_the_timeout_starts_prevents_its_command() -> None:
    clock = OwnTime()
    drive = WatchedFromItsFirstCommand(clock, profile_in_force=1)
    prover = bench_71(clock, drive)
    prover.session.work.stop("the stop key")
    with pytest.raises(Stopped):
        await prover.prove()
    assert drive.commands == []
