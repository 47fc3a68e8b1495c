"""Commanding simulated drives of every family over a real line, by the words of their manuals."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.limits import ARMED_FOR
from tests.sent import words_written
from tests.session.sets_bench import state_known
from tests.waiting import until
from tui.bus.line import Line, Timing
from tui.bus.link import RtuTcpLink
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.session.command.commander import Commander
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.work import Outcome, OutcomeKind
from tui.simulator import DriveSpec, Simulation
from tui.simulator.drive import SimulatedDrive

from .fake_clock import FakeClock, let_go_until

FAMILIES = ["atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca"]
ALTIVARS = FAMILIES[:4]


class Bench(NamedTuple):
    """A drive, its line, and its commander."""

    drive: SimulatedDrive
    line: Line
    console: DriveConsole
    stopper: Stopper
    simulation: Simulation

    @property
    def commander(self) -> Commander:
        return self.console.commander

    @property
    def session(self) -> DriveSession:
        return self.console.session

    async def done(self, kind: OutcomeKind = OutcomeKind.DONE, seconds: float = 10.0) -> str:
        """Result of the last command."""
        before = self.commander.outcome
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            now: Outcome | None = self.commander.outcome
            if now is not before and now is not None:
                assert now.kind is kind, now.text
                return now.text
            await asyncio.sleep(0.01)
        raise AssertionError("the order came to nothing")

    async def order(self, id: str, kind: OutcomeKind = OutcomeKind.DONE) -> str:
        self.commander.order(id)  # type: ignore[arg-type]
        return await self.done(kind)

    async def arm(self) -> None:
        """Arm; a state that is not fresh is read before."""
        self.commander.arm()
        await self.until(lambda: self.session.arming.armed)

    @property
    def clock(self) -> FakeClock:
        """Clock of the session and the drive."""
        assert isinstance(self.session.clock, FakeClock)
        return self.session.clock

    async def let_go_until(self, holds: Callable[[], bool]) -> None:
        """Advance the time of the session and of the drive until something holds."""
        await let_go_until(self.clock, holds)

    async def until(self, holds: Callable[[], bool], seconds: float = 60.0) -> None:
        await until(holds, seconds)

    @property
    def stopped(self) -> bool:
        """True if the last stop has ended."""
        report = self.stopper.reports.get(1)
        return report is not None and report.phase is Phase.STOPPED

    def writes(self) -> list[tuple[int, int]]:
        return words_written(self.line)


@asynccontextmanager
async def bench(
    family: str,
    *,
    armed: bool = True,
    read_only: bool = False,
    timing: Timing | None = None,
    **spec: object,
) -> AsyncIterator[Bench]:
    """A simulated drive with a monitor and a commander, armed."""
    clock = FakeClock()
    specs = [DriveSpec(family, 1, **spec)]  # type: ignore[arg-type]
    simulation = Simulation(specs, clock=clock.monotonic)
    simulation.start()
    line = Line(RtuTcpLink(*simulation.serve_rtu_tcp()), read_only=read_only, timing=timing)
    line.open(wait=5.0)
    journal = Journal()
    console = DriveConsole(DriveSession(line, 1, library.load(family), clock=clock), journal)
    console.monitor.start(period=0.1)
    made = Bench(simulation.drive(1), line, console, Stopper(line, journal), simulation)
    try:
        await made.until(lambda: console.latest is not None)
        if armed:
            await made.until(lambda: state_known(console.monitor))
            await made.arm()
        yield made
    finally:
        journal.close()
        line.close()
        simulation.stop()


def ready(family: str) -> dict[str, int]:
    return {} if family.startswith("atv") else {"6.43": 1}


@pytest.mark.parametrize("family", FAMILIES)
async def test_run_reverse_and_stop(family: str) -> None:
    async with bench(family, sets=ready(family)) as made:
        if family in ALTIVARS:
            made.commander.refer("20Hz")
            assert "20" in await made.done()
        await made.order("forward")
        await made.until(lambda: made.drive.motor.frequency > 3)
        await made.order("reverse")
        await made.until(lambda: made.drive.motor.frequency < -3)
        made.stopper.stop([made.session])
        await made.until(lambda: made.drive.motor.frequency == 0)
        await made.until(lambda: made.stopped)


@pytest.mark.parametrize("family", ["atv320", "ms300", "v20"])
async def test_confirmed_public_profile_runs_reverses_and_stops(family: str) -> None:
    """The command word and the reference of the MS300 can only be written."""
    async with bench(family, armed=False) as made:
        await made.until(lambda: state_known(made.console.monitor))
        made.session.confirm_profile()
        await made.arm()
        made.commander.refer("20Hz")
        assert "20" in await made.done()
        await made.order("forward")
        await made.until(lambda: 19 < made.drive.motor.frequency < 21)
        await made.order("reverse")
        await made.until(lambda: made.drive.motor.frequency < -3)
        made.stopper.stop([made.session])
        await made.until(lambda: made.drive.motor.frequency == 0)
        await made.until(lambda: made.stopped)
        assert not made.console.latest or not made.console.latest.error


STARTS = {
    # as the manuals and facts write the sequences: reference, then the chart step by step
    "atv31": [(8502, 0), (8501, 0x0006), (8501, 0x0007), (8501, 0x000F)],
    "atv312": [(8502, 0), (8501, 0x0006), (8501, 0x0007), (8501, 0x000F)],
    "atv71": [(8502, 0), (8501, 0x0006), (8501, 0x000F)],
    "atv21": [(0xFA01, 0), (0xFA00, 0xC400)],
    "powerdrive": [(641, 0x0003)],
    "proxidrive": [(641, 0x0003)],
    "varmeca": [(641, 0x0003)],
}


@pytest.mark.parametrize("family", FAMILIES)
async def test_start_sequences_match_the_manuals(family: str) -> None:
    async with bench(family, sets=ready(family)) as made:
        await made.order("forward")
        assert made.writes() == STARTS[family]


async def test_every_command_word_is_in_the_journal() -> None:
    async with bench("atv71") as made:
        made.commander.refer("12.5")
        await made.done()
        await made.order("forward")
    lines = [json.loads(line) for line in Journal().path.read_text("utf-8").splitlines()]
    assert [(item["code"], item["new_raw"]) for item in lines] == [
        ("LFR", 125), ("LFR", 125), ("CMD", 6), ("CMD", 15),
    ]  # fmt: skip
    first = lines[0]
    assert (first["device"], first["profile"], first["address"]) == (1, "atv71", 8502)
    assert (first["new"], first["answer"], first["read_back"]) == ("12.5 Hz", "ok", 125)


async def test_nothing_is_commanded_before_arming() -> None:
    async with bench("atv71", armed=False) as made:
        with pytest.raises(OrderRefused, match="Not armed"):
            made.commander.order("forward")
        with pytest.raises(OrderRefused, match="Not armed"):
            made.commander.refer("30")
        with pytest.raises(OrderRefused, match="Not armed"):
            made.commander.step(Decimal(1))
        assert made.writes() == []


async def test_arming_expires() -> None:
    async with bench("atv71") as made:
        made.clock.advance(ARMED_FOR - 20)
        made.session.arming.touch()
        made.clock.advance(ARMED_FOR - 20)
        assert made.commander.armed_for is not None
        made.clock.advance(20)
        assert made.commander.armed_for is None
        assert "no key pressed" in made.session.arming.why_disarmed
        with pytest.raises(OrderRefused, match="no key pressed"):
            made.commander.order("forward")


async def test_lost_line_disarms() -> None:
    async with bench("atv71") as made:
        made.simulation.unplug()
        await made.until(lambda: made.commander.armed_for is None)
        assert "line was lost" in made.session.arming.why_disarmed


async def test_drive_on_a_read_only_line_is_not_armed() -> None:
    async with bench("atv71", armed=False, read_only=True) as made:
        with pytest.raises(OrderRefused, match="read-only"):
            made.commander.arm()


async def test_drive_in_an_unknown_state_is_not_armed() -> None:
    async with bench("atv71", armed=False, sets={"CHCF": 0}) as made:
        made.commander.arm()
        assert "state of the drive is not known" in await made.done(OutcomeKind.REFUSED)
        assert made.commander.armed_for is None


async def test_stop_while_the_state_is_read_prevents_arming() -> None:
    async with bench("atv71", armed=False) as made:
        made.console.monitor.stop()
        made.session.image.forget()
        made.commander.arm()
        made.stopper.stop([made.session])
        await made.until(lambda: made.stopped)
        assert made.commander.armed_for is None
        with pytest.raises(OrderRefused, match="ot armed"):
            made.commander.order("forward")


async def test_stop_after_the_arming_key_prevents_arming() -> None:
    async with bench("atv71", armed=False) as made:
        typed = made.session.work.stops
        made.stopper.stop([made.session])
        made.commander.arm(stamp=typed)
        assert made.commander.armed_for is None
        made.commander.arm()
        assert made.commander.armed_for is not None


async def test_stop_ends_arming() -> None:
    async with bench("atv71") as made:
        made.stopper.stop([made.session])
        assert made.commander.armed_for is None
        with pytest.raises(OrderRefused, match="no longer armed"):
            made.commander.order("forward")
        await made.until(lambda: made.stopped)
        await made.arm()
        await made.order("forward")


REFUSALS = [
    ("atv31", {"LAC": 1}, "forward", r"below L3.*set LAC to L3"),
    ("atv312", {"CD1": 0, "CHCF": 2}, "forward", r"not commanded by Modbus"),
    ("atv71", {"CD1": 0, "CHCF": 2}, "forward", r"not commanded by Modbus"),
    (
        "powerdrive",
        {"6.43": 0},
        "forward",
        r"6\.43 is Terminals\. .*press t on Monitor to take control",
    ),
    ("atv312", {"rFC": 97}, "forward", r"the active Reference channel 2 \(Fr2\) is None"),
    ("atv71", {}, "reset", r"No fault to reset: the drive is in the state "),
    ("atv31", {}, "take-control", r"no command 'take control'"),
]


@pytest.mark.parametrize(("family", "sets", "order", "text"), REFUSALS)
async def test_refused_command_has_its_reason(
    family: str, sets: dict[str, int], order: str, text: str
) -> None:
    codes = {p.code.casefold(): p.code for p in library.load(family).parameters}
    named = {codes[code.casefold()]: raw for code, raw in sets.items()}
    async with bench(family, sets=named) as made:
        import re

        assert re.search(text, await made.order(order, OutcomeKind.REFUSED))
        assert made.writes() == []
        assert made.drive.motor.frequency == 0


@pytest.mark.parametrize(
    ("typed", "text"),
    [
        ("fast", "is not a reference"),
        ("-5", "cannot be negative"),
        ("90Hz", "above HSP"),
        ("3Hz", "below LSP = 5"),
        ("9000rpm", "above HSP"),
    ],
)
async def test_invalid_reference_is_refused(typed: str, text: str) -> None:
    async with bench("atv71", sets={"LSP": 50, "HSP": 500}) as made:
        made.commander.refer(typed)
        assert text in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == []


async def test_reference_is_given_by_number_step_or_speed() -> None:
    async with bench("atv71", sets={"HSP": 500, "FRS": 500, "NSP": 1450}) as made:
        made.commander.refer("30,25")
        assert "rounded" in await made.done()
        assert made.drive.raw("LFR") == 303
        made.commander.step(Decimal(-1))
        assert "29.3 Hz" in await made.done()
        made.commander.refer("1200 rpm")
        assert "1200 rpm" in await made.done()
        assert made.drive.raw("LFRD") == 1200


@pytest.mark.parametrize("family", ["atv21", "atv31", "atv71"])
async def test_reset_clears_the_fault_and_starts_nothing(family: str) -> None:
    async with bench(family) as made:
        if family in ALTIVARS:
            made.commander.refer("20")
            await made.done()
        await made.order("forward")
        await made.until(lambda: made.drive.motor.frequency > 3)
        made.drive.provoke("OC1" if family == "atv21" else "OCF", persists=True)
        await made.until(lambda: made.drive.fault is not None)
        await made.let_go_until(lambda: made.drive.motor.rotor == 0)
        if family != "atv21":
            assert "reset it first" in await made.order("forward", OutcomeKind.REFUSED)
        assert "the drive is still in fault" in await made.order("reset")
        made.drive.clear_cause()
        await made.order("reset")
        await made.until(lambda: made.drive.fault is None)
        await asyncio.sleep(0.5)
        assert made.drive.motor.frequency == 0


async def test_reset_without_the_command_channel_says_so() -> None:
    async with bench("atv71", sets={"CD1": 1, "CHCF": 2}) as made:
        made.drive.provoke("OCF", persists=False)
        await made.until(lambda: made.drive.fault is not None)
        text = await made.order("reset")
        assert "Fault reset: Drive Panel does not hold the command channel, and" in text
        assert "is Terminals" in text
        assert made.drive.fault is not None


async def test_options_of_an_altivar_21_persist_between_commands() -> None:
    async with bench("atv21") as made:
        chart = made.session.profile.data.charts[0]
        options = {option.id: option for option in chart.options}
        made.commander.refer("20")
        await made.done()
        made.commander.choose_option(options["ramp"], 0x0040)
        assert await made.done() == "Ramp: F500, F501"
        await made.order("forward")
        assert made.drive.raw("FA00") == 0xC440
        made.commander.choose_option(options["motor"], 0x0010)
        assert "with the motor stopped" in await made.done(OutcomeKind.REFUSED)
        made.stopper.stop([made.session])
        await made.until(lambda: made.stopped)
        assert made.drive.raw("FA00") == 0xC040


async def test_lost_priority_bits_are_detected() -> None:
    """FA00 is in the memory that a power-off empties."""
    async with bench("atv21") as made:
        await made.order("forward")
        assert made.commander.given.lost_orders() == ""
        made.drive.power_cycle()
        await made.until(lambda: bool(made.commander.given.lost_orders()))
        assert "FA00 16#C400 is now 16#0000" in made.commander.given.lost_orders()


async def test_stop_ends_a_command_in_progress() -> None:
    async with bench("atv71") as made:
        made.commander.refer("20")
        await made.done()
        made.commander.order("forward")
        made.stopper.stop([made.session])
        await made.until(lambda: made.stopped)
        await asyncio.sleep(1.0)
        assert made.drive.motor.frequency == 0
        assert made.writes()[-1] == (8501, 7)


async def test_unwritable_journal_does_not_block_commands(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    journal = Journal(tmp_path / "file")
    async with bench("atv71") as made:
        commander = Commander(made.session, journal)
        commander.order("forward")
        await made.until(lambda: commander.outcome is not None)
        assert commander.outcome is not None
        assert commander.outcome.kind is OutcomeKind.DONE
        assert not journal.flush()
        assert "cannot be written" in journal.trouble
        assert len(journal.recent) == 3


async def test_motor_that_starts_in_the_wrong_direction_is_stopped() -> None:
    # bit 12 of CMI is a second source of the direction; an unassigned bit 11 shows the same
    async with bench("atv71", sets={"CMI": 1 << 12}) as made:
        made.commander.refer("20Hz")
        await made.done()
        output = await made.order("forward", OutcomeKind.REFUSED)
        assert "turned reverse and was stopped" in output
        await made.until(lambda: made.drive.motor.frequency == 0)
