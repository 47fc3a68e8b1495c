"""Words whose bytes arrive swapped: detected, reported, and no command sent; stops are sent."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.sent import words_written
from tests.sweeps import kept
from tui.bus.api import Priority
from tui.bus.errors import BytesSwapped, NoAnswer
from tui.bus.line import Line
from tui.bus.link import Link, RtuTcpLink, SerialLink, TcpLink
from tui.drive.byte_order import only_swapped, swapped_word, telling_codes
from tui.drive.orders import OrderRefused, chart_in_force, stop_in_any
from tui.drive.profile import library
from tui.drive.values import is_enumeration, is_field, raw_range, to_words, word_count
from tui.session import byte_order as byte_orders
from tui.session.byte_order import ByteOrder
from tui.session.command.access import CommandAccess, CommandHistory
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.monitor.monitor import Monitor
from tui.session.read import order_check
from tui.session.read.order_check import check_byte_order
from tui.session.read.reader import Reader
from tui.session.read.retrying_reader import RetryingReader
from tui.session.read.upload import readable_codes
from tui.session.shown import Quality
from tui.session.work import Permit
from tui.simulator import DriveSpec, FaultRates, Simulation

from .sets_bench import FAMILIES
from .test_stop import wait_for

SWAPPED = FaultRates(swapped=1.0)
HEALTHY = FaultRates()
LINES = ("pty", "rtu-tcp", "tcp")


@contextmanager
def line_to(
    spec: DriveSpec, faults: FaultRates = SWAPPED, kind: str = "rtu-tcp"
) -> Iterator[tuple[Simulation, Line, DriveSession]]:
    """A simulated drive on an open line."""
    with Simulation([spec], faults=faults) as simulation:
        link: Link
        match kind:
            case "pty":
                link = SerialLink(simulation.serve_pty())
            case "tcp":
                link = TcpLink(*simulation.serve_tcp())
            case _:
                link = RtuTcpLink(*simulation.serve_rtu_tcp())
        line = Line(link)
        try:
            line.open(wait=5.0)
            yield simulation, line, DriveSession(line, spec.address, library.load(spec.profile))
        finally:
            line.close()


def mend(simulation: Simulation) -> None:
    """The gateway is set up as it should be."""
    simulation.faults.rates = HEALTHY


async def check(session: DriveSession) -> None:
    await check_byte_order(Reader(session), Priority.OPERATOR_READ)


@pytest.mark.parametrize(
    ("family", "kind"), [*product(FAMILIES, ["tcp"]), *product(["atv71"], LINES)]
)
async def test_swapped_bytes_are_reported_on_connecting(family: str, kind: str) -> None:
    with line_to(DriveSpec(family, 2), kind=kind) as (_, _, session):
        with pytest.raises(BytesSwapped, match="The bytes of each word of device 2 arrive swapped"):
            await check(session)
        assert "byte order setting of the gateway" in session.byte_order.text


async def test_swapped_bytes_refuse_arming_and_disarm() -> None:
    with line_to(DriveSpec("atv71", 2)) as (_, line, session):
        session.arming.arm()
        permit = Permit(session.work, session.work.stops)
        permit.check()
        with pytest.raises(BytesSwapped):
            await check(session)
        with pytest.raises(OrderRefused, match="arrive swapped"):
            permit.check()
        with pytest.raises(OrderRefused, match="arrive swapped"):
            session.arming.arm()
        assert words_written(line) == []


@pytest.mark.parametrize("kind", LINES)
async def test_monitor_of_swapped_bytes_shows_no_good_value(kind: str) -> None:
    with line_to(DriveSpec("atv71", 2, run_hz=20.0), kind=kind) as (simulation, _, session):
        monitor = Monitor(session)
        with pytest.raises(BytesSwapped):
            await check(session)
        monitor.start(period=0.05)
        await wait_for(lambda: monitor.latest is not None)
        snapshot = monitor.latest
        assert snapshot is not None
        assert snapshot.contact == "swapped"
        assert "arrive swapped" in snapshot.error
        assert {reading.quality for reading in snapshot.readings.values()} == {Quality.BAD}
        assert snapshot.state.kind == "unknown"
        assert session.image.raws == {}
        mend(simulation)
        await wait_for_order(session)
        await wait_for(lambda: monitor.latest is not None and not monitor.latest.error)
        monitor.stop()


async def wait_for_order(session: DriveSession) -> None:
    """The settings of a repaired line show the correct byte order."""
    await check(session)
    assert session.byte_order.error is None


async def test_regular_reads_detect_bytes_that_become_swapped() -> None:
    with line_to(DriveSpec("atv31", 2), HEALTHY) as (simulation, _, session):
        await check(session)
        assert not session.byte_order.is_doubtful
        simulation.faults.rates = SWAPPED
        await Reader(session).read(["ttO"])
        assert session.byte_order.is_doubtful, "one word proves nothing, and asks for more"
        assert not session.byte_order.text
        with pytest.raises(BytesSwapped):
            await check(session)


async def test_recovered_line_is_checked_again_before_a_command() -> None:
    with line_to(DriveSpec("atv71", 2), HEALTHY) as (simulation, line, session):
        await check(session)
        session.arming.arm()
        simulation.faults.rates = SWAPPED
        Reader(session).forget()
        given = CommandHistory(session)
        access = CommandAccess(session, Journal(), Permit(session.work, session.work.stops), given)
        with pytest.raises(BytesSwapped):
            await access.read(["RFR"])
        assert not session.arming.armed
        with pytest.raises(BytesSwapped):
            await RetryingReader(session).ask(["ACC"])
        assert words_written(line) == []


@pytest.mark.parametrize("family", FAMILIES)
async def test_stop_with_swapped_bytes_is_sent_but_never_reported_as_done(family: str) -> None:
    spec = DriveSpec(family, 1)
    with line_to(spec) as (_, line, session):
        stopper = Stopper(line, Journal())
        stopper.stop([session])
        await wait_for(lambda: bool(stopper.reports) and stopper.reports[1].phase is Phase.FAILED)
        assert "arrive swapped" in stopper.reports[1].text
        chart, order = stop_in_any(session.profile, {})
        assert words_written(line)
        assert {word for _, word in words_written(line)} <= {
            *(word & 0xFFFF for word in order.words),
            *(word & 0xFFFF for o in chart.orders if o.id == "stop" for word in o.words),
        }


async def test_stop_with_swapped_bytes_never_uses_the_word_of_another_chart() -> None:
    """16#0300 is CHCF 3 swapped: no chart; Drivecom words run a motor in the I/O profile."""
    with line_to(DriveSpec("atv71", 1, sets={"CHCF": 3, "TCC": 0})) as (simulation, line, session):
        stopper = Stopper(line, Journal())
        stopper.stop([session])
        await wait_for(lambda: bool(stopper.reports) and stopper.reports[1].phase is Phase.FAILED)
        assert {word for _, word in words_written(line)} == {0}
        assert simulation.drive(1).motor.frequency == 0


