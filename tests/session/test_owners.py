"""One owner per drive: for its values, its tasks, its permission and its timeout."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from tests.sent import words_written
from tests.waiting import until
from tui.bus.api import ModbusLine, Reply
from tui.bus.errors import NoAnswer
from tui.bus.line import Line
from tui.bus.link import RtuTcpLink
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.fleet import Fleet
from tui.session.journal import Journal
from tui.session.monitor import monitor as monitor_module
from tui.session.read.reader import Reader
from tui.session.work import OutcomeKind
from tui.simulator import DriveSpec, Simulation
from tui.simulator.drive import SimulatedDrive


class Bench:
    """A fleet over a simulated line, with the drive at address 1."""

    def __init__(self, simulation: Simulation, fleet: Fleet, console: DriveConsole) -> None:
        self.simulation = simulation
        self.fleet = fleet
        self.console = console
        self.session = console.session
        self.drive: SimulatedDrive = simulation.drive(1)

    @property
    def line(self) -> ModbusLine:
        """The line."""
        return self.fleet.line

    async def arm(self) -> None:
        """Arm; a state that is not fresh is read before."""
        self.console.commander.arm()
        await until(lambda: self.session.arming.armed)

    def writes(self) -> list[tuple[int, int]]:
        """Register and word of every write of one word so far."""
        return words_written(self.line)


@asynccontextmanager
async def bench(family: str, *, watch: bool = True, **spec: Any) -> AsyncIterator[Bench]:
    """One simulated drive in a fleet, watched."""
    simulation = Simulation([DriveSpec(family, 1, **spec)])
    simulation.start()
    line = Line(RtuTcpLink(*simulation.serve_rtu_tcp()))
    line.open(wait=5.0)
    journal = Journal()
    fleet = Fleet(line, journal)
    console = fleet.take(DriveSession(line, 1, library.load(family)))
    if watch:
        console.monitor.start(period=0.1)
    try:
        await until(lambda: not watch or console.latest is not None)
        yield Bench(simulation, fleet, console)
    finally:
        fleet.forget()
        line.close()
        journal.close()
        simulation.stop()


# What is known


async def test_older_reply_never_replaces_a_newer_one() -> None:
    async with bench("atv71", watch=False) as here:
        image = here.session.image
        now = time.monotonic()
        image.confirm("ACC", 50, now)
        image.confirm("ACC", 30, now - 1)
        assert image.raws["ACC"] == 50


async def test_possibly_changed_value_is_kept_but_not_trusted() -> None:
    async with bench("atv71", watch=False) as here:
        image = here.session.image
        await Reader(here.session).read(["CHCF"])
        assert image.trusted["CHCF"] == 1
        image.distrust()
        assert "CHCF" in image.raws
        assert "CHCF" not in image.trusted
        await Reader(here.session).read(["CHCF"])
        assert image.trusted["CHCF"] == 1


# Watching


@pytest.mark.internal_errors
async def test_monitor_with_an_internal_error_reports_it_and_restarts(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(monitor_module, "RESTART_AFTER", 0.2)
    async with bench("atv71") as here:
        monitor = here.console.monitor
        read, broken = monitor.reader.read, True

        async def failing(codes: Any, **how: Any) -> Any:
            if broken:
                raise KeyError("a mistake of our own")
            return await read(codes, **how)

        monkeypatch.setattr(type(monitor.reader), "read", lambda _self, c, **k: failing(c, **k))
        await until(lambda: monitor.restarts >= 2)
        assert monitor.latest is not None
        assert "a mistake of our own" in monitor.latest.error
        assert monitor.latest.rate == 0.0
        assert monitor.running
        assert "watching device 1 failed" in caplog.text
        assert "a mistake of our own" in caplog.text
        broken = False
        await until(lambda: monitor.latest is not None and not monitor.latest.error)


@pytest.mark.internal_errors
async def test_listener_that_raises_affects_no_other(caplog: pytest.LogCaptureFixture) -> None:
    async with bench("atv71") as here:
        monitor = here.console.monitor

        def bad(_snapshot: object) -> None:
            raise RuntimeError("a listener's own mistake")

        seen: list[object] = []
        monitor.listen(bad)
        monitor.listen(seen.append)
        await until(lambda: len(seen) > 3)
        assert monitor.restarts == 0
        assert monitor.latest is not None
        assert not monitor.latest.error
        assert "a listener's own mistake" in caplog.text


async def test_snapshot_without_a_following_cycle_becomes_stale() -> None:
    async with bench("atv71") as here:
        latest = here.console.latest
        assert latest is not None
        assert not latest.is_stale(latest.time + 1.0)
        assert latest.is_stale(latest.time + 5.0)


async def test_arming_requires_a_current_state() -> None:
    """With a paused monitor, an old state arms nothing; the drive is read."""
    async with bench("atv71") as here:
        here.console.monitor.stop()
        await until(lambda: here.session.state(1.0).kind == "unknown")
        before = len(here.line.trace)
        here.console.commander.arm()
        assert not here.session.arming.armed
        await until(lambda: here.session.arming.armed)
        requested = [f for f in list(here.line.trace)[before:] if f.direction == "out"]
        assert requested


async def test_drive_without_a_state_is_not_armed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with bench("atv71", watch=False) as here:

        async def deaf(*_: Any, **__: Any) -> Reply:
            raise NoAnswer(1, 3, 0)

        monkeypatch.setattr(here.line, "read", deaf)
        here.console.commander.arm()
        await until(lambda: here.session.work.outcome is not None)
        assert here.session.work.outcome is not None
        assert here.session.work.outcome.kind is OutcomeKind.REFUSED
        assert not here.session.arming.armed


# What is being done


EIGHT = ("ACC", "DEC", "LSP", "AC2", "DE2", "TLS", "JPF", "ITH")


async def test_stop_ends_parameter_writing_before_the_next_frame() -> None:
    """Eight staged edits: the frame on the wire may be sent, nothing after the stop is."""
    async with bench("atv71", run_hz=20.0) as here:
        editor, profile = here.console.editor, here.session.profile
        codes = [c for c in EIGHT if profile.get(c) and profile[c].access == "rw"]
        readings = await Reader(here.session).read([*codes, "INR"])
        staged = 0
        for code in codes:
            raw = readings[code].raw
            assert raw is not None
            try:
                editor.staging.stage_raw(code, raw + 1)
                staged += 1
            except OrderRefused:
                continue
        assert staged >= 5
        here.session.arming.arm()
        editor.apply()
        await until(lambda: len(here.writes()) >= 2)
        here.fleet.stop([here.session])
        await until(lambda: (8501, 7) in here.writes())
        sent = here.writes()
        at = sent.index((8501, 7))
        await until(lambda: not here.session.work.busy)
        await asyncio.sleep(0.3)
        assert [write for write in here.writes()[at:] if write[0] != 8501] == []
        assert at < staged
        assert not here.session.arming.armed
        assert len(editor.staging.edits) >= staged - at
        # for the request that was on the wire, the drive is read
        await until(lambda: all(here.drive.raw(e.code) == e.old for e in editor.staging.edits))
        assert len(editor.staging.edits) < staged


async def test_settings_and_blocks_are_refused_on_a_disarmed_drive() -> None:
    """Arming belongs to the drive, not to the screen that asks."""
    async with bench("atv71") as here:
        await Reader(here.session).read(["ACC", "INR"])
        editor = here.console.editor
        editor.staging.stage("ACC", "7 s")
        editor.apply()
        editor.save()
        editor.factory()
        await asyncio.sleep(0.3)
        assert here.writes() == []
        assert here.session.work.outcome is not None
        assert "Not armed" in here.session.work.outcome.text
        assert "ACC" in editor.staging.edits


async def test_tasks_of_a_drive_run_one_at_a_time() -> None:
    async with bench("atv71") as here:
        await Reader(here.session).read(["ACC", "INR"])
        here.session.arming.arm()
        here.console.commander.order("forward")
        editor = here.console.editor
        editor.staging.stage("ACC", "7 s")
        editor.apply()
        assert here.session.work.outcome is not None
        assert "Another command" in here.session.work.outcome.text
        await until(lambda: not here.session.work.busy)
        assert here.drive.raw("ACC") == 30


# The fleet


async def test_drives_can_be_iterated_from_another_thread() -> None:
    async with bench("atv71", watch=False) as here:
        fleet, ended = here.fleet, threading.Event()
        errors: list[BaseException] = []

        def walk() -> None:
            try:
                while not ended.is_set():
                    for found in fleet.found.values():
                        assert found.identity.device
                    assert len(fleet.sessions) <= 31
            except BaseException as error:
                errors.append(error)

        thread = threading.Thread(target=walk)
        thread.start()
        try:
            for device in range(2, 32):
                fleet.take(DriveSession(fleet.line, device, here.session.profile))
                await asyncio.sleep(0)
        finally:
            ended.set()
            thread.join()
        assert errors == []
        assert list(fleet.found) == list(range(1, 32))


async def test_resting_drives_that_will_trip_are_known() -> None:
    """An Altivar 21 watches the line from the first request on, at rest too."""
    async with bench("atv21") as here:
        await until(lambda: here.fleet.line_watch.watch(1) is not None)
        alone = here.fleet.line_watch.pending_timeouts()
        assert alone[1].timeout == 3.0
        assert here.fleet.line_watch.under_command() == []


async def test_motor_commanded_by_the_line_is_watched_whatever_started_it() -> None:
    """The timeout of an Altivar 71 runs once it was commanded, be it by another program."""
    async with bench("atv71", watch=False) as here:
        line_watch = here.fleet.line_watch
        await until(lambda: line_watch.watch(1) is not None)
        assert line_watch.pending_timeouts() == {}
        for address, word in ((8502, 200), (8501, 6), (8501, 7), (8501, 15)):
            await here.line.write(1, address, [word])
        await until(lambda: line_watch.runs(1))
        assert not here.session.commanded
        assert 1 in line_watch.pending_timeouts()


async def test_arming_by_a_command_does_not_expire() -> None:
    async with bench("atv71") as here:
        here.session.arming.arm(seconds=math.inf)
        assert here.session.arming.armed_for == math.inf
        here.session.arming.touch()
        assert here.session.arming.armed_for == math.inf


async def test_drive_found_again_keeps_its_known_values() -> None:
    """A rescan while a motor runs by a command from here must not disown it."""
    async with bench("atv71", run_hz=20.0) as here:
        here.session.note_command()
        again = here.fleet.take(DriveSession(here.line, 1, here.session.profile))
        assert again is here.console
        assert here.fleet.console(1) is here.console
        await until(lambda: here.fleet.line_watch.under_command() == [here.session])
        named = DriveSession(here.line, 1, library.load("atv312"))
        assert here.fleet.take(named) is here.console, "leaving has to ask"
        assert "It runs by a command of this panel" in here.fleet.events.events[-1].text


async def test_drive_with_another_profile_is_a_new_one() -> None:
    async with bench("atv71") as here:
        await until(lambda: not here.fleet.line_watch.under_command())
        other = here.fleet.take(DriveSession(here.line, 1, library.load("atv312")))
        assert other is not here.console
        assert not here.console.monitor.running
