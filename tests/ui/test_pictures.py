"""Pictures of every screen in its main states, at 80 x 24 and at 120 x 40."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from textual.pilot import Pilot
from textual.widgets import OptionList

from tui.bus.api import LineState
from tui.bus.errors import PortBusy
from tui.drive.profile import library
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.monitor.screen import MonitorScreen
from tui.session.connect.identify import DriveIdentity
from tui.session.console import DriveConsole
from tui.session.events import EventLog
from tui.session.fleet import FoundDrive
from tui.session.monitor.timeout import TimeoutWatch

from . import fakes

SIZES = pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["80x24", "120x40"])
Compare = Callable[..., bool]


@pytest.fixture(autouse=True)
def no_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same serial ports on every machine."""
    found = [("/dev/ttyUSB0", "USB-RS485 adapter"), ("/dev/ttyS0", "")]
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", lambda: found)
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")


WATCH = TimeoutWatch(10.0, library.load("atv71").data.communication_fault.reactions[6], active=True)  # type: ignore[union-attr]


def found_drives(line: LineState = fakes.CONNECTED) -> fakes.StillFleet:
    """A drive that runs, one without a profile, and one in fault."""
    unknown = DriveIdentity(5, "", "", "", "", None, ("powerdrive", "proxidrive", "varmeca"))
    faulty = DriveIdentity(7, "Telemecanique", "ATV71HU22N4", "0304", "", "atv71", ("atv71",))
    looks = {2: fakes.look_of(fakes.RUNNING), 7: fakes.look_of(fakes.FAULT)}
    return fakes.StillFleet(
        FoundDrive(fakes.ATV71, fakes.console_of(None)),
        FoundDrive(unknown),
        FoundDrive(faulty, fakes.console_of(None)),
        line_watch=fakes.FakeLineWatch(looks=looks),
        line=line,
    )


def connection(app: Any) -> ConnectionScreen:
    screen = app.screen
    assert isinstance(screen, ConnectionScreen)
    return screen


async def empty(_: Any, pilot: Pilot[None]) -> None:
    await pilot.pause()


async def scanning(app: Any, pilot: Pilot[None]) -> None:
    app.opened = fakes.opened()
    connection(app).say("Asking address 3, 3 of 10", "Esc stops.")
    connection(app).show_heads()
    await pilot.pause()


async def drives_found(app: Any, pilot: Pilot[None]) -> None:
    app.opened = fakes.opened()
    app.fleet = found_drives()
    screen = connection(app)
    screen.show_drives()
    screen.show_heads()
    screen._sum_up(range(1, 11))
    screen.query_one("#drives", OptionList).focus()
    await pilot.pause()


async def port_busy(app: Any, pilot: Pilot[None]) -> None:
    connection(app).fail(PortBusy("/dev/ttyUSB0", "mbpoll (pid 4711)"))
    await pilot.pause()


async def no_answer(app: Any, pilot: Pilot[None]) -> None:
    app.opened = fakes.opened()
    screen = connection(app)
    screen.show_heads()
    screen._sum_up(range(1, 11))
    await pilot.pause()


async def line_lost(app: Any, pilot: Pilot[None]) -> None:
    app.opened = fakes.opened(fakes.LOST)
    app.fleet = found_drives(fakes.LOST)
    screen = connection(app)
    screen.look()
    screen.show_heads()
    await pilot.pause()


async def dialog(_: Any, pilot: Pilot[None]) -> None:
    await pilot.press("n")
    await pilot.press(*"modbus", "enter")
    await pilot.pause()


CONNECTION = {
    "empty": empty,
    "scanning": scanning,
    "found": drives_found,
    "busy": port_busy,
    "no-answer": no_answer,
    "lost": line_lost,
    "dialog": dialog,
}


@SIZES
@pytest.mark.parametrize("state", CONNECTION)
def test_connection(snap_compare: Compare, state: str, size: tuple[int, int]) -> None:
    app = fakes.app_of()

    async def show(pilot: Pilot[None]) -> None:
        await pilot.pause()
        await CONNECTION[state](app, pilot)

    assert snap_compare(app, terminal_size=size, run_before=show)


def that_trip(shown: DriveConsole) -> fakes.StillFleet:
    """Beside the drive that is shown two that watch the line."""
    drives, alone = [FoundDrive(fakes.ATV71, shown)], {}
    for device, family, seconds, chosen in ((1, "atv21", 3.0, 0), (3, "atv71", 10.0, 1)):
        console = fakes.console_of(None, device=device, family=family)
        rules = console.session.profile.data.communication_fault
        assert rules is not None
        alone[device] = TimeoutWatch(seconds, rules.reactions[chosen])
        drives.append(FoundDrive(replace(fakes.ATV71, device=device), console))
    return fakes.StillFleet(*drives, line_watch=fakes.FakeLineWatch(alone=alone))


PALETTE = {"all": "", "elsewhere": "eeprom", "stop": "stop", "nothing": "xyz"}


@SIZES
@pytest.mark.parametrize("query", PALETTE)
def test_palette(snap_compare: Compare, query: str, size: tuple[int, int]) -> None:
    snapshot = fakes.snapshot_of(library.load("atv71"), fakes.RUNNING)
    app = fakes.app_of()
    app.opened = fakes.opened()
    console = fakes.console_of(snapshot)
    app.fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, console))
    app.chosen = console

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(MonitorScreen(console))
        await pilot.pause()
        app.screen.look()  # type: ignore[attr-defined]
        await pilot.press("ctrl+p", *PALETTE[query])
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


OVER_MONITOR = {"help": "question_mark", "frames": "7", "messages": "m", "leave": "q"}
LONG_REFUSAL = (
    "HSP: the drive refused with exception 4, not written. The drive is running forward."
    " Stop the motor and write again."
)


@SIZES
@pytest.mark.parametrize("screen", OVER_MONITOR)
def test_over_monitor(snap_compare: Compare, screen: str, size: tuple[int, int]) -> None:
    snapshot = fakes.snapshot_of(library.load("atv71"), fakes.RUNNING)
    app = fakes.app_of()
    app.opened = fakes.opened()
    console = fakes.console_of(snapshot)
    app.fleet = that_trip(console)
    fakes.choose(app, console)
    app.events = EventLog(lambda: 1_795_259_250.4)
    app.events.add("told", "3 keys came at once and were not taken.")
    app.events.add("done", "Run forward: Operation enabled", 2)
    app.events.add("refused", LONG_REFUSAL, 2)
    app.events.add("failed", "NOT STOPPED: Device 3 did not answer. Stop it at the machine.", 3)

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(MonitorScreen(console))
        await pilot.pause()
        app.screen.look()  # type: ignore[attr-defined]
        await pilot.press(OVER_MONITOR[screen])
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)
