"""Sessions on simulated drives over a real line: pseudo-terminal, pyserial, the line's thread."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.waiting import until
from tui.bus.api import Priority
from tui.bus.errors import (
    LineBusy,
    LineLost,
    LinkSyntaxError,
    NoAnswer,
    RequestRefused,
)
from tui.bus.link import SerialLink
from tui.drive.profile import library
from tui.session.connect.addresses import parse_addresses
from tui.session.connect.identify import identify_drive
from tui.session.connect.open_line import OpenLine, check_line, demo_line, open_line
from tui.session.drive import DriveSession
from tui.session.monitor.line_watch import LineWatch
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.snapshot import Snapshot
from tui.session.paths import recent_lines, remember_line, state_folder
from tui.session.read.reader import Reader
from tui.session.reading import reading_of
from tui.session.shown import Quality
from tui.simulator import DriveSpec, Simulation

pytestmark = pytest.mark.usefixtures("patient_lines")

DRIVES = {"atv21": 35.0, "atv31": 25.0, "atv312": 42.0, "atv71": 50.0, "powerdrive": 30.0}
ADDRESSES = {profile: address for address, profile in enumerate(DRIVES, start=1)}


@pytest.fixture
def five() -> Iterator[OpenLine]:
    """One line with a running drive of each of five families."""
    opened = demo_line(DRIVES)
    yield opened
    opened.close()


def session(opened: OpenLine, profile: str) -> DriveSession:
    return DriveSession(opened.line, ADDRESSES[profile], library.load(profile))


@pytest.mark.parametrize(
    ("profile", "vendor", "reference", "name"),
    [
        ("atv21", "Telemecanique", "ATV21", ""),
        ("atv31", "TELEMECANIQUE", "ATV31", ""),
        ("atv312", "TELEMECANIQUE", "ATV312", ""),
        ("atv71", "Telemecanique", "ATV71", "MACHINE 4"),
    ],
)
async def test_drives_of_every_family_are_identified(
    five: OpenLine, profile: str, vendor: str, reference: str, name: str
) -> None:
    found = await identify_drive(five.line, ADDRESSES[profile])
    assert (found.vendor, found.name, found.profile) == (vendor, name, profile)
    assert found.reference.startswith(reference)
    assert found.version_text == "2.1"


async def test_drive_without_function_43_is_found_by_its_status_word(five: OpenLine) -> None:
    found = await identify_drive(five.line, ADDRESSES["powerdrive"])
    assert found.profile is None
    assert set(found.candidates) == {"powerdrive", "proxidrive", "varmeca"}


async def test_unused_address_gives_no_answer(five: OpenLine) -> None:
    with pytest.raises(NoAnswer):
        await identify_drive(five.line, 99)


@pytest.mark.parametrize("profile", DRIVES)
async def test_monitor_shows_the_motor_state(five: OpenLine, profile: str) -> None:
    drive = session(five, profile)
    monitor = Monitor(drive)
    monitor.start(period=0.1)
    await until(lambda: monitor.latest is not None and monitor.latest.cycle > 2)
    latest = monitor.latest
    assert latest is not None
    assert latest.error == ""
    assert latest.state.kind == "running"
    frequency = drive.profile.quantity("output_frequency")
    if frequency is not None:
        code = frequency.code
        first = reading_of(latest.readings[code]).number or 0.0

        def faster() -> bool:
            now = monitor.latest
            return now is not None and (reading_of(now.readings[code]).number or 0.0) > first + 1

        await until(faster)
        assert latest.readings[code].quality is Quality.GOOD
        assert reading_of(latest.readings[code]).unit == "Hz"
    monitor.stop()
    assert not monitor.running


async def test_lost_line_makes_values_stale_until_it_recovers(five: OpenLine) -> None:
    drive = session(five, "atv71")
    monitor = Monitor(drive)
    monitor.start(period=0.1)
    await until(lambda: monitor.latest is not None and not monitor.latest.error)
    assert five.simulation is not None
    five.simulation.unplug()

    def all_old() -> bool:
        latest = monitor.latest
        if latest is None or not latest.error:
            return False
        # the words of one cycle come a moment after one another, and so they grow old
        stale = latest.readings["RFR"].quality is Quality.STALE
        return stale and latest.state.kind == "unknown"

    await until(all_old)
    latest = monitor.latest
    assert latest is not None
    assert latest.rate == 0.0
    assert monitor.trend[-1].values == (None, None, None)
    with pytest.raises(LineLost):
        await Reader(drive).read(["ACC"])
    five.simulation.replug()
    await until(lambda: monitor.latest is not None and not monitor.latest.error)
    monitor.stop()


async def test_polling_continues_while_the_screen_is_frozen(five: OpenLine) -> None:
    drive = session(five, "atv71")
    monitor = Monitor(drive)
    monitor.start(period=0.1)
    await until(lambda: monitor.latest is not None)
    assert monitor.latest is not None
    before = monitor.latest.cycle
    time.sleep(2.0)  # noqa: ASYNC251 - this loop hangs, like one with a stalled terminal
    assert monitor.latest.cycle - before >= 10
    monitor.stop()


async def test_subscribers_get_every_cycle_until_they_unsubscribe(five: OpenLine) -> None:
    drive = session(five, "atv312")
    monitor = Monitor(drive)
    heard: list[Snapshot] = []
    leave = monitor.listen(heard.append)
    monitor.start(["LCr"], 0.05)
    await until(lambda: len(heard) >= 5)
    leave()
    count = len(heard)
    assert [s.cycle for s in heard] == list(range(1, count + 1))
    assert list(heard[-1].readings) == ["LCr"]
    monitor.stop()


async def test_unpolled_drive_trips_and_a_polled_one_does_not() -> None:
    """The Altivar 21 watches the line from the first request on, for 3 s."""
    alone, kept = demo_line({"atv21": 35.0}), demo_line({"atv21": 35.0})
    line_watch = LineWatch(kept.line)
    kept_drive = session(kept, "atv21")
    line_watch.keep(kept_drive, Monitor(kept_drive))
    await Reader(session(alone, "atv21")).read(["FD01"])
    await asyncio.sleep(5.0)
    try:
        assert (await Reader(session(alone, "atv21")).read(["FC90"]))["FC90"].raw == 24
        assert (await Reader(kept_drive).read(["FC90"]))["FC90"].raw == 0
        look = line_watch.looks[1]
        assert look.timeout == 3.0
        assert look.state is not None
        assert look.state.kind == "running"
    finally:
        line_watch.stop()
        alone.close()
        kept.close()


async def test_monitored_drive_uses_its_monitor_for_the_timeout() -> None:
    """The line watch learns the timeout though a monitor is at work, and takes its newer state."""
    opened = demo_line({"atv21": 35.0})
    drive = session(opened, "atv21")
    monitor = Monitor(drive)
    monitor.start(period=0.2)
    line_watch = LineWatch(opened.line)
    line_watch.keep(drive, monitor)

    def pending_timeouts() -> dict[int, float]:
        return {device: watch.timeout for device, watch in line_watch.pending_timeouts().items()}

    try:
        await until(lambda: pending_timeouts() == {1: 3.0} and line_watch.runs(1))
        assert line_watch.looks == {}, "the monitor's states counted"
        assert opened.simulation is not None
        opened.simulation.drive(1).halt()
        await until(lambda: not line_watch.runs(1))
        # it trips at rest, too
        assert pending_timeouts() == {1: 3.0}
    finally:
        line_watch.stop()
        opened.close()


async def test_drive_is_kept_alive_under_any_load() -> None:
    """A flood of polls and of operator's reads leaves the line watch its place before them."""
    opened = demo_line({"atv21": 35.0, "atv71": 50.0})
    line_watch = LineWatch(opened.line)
    drive = session(opened, "atv21")
    line_watch.keep(drive, Monitor(drive))
    await until(lambda: line_watch.watch(1) is not None)
    gaps: list[float] = []

    async def flood(priority: Priority) -> None:
        for _ in range(40):
            with suppress(LineBusy):
                await opened.line.read(2, 3201, priority=priority)

    try:
        end = time.monotonic() + 4.0
        while time.monotonic() < end:
            crowd = [flood(priority) for priority in (Priority.OPERATOR_READ, Priority.POLL) * 10]
            work = asyncio.gather(*crowd)
            while not work.done():
                gaps.append(time.monotonic() - (opened.line.device_state(1).heard or 0.0))
                await asyncio.sleep(0.01)
        assert max(gaps) < 3.0 / 3
        assert not line_watch.warnings()
        assert opened.simulation is not None
        assert opened.simulation.drive(1).raw("FC90") == 0
    finally:
        line_watch.stop()
        opened.close()