def test_unknown_chart_value_selects_no_chart() -> None:
    profile = library.load("atv71")
    assert chart_in_force(profile, {"CHCF": 0x0300}) is None
    found = chart_in_force(profile, {"CHCF": 3})
    assert found is not None
    assert found.id == "io"
    assert stop_in_any(profile, {"CHCF": 0x0300}) == stop_in_any(profile, {})


@pytest.mark.parametrize("family", FAMILIES)
async def test_swapped_stop_word_runs_no_motor(family: str) -> None:
    """A gateway that swaps writes too: each stop word, at standstill."""
    with line_to(DriveSpec(family, 1), HEALTHY) as (simulation, line, session):
        words = {
            (session.profile[order.parameter or chart.command].address, word & 0xFFFF)
            for chart in session.profile.data.charts
            for order in chart.orders
            if order.id in ("stop", "quick-stop", "freewheel", "emergency-stop")
            for word in order.words
        }
        for address, word in sorted(words):
            await line.write(1, address, [swapped_word(word)], multiple=None)
            await asyncio.sleep(0.3)
            assert simulation.drive(1).motor.frequency == 0, f"16#{word:04X}"


@pytest.mark.parametrize("family", kept(FAMILIES, "atv21", "atv71", "powerdrive", "varmeca"))
@pytest.mark.parametrize("state", kept(["rest", "running", "fault"], "running"))
async def test_healthy_drive_shows_no_swapped_word(family: str, state: str) -> None:
    spec = DriveSpec(family, 1, run_hz=20.0 if state == "running" else 0.0)
    with line_to(spec, HEALTHY) as (simulation, _, session):
        if state == "fault":
            codes = session.profile.data.faults.codes
            simulation.drive(1).provoke(
                next((fault_code.raw for fault_code in codes if fault_code.raw), 1)
            )
        if state == "running":
            await wait_for(lambda: simulation.drive(1).motor.frequency > 5)
        await check(session)
        reader = Reader(session)
        every = readable_codes(session.profile)
        for at in range(0, len(every), 20):
            await reader.read(every[at : at + 20])
        shown = session.byte_order._seen
        assert len(shown) >= 4
        assert [code for code, (swapped, _) in shown.items() if swapped] == []


