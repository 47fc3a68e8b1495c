"""Pictures of Monitor in every state that a person may find it in, small and large."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import pytest
from textual.pilot import Pilot

from tests.sweeps import kept
from tui.bus.api import LineState
from tui.drive.profile import library
from tui.screens.monitor.screen import MonitorScreen
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase, StopReport
from tui.session.events import EventLog
from tui.session.fleet import FoundDrive
from tui.session.monitor.alarms import LineAlarms
from tui.session.timeout_report import TimeoutWatch
from tui.terminal.abilities import EVERYTHING, Abilities

from . import fakes
from .test_command_pictures import FakeStopper
from .test_pictures import SIZES, Compare

WALL = 1_795_259_250.4
REACTION = library.load("atv71").data.communication_fault.reactions[6]  # type: ignore[union-attr]
WATCH = TimeoutWatch(10.0, REACTION)
BEFORE = TimeoutWatch(10.0, REACTION, active=False)
NO_SUPPLY = {**fakes.READY, "ETA": 0x0221}
AT_TERMINALS = {**fakes.READY, "CCC": 1, "CRC": 1}
AT_ZERO = {**fakes.RUNNING, "RFR": 0, "FRH": 0, "RFRD": 0, "LCR": 21, "ETA": 0x0637}
SPEEDING_UP = {**fakes.RUNNING, "RFR": 212, "ETA": 0x0237, "ETI": 0x0A12}
RAW = {"10.40": 0x0003, "6.42": 0, "6.43": 1, "5.01": 4512, "5.04": 1350, "4.01": 118,
       "5.02": 398, "10.20": 0}  # fmt: skip
PERCENT = {"FD00": 3500, "FE02": 3500, "FE90": 1020, "FE03": 6270, "FE18": 4810, "FE05": 7000,
           "FD01": 0x0404, "FC91": 0, "FC90": 0, "FE30": 120, "FE04": 10100, "FE26": 41,
           "FE27": 38, "FE45": 1, "FE46": 1, "FE14": 812}  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """A drive with its last values, and its command state."""

    raws: Mapping[str, int] | None
    family: str = "atv71"
    armed: float | None = None
    line: LineState = fakes.CONNECTED
    age: float = 0.1
    error: str = ""
    heard: float = 0.2
    watch: TimeoutWatch | None = WATCH
    stop: StopReport | None = None
    keys: Sequence[str] = ()
    read_only: bool = False
    low_bandwidth: bool = False
    reference: int | None = None
    block: str = ""


def stop(phase: Phase, text: str) -> StopReport:
    return StopReport(2, phase, text, fakes.NOW - 1, fakes.NOW - 1)


SCENES = {
    "connecting": Scene(None, line=fakes.CONNECTING, watch=None),
    "running": Scene(fakes.RUNNING, armed=56.0, block="Scanner inputs"),
    "accelerating": Scene(SPEEDING_UP, armed=56.0),
    "reverse": Scene(fakes.REVERSE, armed=56.0),
    "standby": Scene(fakes.READY, watch=BEFORE),
    "standby-armed": Scene(fakes.READY, armed=57.0, watch=BEFORE),
    "at-zero": Scene(AT_ZERO, armed=57.0),
    "no-supply": Scene(NO_SUPPLY, armed=57.0),
    "terminals": Scene(AT_TERMINALS, armed=57.0),
    "fault": Scene(fakes.FAULT),
    "alarm": Scene(fakes.ALARM, armed=31.0),
    "stopping": Scene(fakes.RUNNING, stop=stop(Phase.STOPPING, "Ramp stop, 31.5 Hz")),
    "stopped": Scene(fakes.READY, stop=stop(Phase.STOPPED, "Ramp stop, 0.0 Hz")),
    "stop-failed": Scene(
        fakes.RUNNING,
        stop=stop(Phase.FAILED, "NOT STOPPED: Device 2 did not answer. Stop it at the machine."),
    ),
    "not-heard": Scene(
        fakes.RUNNING, age=14.0, error="Device 2 did not answer (function 3).", heard=14.0
    ),
    "hungry": Scene(fakes.RUNNING, age=1.4, heard=6.2),
    "line-lost": Scene(
        fakes.RUNNING, age=7.0, error="The line is lost.", heard=7.0, line=fakes.LOST
    ),
    "read-only": Scene(fakes.READY, read_only=True, watch=BEFORE),
    "low-bandwidth": Scene(fakes.RUNNING, low_bandwidth=True),
    "raw": Scene(RAW, family="powerdrive", watch=None),
    "percent": Scene(PERCENT, family="atv21"),
    "word": Scene(fakes.RUNNING, keys=["tab"]),
    "window": Scene(fakes.RUNNING, keys=["<"]),
    "ten-minutes": Scene(fakes.RUNNING, keys=[">", ">", ">"]),
    "cursor": Scene(fakes.RUNNING, keys=["equals_sign", *["left"] * 36]),
    "run": Scene(fakes.READY, armed=57.0, reference=300, keys=["r"]),
    "run-at-zero": Scene(fakes.READY, armed=57.0, reference=0, keys=["r"]),
    "run-refused": Scene(fakes.READY, armed=57.0, reference=300, keys=["v", *"80", "enter"]),
    "run-terminals": Scene(AT_TERMINALS, armed=57.0, reference=300, keys=["r"]),
}
LIMITS = {"HSP": 500, "LSP": 0, "ACC": 30, "INR": 1, "TFR": 600, "FRS": 500}


def panel(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, abilities: Abilities = EVERYTHING
) -> tuple[Any, MonitorScreen]:
    """The panel on Monitor in that scene."""
    profile = library.load(scene.family)
    snapshot = None
    if scene.raws is not None:
        snapshot = fakes.snapshot_of(
            profile, scene.raws, scene.line, age=scene.age, error=scene.error, block=scene.block
        )
    app = fakes.app_of(abilities=abilities, kind=fakes.Easel)
    app.opened, app.read_only = fakes.opened(scene.line), scene.read_only
    app.low_bandwidth = scene.low_bandwidth
    console = fakes.console_of(snapshot, scene.line, family=scene.family, armed=scene.armed)
    cast("fakes.StillLine", console.session.line)._heard = fakes.NOW - scene.heard
    if scene.reference is not None:
        console.session.image.confirm("LFR", scene.reference, fakes.NOW)
    identity = replace(fakes.ATV71, profile=scene.family)
    watch = fakes.FakeLineWatch(scene.watch)
    if snapshot is not None:
        watch.seen[2] = snapshot.state
    app.fleet = fakes.StillFleet(FoundDrive(identity, console), line_watch=watch, line=scene.line)
    app.fleet.alarms = LineAlarms(EventLog(), lambda _fault, _what: None)
    reports = {2: scene.stop} if scene.stop else {}
    app.fleet.stopper = cast("Stopper", FakeStopper(reports))
    app.events = EventLog(lambda: WALL)
    if snapshot is not None and snapshot.state.kind == "fault":
        app.fleet.alarms.take({2: snapshot.state}, watch.onsets.by_device)
        app.events.add("fault", "Tripped on ObF Overbraking.", 2)
    elif scene.armed is not None:
        app.events.add("told", "Armed for one minute.", 2)
    fakes.choose(app, console)

    async def read(codes: list[str], **_: Any) -> Any:
        held = {**fakes.RUNNING, **LIMITS}
        return fakes.readings_of(profile, {c: held.get(c, 0) for c in (*codes, "INR")}, fakes.NOW)

    monkeypatch.setattr(console, "read", read)
    return app, MonitorScreen(console)


async def show(app: Any, screen: MonitorScreen, keys: Sequence[str], pilot: Pilot[None]) -> None:
    await app.push_screen(screen)
    await pilot.pause()
    await pilot.press(*keys)
    await pilot.pause()
    for _ in range(2):
        app.draw_frame()
        screen.look()
        await pilot.pause()


OF_A_MOTOR = (
    "running", "reverse", "accelerating", "stopping", "stopped", "at-zero", "fault", "alarm",
    "stop-failed", "standby-armed", "run", "run-at-zero", "run-refused", "line-lost", "not-heard",
)  # fmt: skip
"""State of a motor, and the effect of the next key."""


@SIZES
@pytest.mark.parametrize("name", kept(SCENES, *OF_A_MOTOR))
def test_monitor(
    snap_compare: Compare, name: str, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    app, screen = panel(SCENES[name], monkeypatch)
    keys = SCENES[name].keys
    assert snap_compare(
        app, terminal_size=size, run_before=lambda pilot: show(app, screen, keys, pilot)
    )


OTHER_SIZES = {
    "60x20": (60, 20),
    "60x16": (60, 16),
    "200x60": (200, 60),
    "100x30": (100, 30),
    "59x24, too small": (59, 24),
    "40x12, too small": (40, 12),
    "24x6, too small": (24, 6),
}


@pytest.mark.parametrize("size", kept(OTHER_SIZES, *list(OTHER_SIZES)[:2]))
@pytest.mark.parametrize("name", ["running", "fault", "run"])
def test_other_sizes(
    snap_compare: Compare, name: str, size: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, screen = panel(SCENES[name], monkeypatch)
    keys = SCENES[name].keys
    assert snap_compare(
        app,
        terminal_size=OTHER_SIZES[size],
        run_before=lambda pilot: show(app, screen, keys, pilot),
    )