async def test_drive_without_keep_alive_is_reported_before_it_trips(tmp_path: Path) -> None:
    simulation = Simulation([DriveSpec("atv21", 1, run_hz=35.0)])
    simulation.start()
    # a name of its own: the number of a pseudo-terminal may be reused
    opened = open_line(f"serial:{simulation.serve_pty(str(tmp_path / 'line'))},19200,8N1", wait=5.0)
    opened.simulation = simulation
    line_watch = LineWatch(opened.line)
    drive = session(opened, "atv21")
    line_watch.keep(drive, Monitor(drive))
    try:
        await until(lambda: line_watch.watch(1) is not None)
        assert not line_watch.warnings()
        assert opened.simulation is not None
        opened.simulation.unplug()
        await until(lambda: bool(line_watch.warnings()))
        (warning,) = line_watch.warnings()
        assert (warning.device, warning.watch.timeout) == (1, 3.0)
        assert 1.0 < warning.left <= 1.5
        assert warning.watch.reaction is not None
        assert warning.watch.reaction.trips
        opened.simulation.replug()
        await until(lambda: not line_watch.warnings())
    finally:
        line_watch.stop()
        opened.close()


async def test_timeout_that_starts_with_a_command_is_not_reported_before() -> None:
    opened = demo_line({"atv71": 0.0})
    line_watch = LineWatch(opened.line)
    drive = DriveSession(opened.line, 1, library.load("atv71"))
    line_watch.keep(drive, Monitor(drive))
    try:
        await until(lambda: line_watch.watch(1) is not None)
        watch = line_watch.watch(1)
        assert watch is not None
        assert (watch.timeout, watch.active) == (10.0, False)
        assert line_watch.pending_timeouts() == {}
    finally:
        line_watch.stop()
        opened.close()


