"""Pictures of every screen in its main states, at 80 x 24 and at 120 x 40."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from textual.pilot import Pilot

from tests.sweeps import kept
from tui.drive.profile import library
from tui.screens.monitor.screen import MonitorScreen
from tui.session.console import DriveConsole
from tui.session.events import EventLog
from tui.session.fleet import FoundDrive
from tui.session.timeout_report import TimeoutWatch

from . import fakes

BOTH_SIZES = pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["80x24", "120x40"])
SMALL = pytest.param((80, 24), id="80x24")
LARGE = pytest.param((120, 40), id="120x40", marks=pytest.mark.sweep)
SIZES = pytest.mark.parametrize("size", [SMALL, LARGE])
"""Both sizes too; the larger one in the layer of sweeps."""
Compare = Callable[..., bool]


@pytest.fixture(autouse=True)
def no_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same serial ports on every machine."""
    found = [("/dev/ttyUSB0", "USB-RS485 adapter"), ("/dev/ttyS0", "")]
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", lambda: found)
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")


WATCH = TimeoutWatch(10.0, library.load("atv71").data.communication_fault.reactions[6], active=True)  # type: ignore[union-attr]


def that_trip(shown: DriveConsole) -> fakes.StillFleet:
    """Two drives with a timeout in addition to the one shown."""
    drives, alone = [FoundDrive(fakes.ATV71, shown)], {}
    for device, family, seconds, chosen in ((1, "atv21", 3.0, 0), (3, "atv71", 10.0, 1)):
        console = fakes.console_of(None, device=device, family=family)
        rules = console.session.profile.data.communication_fault
        assert rules is not None
        alone[device] = TimeoutWatch(seconds, rules.reactions[chosen])
        drives.append(FoundDrive(replace(fakes.ATV71, device=device), console))
    return fakes.StillFleet(*drives, line_watch=fakes.FakeLineWatch(alone=alone))


PALETTE = {"all": "", "elsewhere": "eeprom", "stop": "stop", "nothing": "xyz"}


@BOTH_SIZES
@pytest.mark.parametrize("query", kept(PALETTE, "all"))
def test_palette(snap_compare: Compare, query: str, size: tuple[int, int]) -> None:
    snapshot = fakes.snapshot_of(library.load("atv71"), fakes.RUNNING)
    app = fakes.app_of(kind=fakes.Easel)
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
    "The drive refused HSP with exception 4, not written. The drive is running forward."
    " Stop the motor and write again."
)


@SIZES
@pytest.mark.parametrize("screen", OVER_MONITOR)
def test_over_monitor(snap_compare: Compare, screen: str, size: tuple[int, int]) -> None:
    snapshot = fakes.snapshot_of(library.load("atv71"), fakes.RUNNING)
    app = fakes.app_of(kind=fakes.Easel)
    app.opened = fakes.opened()
    console = fakes.console_of(snapshot)
    app.fleet = that_trip(console)
    fakes.choose(app, console)
    app.events = EventLog(lambda: 1_795_259_250.4)
    app.events.add("told", "Ignored 3 keys that arrived together.")
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