@pytest.mark.parametrize("family", FAMILIES)
def test_value_in_its_range_is_never_taken_as_swapped(family: str) -> None:
    profile = library.load(family)
    judged = 0
    for parameter in profile.parameters:
        if word_count(parameter) != 1 or is_field(parameter):
            continue
        low, high = raw_range(parameter)
        if is_enumeration(parameter):
            raws = set(profile.names(parameter))
        else:
            raws = {
                low,
                high,
                (low + high) // 2,
                parameter.factory or low,
                *range(low, min(high, low + 300)),
            }
        for raw in raws:
            to_words(parameter, raw)
            judged += 1
            assert only_swapped(profile, parameter, raw) is not True, f"{parameter.code} {raw}"
    assert judged > 100


def test_words_valid_in_both_orders_decide_nothing() -> None:
    profile = library.load("atv71")
    baud = profile["TBR"]
    assert only_swapped(profile, baud, 32) is False
    assert only_swapped(profile, baud, 32 << 8) is True
    assert only_swapped(profile, baud, 0x0101) is None
    assert only_swapped(profile, baud, 0x4242) is None
    assert only_swapped(profile, profile["THD"], 0x8000) is None, "no value"


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_has_settings_that_show_the_byte_order(family: str) -> None:
    assert len(telling_codes(library.load(family))) >= 5


async def test_three_odd_words_of_a_healthy_drive_are_tolerated() -> None:
    sets = {"TBR": 32 << 8, "TFO": 3 << 8, "TTO": 100 << 8}
    with line_to(DriveSpec("atv71", 2, sets=sets), HEALTHY) as (_, _, session):
        await check(session)
        assert sum(swapped for swapped, _ in session.byte_order._seen.values()) == 3
        assert not session.byte_order.text