async def test_overloaded_line_lowers_all_rates_evenly(
    five: OpenLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monitors = [Monitor(session(five, profile)) for profile in DRIVES]
    for monitor in monitors:
        # as if the line were that slow: its time is shared out by what the plans cost there
        monkeypatch.setattr(five.line, "link", SerialLink("/dev/null", baud=9600))
        monitor.start(period=0.1)
    await asyncio.sleep(8.0)
    rates = [monitor.latest.rate for monitor in monitors if monitor.latest]
    assert len(rates) == len(monitors)
    assert max(rates) / min(rates) < 1.1
    assert 0.5 < max(rates) < 2.0
    for monitor in monitors:
        monitor.stop()


@pytest.mark.parametrize(
    ("profile", "address", "count"),
    [("atv31", 3102, 30), ("atv71", 3102, 64), ("atv21", 0xFD00, 2), ("atv21", 0x1876, 2),
     ("atv21", 0x1875, 6), ("powerdrive", 1000, 21)],
)  # fmt: skip
async def test_no_caller_exceeds_the_limits_of_a_profile(
    five: OpenLine, profile: str, address: int, count: int
) -> None:
    drive = session(five, profile)
    before = five.line.counters.requests
    with pytest.raises(RequestRefused):
        await five.line.read(drive.device, address, count)
    assert five.line.counters.requests == before


async def test_limits_allow_reading_the_indirect_block(five: OpenLine) -> None:
    drive = session(five, "atv21")
    reply = await five.line.read(drive.device, 0x1875, 5)
    assert len(reply.words) == 5


async def test_silence_at_an_unconfirmed_word_is_not_a_dead_drive() -> None:
    from tui.simulator import DriveSpec, Simulation

    simulation = Simulation([DriveSpec("powerdrive", 1, protects=frozenset({"5.01"}))])
    with simulation:
        opened = open_line(f"serial:{simulation.serve_pty()}", wait=3)
        drive = DriveSession(opened.line, 1, library.load("powerdrive"))
        readings = await Reader(drive).read(["10.40", "5.01"])
        assert readings["10.40"].quality is Quality.GOOD
        assert readings["5.01"].quality is Quality.BAD
        assert "no such word" in readings["5.01"].error
        opened.close()


def test_invalid_lines_are_refused() -> None:
    for text in ("modbus", "tcp:", "rtu-tcp:host", "sim:", "sim:nothing@1,"):
        with pytest.raises(LinkSyntaxError):
            check_line(text)


@pytest.mark.parametrize(
    ("text", "addresses"), [("1-3", [1, 2, 3]), ("5,1,5", [5, 1]), (" 2 - 3 , 9", [2, 3, 9])]
)
def test_address_ranges_are_parsed(text: str, addresses: list[int]) -> None:
    assert parse_addresses(text) == addresses


@pytest.mark.parametrize("text", ["", "0", "248", "3-1", "a", "1-", "1,,2"])
def test_invalid_addresses_are_refused(text: str) -> None:
    with pytest.raises(LinkSyntaxError):
        parse_addresses(text)


def test_recent_lines_survive_a_damaged_file() -> None:
    remember_line("tcp:one:502")
    remember_line("tcp:two:502")
    remember_line("tcp:one:502")
    assert recent_lines() == ["tcp:one:502", "tcp:two:502"]
    file: Path = state_folder() / "recent-lines.json"
    file.write_text("{broken", encoding="utf-8")
    assert recent_lines() == []
    remember_line("tcp:three:502")
    assert recent_lines() == ["tcp:three:502"]


async def test_closed_line_ends_its_thread() -> None:
    opened = demo_line({"atv71": 10.0})
    line = opened.line
    opened.close()
    opened.close()
    with pytest.raises(Exception, match="closed"):
        await line.read(1, 3201)
