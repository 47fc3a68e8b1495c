"""Drives read for the plant: absent ones cost the others little, and are read again later."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import suppress
from dataclasses import dataclass, field, replace

import pytest
import pytest_asyncio

from tests.session.test_stop import wait_for
from tui.bus.line import Line, Timing
from tui.bus.link import RtuTcpLink
from tui.cli.plant import drives
from tui.cli.plant.drives import PlantDrive, PlantLine
from tui.cli.plant.status import DriveStatus
from tui.cli.shared.options import Target
from tui.session.connect.open_line import OpenLine
from tui.simulator import Simulation, parse_drives

LINE = "sim:atv71@1,atv312@2,powerdrive@3"
HERE, OTHER, NAMELESS, AWAY = 1, 2, 3, 9


@dataclass
class Bench:
    """A simulated line that is read."""

    opened: OpenLine
    plant: PlantLine
    changes: list[int] = field(default_factory=list)

    @property
    def simulation(self) -> Simulation:
        assert self.opened.simulation is not None
        return self.opened.simulation

    def sight(self, device: int) -> DriveStatus:
        seen = self.plant.sight(time.monotonic())
        return next(drive for drive in seen.drives if drive.device == device)

    def good(self, device: int) -> bool:
        seen = self.sight(device)
        return seen.cycle is not None and not seen.error

    def requested(self, device: int) -> int:
        """Requests sent to a device."""
        counted = self.opened.line.counters.devices.get(device)
        return counted.requests if counted is not None else 0


@pytest_asyncio.fixture
async def bench(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Bench]:
    monkeypatch.setattr(drives, "PLANT_LOOK_INTERVAL", 0.05)
    monkeypatch.setattr(drives, "FIRST_LOOK_WITHIN", 0.5)
    monkeypatch.setattr(drives, "FIND_AGAIN", 0.1)
    simulation = Simulation(parse_drives(LINE.removeprefix("sim:")))
    simulation.start()
    quick = Timing(first_timeout=0.2, scan_timeout=0.2, patient_timeout=0.2, late_reply=0.2)
    line = Line(RtuTcpLink(*simulation.serve_rtu_tcp()), timing=quick)
    line.open(wait=5.0)
    opened = OpenLine(LINE, line, simulation)
    changes: list[int] = []
    read = tuple(
        PlantDrive(opened, Target(LINE, device, None), (), 0.1, lambda: changes.append(1))
        for device in (HERE, AWAY, OTHER, NAMELESS)
    )
    made = Bench(opened, PlantLine("pump", opened, read), changes)
    task = asyncio.create_task(made.plant.run())
    yield made
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
    opened.close()


async def test_absent_drive_does_not_delay_others(
    bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    assert bench.sight(HERE).error == "Device 1 was not polled yet."
    assert bench.sight(HERE).contact == "not_polled"
    await wait_for(lambda: bench.good(HERE) and bench.good(OTHER))
    assert bench.changes
    before = bench.requested(HERE)
    await wait_for(lambda: bench.requested(HERE) > before + 20)
    assert bench.requested(AWAY) < before
    assert "did not answer" in bench.sight(AWAY).error
    assert (bench.sight(AWAY).contact, bench.sight(HERE).contact) == ("silent", "answers")
    await wait_for(lambda: "name its profile" in bench.sight(NAMELESS).error)
    output = capsys.readouterr().err
    assert output.count("Device 9 did not answer") == 1
    assert output.count("Retrying.") == 2


async def test_drive_never_polled_is_polled_before_an_absent_one(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drives, "FIND_AGAIN", 60.0)
    await wait_for(lambda: bench.good(OTHER))
    assert not bench.good(AWAY)


async def test_full_line_is_reported_once(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(drives, "RATE_LOOK_INTERVAL", 0.01)
    drive = bench.plant.drives[0]
    await wait_for(lambda: drive.cycle is not None)
    assert drive.cycle is not None
    slow = PlantDrive(bench.opened, Target(LINE, HERE, None), (), 1.0, lambda: None)
    slow.cycle = replace(drive.cycle, error="", period=5.8, wished=1.0)
    capsys.readouterr()
    task = asyncio.create_task(PlantLine("fan", bench.opened, (slow,)).report_rate())
    await asyncio.sleep(0.1)
    slow.cycle = replace(slow.cycle, period=1.0)
    await asyncio.sleep(0.1)
    task.cancel()
    lines = [line for line in capsys.readouterr().err.splitlines() if "fan" in line]
    assert lines == [
        "drivepanel: fan: the line is full. A cycle takes up to 5.8 s.",
        "drivepanel: fan: the cycle time is as requested again.",
    ]


async def test_drive_silent_for_long_is_identified_again(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drives, "SILENT_FOR_LONG", 0.5)
    await wait_for(lambda: bench.good(HERE))
    first = bench.sight(HERE).session
    bench.simulation.drive(HERE).power_off()
    await wait_for(lambda: not bench.good(HERE))
    seen = bench.sight(HERE).cycle
    assert seen is not None
    assert {str(reading.quality) for reading in seen.readings.values()} <= {"stale", "bad"}
    bench.simulation.drive(HERE).power_on()
    await wait_for(lambda: bench.good(HERE) and bench.sight(HERE).session is not first)