@pytest.mark.parametrize(
    ("doubtful", "error", "silent_family", "tested", "looked", "raised"),
    [
        (True, None, True, True, False, False),
        (False, None, True, False, False, False),
        (True, NoAnswer(1, 3, 1), True, True, True, False),
        (True, NoAnswer(1, 3, 1), False, False, False, True),
        (True, NoAnswer(1, 3, 1, retry_in=2.0), True, False, False, True),
        (True, TimeoutError(), True, False, False, False),
    ],
)
async def test_check_of_the_byte_order_reads_at_the_priority_of_its_caller(
    doubtful: bool, error: Exception | None, silent_family: bool, tested: bool, looked: bool,
    raised: bool, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    noted: list[object] = []
    order = SimpleNamespace(is_doubtful=doubtful, note_tested=lambda: noted.append("tested"))
    profile = library.load("atv71")
    session = SimpleNamespace(byte_order=order, profile=profile)

    async def read(codes: object, **how: object) -> None:
        noted.append((codes, how))
        if error is not None:
            raise error

    async def look(*those: object) -> None:
        assert those == (session, error)
        noted.append("looked")

    monkeypatch.setattr(order_check, "meets_silence", lambda _: silent_family)
    monkeypatch.setattr(order_check, "look_for_drive", look)
    reader = cast(Any, SimpleNamespace(session=session, read=read))
    for priority in (Priority.STOP, Priority.OPERATOR_READ):
        noted.clear()
        if raised:
            with pytest.raises(NoAnswer):
                await check_byte_order(reader, priority)
        else:
            await check_byte_order(reader, priority)
        expected: list[object] = [(telling_codes(profile), {"priority": priority})] * doubtful
        assert noted == [*expected, *["looked"] * looked, *["tested"] * tested]


class Votes:
    """Values that indicate an order of their bytes, or nothing."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.order = ByteOrder(7)
        self.heard: list[str] = []
        self.order.on_swapped = self.heard.append
        self.profile = cast(Any, object())
        monkeypatch.setattr(byte_orders, "only_swapped", self._vote)

    def _vote(self, profile: object, parameter: object, raw: int) -> bool | None:
        assert profile is self.profile
        return {0: False, 1: True}.get(raw)

    def note(self, now: float, **raws: int | None) -> None:
        found = {
            code: SimpleNamespace(raw=raw, parameter=code, time=now) for code, raw in raws.items()
        }
        self.order.note(self.profile, cast(Any, found), now)

    @property
    def codes(self) -> tuple[str, ...]:
        return self.order._against


def test_three_values_that_fit_swapped_only_decide_and_are_reported_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Votes(monkeypatch)
    here.note(1.0, B=1, A=1, X=None, Y=2)
    assert (here.codes, here.heard, here.order.is_suspect) == ((), [], True)
    assert here.order.error is None
    assert here.order.text == ""
    here.note(2.0, C=1)
    assert here.codes == ("A", "B", "C")
    assert here.heard == [here.order.text]
    assert "7" in here.order.text
    assert isinstance(here.order.error, BytesSwapped)
    here.note(3.0, D=1)
    assert len(here.heard) == 1
    assert here.codes == ("A", "B", "C")


@pytest.mark.parametrize(("right", "swapped"), [(0, True), (1, False)])
def test_values_for_one_order_outnumber_those_for_the_other_by_four(
    right: int, swapped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Votes(monkeypatch)
    here.note(1.0, **{f"R{n}": 0 for n in range(right)})
    here.note(2.0, **{f"W{n}": 1 for n in range(2)})
    here.note(3.0, V=1)
    assert bool(here.codes) is swapped
    here.note(4.0, U=1)
    assert here.codes, "four to one"


@pytest.mark.parametrize(("right", "cleared"), [(2, False), (3, True)])
def test_three_values_in_the_right_order_read_together_clear_the_others(
    right: int, cleared: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Votes(monkeypatch)
    here.note(1.0, A=1, B=1, C=1)
    here.note(2.0, **{f"R{n}": 0 for n in range(right)})
    assert bool(here.codes) is not cleared
    assert here.order.is_suspect is not cleared
    here.note(3.0, **{f"R{n}": 0 for n in range(11)}, A=1, B=1, C=1)
    assert bool(here.codes) is not cleared, "11 to 3 is no clear majority"
    here.note(4.0, **{f"R{n}": 0 for n in range(12)}, A=1, B=1, C=1)
    assert not here.codes


def test_three_swapped_values_read_together_override_earlier_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Votes(monkeypatch)
    here.note(1.0, **{f"R{n}": 0 for n in range(8)})
    here.note(2.0, A=1, B=1)
    assert not here.codes
    here.note(3.0, A=1, B=1, C=1)
    assert here.codes == ("A", "B", "C")
    here = Votes(monkeypatch)
    here.note(1.0, **{f"R{n}": 0 for n in range(8)})
    here.note(2.0, A=1, B=1, C=1, D=1, R0=0)
    assert here.codes == ("A", "B", "C", "D"), "four to one is a majority"


def test_value_counts_for_ninety_seconds_and_its_latest_vote_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for wait, swapped in ((90.0, True), (90.5, False)):
        here = Votes(monkeypatch)
        here.note(1.0, A=1, B=1)
        here.note(1.0 + wait, C=1)
        assert bool(here.codes) is swapped
    here = Votes(monkeypatch)
    here.note(1.0, A=1, B=1)
    here.note(2.0, A=0)
    here.note(3.0, C=1)
    assert not here.codes
    here.note(4.0, A=2, B=2, C=2)
    assert not here.order.is_suspect, "they say nothing any more"


def test_check_is_due_until_it_was_made_and_again_after_a_loss() -> None:
    order = ByteOrder(7)
    assert (order.is_doubtful, order.is_suspect) == (True, False)
    order.forget()
    assert (order.is_doubtful, order.is_suspect) == (True, False), "nothing was known"
    order.note_tested()
    assert (order.is_doubtful, order.is_suspect) == (False, False)
    order.forget()
    assert (order.is_doubtful, order.is_suspect) == (True, True)
    order.note_tested()
    assert (order.is_doubtful, order.is_suspect) == (False, False)
