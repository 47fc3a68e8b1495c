"""Line: Enter never closes a good line without a question, and the cursor stays on its drive."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace

import pytest
from rich.text import Text
from textual.app import ComposeResult
from textual.pilot import Pilot
from textual.screen import Screen
from textual.widgets import Input

from tests.programs import rtu_tcp
from tui.app import DrivePanelApp
from tui.screens.connection.choices import (
    LIST_MARKS,
    LineChoice,
    ListMark,
    choice_line,
    groups,
    same_line,
)
from tui.screens.connection.drive_list import DriveList
from tui.screens.connection.line_list import list_width
from tui.screens.connection.state import QUIET
from tui.screens.monitor.screen import MonitorScreen
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.fleet import FoundDrive
from tui.simulator import DriveSpec, Simulation

from . import fakes
from .test_flows import shown, until

NAMED, OTHER = "serial:/dev/ttyUSB7,19200,8N1", "sim:atv312@5"
PORTS = [("/dev/ttyUSB0", "another adapter"), ("/dev/ttyUSB1", "")]


@pytest.fixture(autouse=True)
def ports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", lambda: list(PORTS))


@dataclass
class Line:
    """The panel on a line with simulated drives and a slow scan, and the lines opened."""

    app: DrivePanelApp
    pilot: Pilot[None]
    simulation: Simulation
    opened: list[str] = field(default_factory=list)

    async def searched(self) -> None:
        """Wait until the scan continues."""
        # at any address: a check every 50 ms may miss the first
        await until(
            self.pilot,
            lambda: re.search(r" Scan +\d+ of \d", shown(self.app, "search")) is not None,
        )

    @property
    def kept(self) -> bool:
        return self.opened == [NAMED] and self.app.opened is not None


@asynccontextmanager
async def line(*, first: int = 3, family: str = "atv21") -> AsyncIterator[Line]:
    """The panel started on a line; only its first drive answers."""
    simulation = Simulation([DriveSpec(family, first, run_hz=30.0), DriveSpec("atv71", first + 3)])
    simulation.start()
    real = rtu_tcp(simulation)
    opened: list[str] = []

    def opener(text: str, **how: object) -> OpenLine:
        opened.append(text)
        if text != NAMED:
            return open_line(OTHER, **how)  # type: ignore[arg-type]
        found = open_line(real, **how)  # type: ignore[arg-type]
        found.text = NAMED
        return found

    app = DrivePanelApp(open_line=opener, start=NAMED)
    try:
        async with app.run_test(size=(80, 24)) as pilot:
            yield Line(app, pilot, simulation, opened)
    finally:
        simulation.stop()


async def test_enter_during_the_scan_keeps_the_line_open_without_trips(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # far more empty addresses than three keys take
    for place in ("line_form", "line_keys"):
        monkeypatch.setattr(f"tui.screens.connection.{place}.ADDRESSES", "1-247")
    async with line() as made:
        app, pilot = made.app, made.pilot
        await made.searched()
        chosen = app.connection.lines.chosen
        assert chosen is not None
        assert chosen.text == NAMED
        for _ in range(3):
            await pilot.press("enter")
        await until(pilot, lambda: "being scanned" in shown(app, "said"))
        assert app.screen is app.connection
        await until(pilot, lambda: app.connection.drives.option_count == 1)
        # the cursor went to the drive: Enter watches it
        await until(pilot, lambda: app.connection.drives.has_focus)
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert made.kept
        assert made.simulation.drive(3).fault is None


async def test_second_line_is_opened_beside_one_with_drives() -> None:
    async with line() as made:
        app, pilot = made.app, made.pilot
        await until(pilot, lambda: app.connection.drives.option_count == 1)
        first = app.opened
        app.connection.lines.focus()
        app.connection.lines.offer("/dev/ttyUSB0")
        await pilot.press("enter")
        await until(pilot, lambda: len(made.opened) == 2)
        assert made.opened[1].startswith("serial:/dev/ttyUSB0")
        await until(pilot, lambda: app.opened is not first)
        assert first is not None
        assert first.line.state.status.value == "connected"
        assert app.screen is app.connection


@pytest.mark.sweep
async def test_enter_in_a_field_scans_with_the_typed_values() -> None:
    async with line() as made:
        app, pilot = made.app, made.pilot
        await until(pilot, lambda: app.connection.drives.option_count == 1)
        addresses = app.connection.query_one("#addresses", Input)
        addresses.focus()
        addresses.value = "6"
        await pilot.press("enter")
        await until(pilot, lambda: app.connection.drives.option_count == 2)
        await until(pilot, lambda: app.connection.drives.has_focus)
        assert made.kept


@pytest.mark.sweep
async def test_typing_into_a_field_changes_no_screen() -> None:
    async with line() as made:
        app, pilot = made.app, made.pilot
        await made.searched()
        profile = app.connection.query_one("#profile", Input)
        profile.focus()
        await until(pilot, lambda: app.connection.drives.option_count == 2)
        assert profile.has_focus
        # nor a person who returned to the lines
        app.connection.lines.focus()
        app.connection.show_drives()
        await pilot.pause()
        assert app.connection.lines.has_focus


@pytest.mark.parametrize(
    ("text", "other", "same"),
    [
        (NAMED, NAMED, True),
        ("/dev/ttyUSB0", "serial:/dev/ttyUSB0,19200,8E1", True),
        ("/dev/ttyUSB0", "serial:/dev/ttyUSB0,9600,8E1", False),
        ("serial:/dev/ttyUSB0,19200,8E1", "serial:/dev/ttyUSB0,19200,8N1", False),
        ("tcp:Gateway", "tcp:gateway:502", True),
        ("tcp:gateway", "rtu-tcp:gateway:502", False),
        ("tcp:gateway", "tcp:gateway,timeout=2", False),
        ("sim:atv71", "sim:atv71@1", True),
        ("sim:atv71", "sim:atv21", False),
        ("", "tcp:gateway", False),
    ],
)
def test_same_line_is_recognized_in_any_spelling(text: str, other: str, same: bool) -> None:
    assert same_line(text, other) is same
    assert same_line(other, text) is same


class Listed(Screen[None]):
    """The list of drives alone."""

    def compose(self) -> ComposeResult:
        """One list."""
        yield DriveList(id="drives")


def drives(*devices: int) -> dict[int, FoundDrive]:
    return {d: FoundDrive(replace(fakes.ATV71, device=d)) for d in sorted(devices)}


def lines(*devices: int) -> tuple[dict[int, Text], list[int]]:
    return {device: Text(f"drive {device}") for device in devices}, list(devices)


async def test_cursor_stays_on_its_drive_not_its_row() -> None:
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        await app.push_screen(Listed())
        listed = app.screen.query_one(DriveList)
        listed.fill(*lines(4, 7))
        listed.highlighted = 1
        listed.fill(*lines(2, 4, 5, 7))
        assert listed.chosen == 7
        assert [option.id for option in listed.options] == ["2", "4", "5", "7"]
        # while keys come nothing changes its place, new drives come last
        listed.fill(*lines(1, 2, 4, 5, 7), sort=False)
        assert [option.id for option in listed.options] == ["2", "4", "5", "7", "1"]
        assert listed.chosen == 7
        listed.fill(*lines(1, 2, 4, 5, 7))
        assert [option.id for option in listed.options] == ["1", "2", "4", "5", "7"]
        assert listed.chosen == 7
        # the first drive is selected if the selected one disappears
        listed.fill(*lines(1, 2))
        assert listed.chosen == 1
        await pilot.pause()


async def test_each_row_shows_the_drive_it_opens_after_others_appear_above() -> None:
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        await app.push_screen(Listed())
        listed = app.screen.query_one(DriveList)
        listed.styles.height = 10  # as on Line: no new height that would draw all of it again
        for devices in ((7,), (4, 7), (2, 4, 5, 7)):
            listed.fill(*lines(*devices))
            await pilot.pause()
            shown = [listed.render_line(y).text.split() for y in range(len(devices))]
            assert shown == [["drive", str(device)] for device in devices]


class HandClock(fakes.StillClock):
    """A clock that advances by the test."""

    now = fakes.NOW

    def monotonic(self) -> float:
        """Seconds that the test has advanced."""
        return self.now


async def test_sorting_waits_while_keys_are_typed() -> None:
    app = fakes.app_of()
    clock = HandClock()
    app.panel_clock = clock
    async with app.run_test(size=(80, 24)) as pilot:
        app.opened = fakes.opened()
        app.fleet = fleet = fakes.StillFleet(*drives(4, 7).values())
        app.connection.look()
        listed = app.connection.drives
        await until(pilot, lambda: listed.option_count == 2)
        listed.focus()
        await pilot.press("down")
        fleet.hold(drives(2)[2])
        app.connection.look()
        assert [option.id for option in listed.options] == ["4", "7", "2"]
        assert listed.chosen == 7
        clock.now += QUIET / 2
        await pilot.press("up")
        clock.now += QUIET / 2
        app.connection.look()
        assert [option.id for option in listed.options] == ["4", "7", "2"]
        clock.now += QUIET
        app.connection.look()
        assert [option.id for option in listed.options] == ["2", "4", "7"]
        assert listed.chosen == 4


def test_listed_simulated_line_is_not_repeated() -> None:
    serial, recent, simulated = groups(
        [], ["sim:atv71@2,atv21", "sim:atv21@1,atv31@2,atv312@3,atv71@4,powerdrive@5", "tcp:plc"]
    )
    assert [choice.text for choice in recent.choices] == ["sim:atv71@2,atv21", "tcp:plc"]
    assert len(simulated.choices) == 2
    assert serial.choices == ()


@pytest.mark.parametrize("mark", LIST_MARKS)
def test_style_of_a_mark_is_not_that_of_the_whole_line(mark: ListMark) -> None:
    text = choice_line(LineChoice("/dev/ttyUSB0", "USB-RS485 adapter"), 60, mark)
    assert not text.style
    assert len(text.spans) == 3


@pytest.mark.parametrize("width", [80, 120, 200])
def test_list_of_lines_without_drives_shows_whole_descriptions(width: int) -> None:
    choice = LineChoice("/dev/ttyUSB0", "USB-RS485 adapter", path="/dev/ttyUSB0")
    assert choice_line(choice, list_width(width) - 1).plain.endswith("USB-RS485 adapter")
