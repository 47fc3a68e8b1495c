"""Pictures of commanding: armed, commanded, refused, stopping, tripped; and its screens."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, cast

import pytest
from textual.pilot import Pilot

from tests.sweeps import kept
from tui.drive.profile import library
from tui.screens.monitor.screen import MonitorScreen
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase, StopReport, StopSummary
from tui.session.fleet import FoundDrive
from tui.session.journal import Entry
from tui.session.monitor.fault_record import FaultRecord, Moment, Recorder
from tui.session.monitor.trend import TrendPoint
from tui.session.work import Outcome, OutcomeKind
from tui.terminal.abilities import EVERYTHING, Abilities

from . import fakes
from .test_pictures import SIZES, WATCH, Compare


@dataclass
class KeyInput:
    """Command state of a drive: armed for this many seconds, and the result."""

    armed_for: float | None = None
    outcome: Outcome | None = None
    lost: bool = False
    """True if the drive no longer has the written command word."""


@dataclass
class FakeStopper:
    """A stopper with given reports."""

    reports: dict[int, StopReport] = field(default_factory=dict)

    def stop(self, *_: Any) -> None:
        """Nothing turns."""

    def wait(self, *_: Any) -> StopSummary:
        """All motors are at standstill."""
        return StopSummary([])


def stop(phase: Phase, text: str) -> StopReport:
    return StopReport(2, phase, text, fakes.NOW - 1, fakes.NOW - 1)


def outcome(kind: OutcomeKind, text: str) -> Outcome:
    return Outcome(kind, text, fakes.NOW - 0.5)


REMOTE = {**fakes.READY, "CCC": 1, "CRC": 1}
RUNNING = {"raws": fakes.RUNNING}
SWITCHED = {"CHCF": 2, "CCS": 133, "CCC": 1, "LRS7": 0b0101, "IL1R": 1}
"""Commanded by the terminals while input LI5 is open."""
BRAKING = {"DEC": 5, "DE2": 50, "BRA": 0, "VBR": 820, "VCAL": 6}
LIMITS = {"HSP": 500, "LSP": 0, "ACC": 30, "INR": 1, "TFR": 600, "FRS": 500}
STATES: dict[str, tuple[dict[str, Any], KeyInput, StopReport | None, bool]] = {
    "armed": ({"raws": fakes.READY}, KeyInput(57), None, False),
    "done": (
        RUNNING,
        KeyInput(59, outcome(OutcomeKind.DONE, "Run forward: Operation enabled")),
        None,
        False,
    ),
    "refused": (
        {"raws": fakes.READY},
        KeyInput(
            41, outcome(OutcomeKind.REFUSED, "LFR: 80.0 Hz is above the high speed HSP, 60.0 Hz.")
        ),
        None,
        False,
    ),
    "no-effect": ({"raws": REMOTE}, KeyInput(57), None, False),
    "stopping": (RUNNING, KeyInput(57), stop(Phase.STOPPING, "Ramp stop, 31.5 Hz"), False),
    "not-stopped": (
        RUNNING,
        KeyInput(),
        stop(Phase.FAILED, "NOT STOPPED: Device 2 did not answer. Stop it at the machine."),
        False,
    ),
    "lost-orders": (
        {"raws": fakes.READY},
        KeyInput(lost=True),
        None,
        False,
    ),
    "tripped": ({"raws": fakes.FAULT}, KeyInput(31), None, True),
}


def trip() -> FaultRecord:
    """A trip after a run of some seconds."""
    profile = library.load("atv71")
    codes = ("RFR", "FRH", "RFRD", "LCR", "OTR")
    headings = tuple(f"{code} {profile[code].unit}" for code in codes)
    wall = 1_795_259_250.4
    moments = tuple(
        Moment(0.0, wall - 0.5 * n, "running forward", (f"{50 - n}.0", "50.0", "1480", "8.4", "72"))
        for n in range(20, 0, -1)
    )
    end = Moment(0.0, wall, "fault ObF", ("0.0", "50.0", "0", "0.0", "0"))
    entry = Entry(
        time="2026-11-21T11:07:29.937+00:00", line="", device=2, profile="atv71", code="LFR",
        address=8502, old_raw=0, old="0.0 Hz", new_raw=500, new="50.0 Hz", answer="ok",
        read_back=500, why="reference",
    )  # fmt: skip
    before = fakes.readings_of(profile, {**fakes.RUNNING, "HMIS": 6}, fakes.NOW - 20)
    fault = profile.fault(18)
    points = [TrendPoint(-0.5 * n, (50.0 - n, 8.4, 50.0)) for n in range(20, 0, -1)]
    return FaultRecord(
        0.0, wall, fault, codes, headings, (*moments, end), (entry,), before,
        (*points, TrendPoint(0.0, (0.0, 0.0, 50.0))), 0.5,
    )  # fmt: skip


def panel(name: str, abilities: Abilities = EVERYTHING) -> tuple[Any, MonitorScreen]:
    """The panel on a drive in that state."""
    how, given, report, unseen = STATES[name]
    snapshot = fakes.snapshot_of(library.load("atv71"), **how)
    console = fakes.console_of(snapshot, armed=given.armed_for, clock=fakes.StillClock())
    console.session.work.outcome = given.outcome
    if given.lost:
        console.commander.given.note_command("CMD", 0x000F)
        console.session.image.confirm("CMD", 0, fakes.NOW)
    record = trip() if unseen else None
    console.recorder = Recorder(
        console.session, console.journal, record, not unseen, since=fakes.NOW - 12
    )
    app = fakes.app_of(abilities=abilities, kind=fakes.Easel)
    app.opened = fakes.opened()
    found = FoundDrive(fakes.ATV71, console)
    app.fleet = fakes.StillFleet(found, line_watch=fakes.FakeLineWatch(WATCH))
    fakes.choose(app, console)
    app.fleet.stopper = cast("Stopper", FakeStopper({2: report} if report else {}))
    return app, MonitorScreen(console)


@SIZES
@pytest.mark.parametrize("state", STATES)
def test_commanded(snap_compare: Compare, state: str, size: tuple[int, int]) -> None:
    app, screen = panel(state)

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(screen)
        await pilot.pause()
        screen.look()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


OVER = {
    "run": ("armed", ["r"]),
    "run-typed": ("armed", ["r", *"4.5"]),
    "run-refused": ("armed", ["v", *"80", "enter"]),
    "reference": ("armed", ["f", *"80"]),
    "reset": ("tripped", ["x"]),
    "coast": ("done", ["z"]),
    "options": ("armed", ["o"]),
    "hand-back": ("armed", ["g"]),
    "control-source": ("armed", ["6", "down"]),
    "control-switched": ("no-effect", ["6"]),
    "communication-map": ("armed", ["6", "tab"]),
    "control-source-sure": ("armed", ["6", "down", "enter"]),
    "faults": ("tripped", ["5"]),
    "faults-none": ("armed", ["5"]),
    "save": ("tripped", ["5", "ctrl+s"]),
    "leave-running": ("done", ["q"]),
    "start-up": ("armed", ["B"]),
    "start-up-ramps": ("armed", ["B", *["tab"] * 14, "down"]),
    "wiring": ("armed", ["I"]),
    "wiring-pins": ("armed", ["I", "tab", "tab"]),
}


THAT_ACT = ("run", "run-refused", "reference", "reset", "coast", "hand-back", "control-source-sure",
            "faults", "leave-running")  # fmt: skip
"""Questions that act on a motor or a drive."""


@SIZES
@pytest.mark.parametrize("screen", kept(OVER, *THAT_ACT))
def test_screens_of_commanding(
    snap_compare: Compare,
    screen: str,
    size: tuple[int, int],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app, show = shown_over(screen, monkeypatch)
    assert snap_compare(app, terminal_size=size, run_before=show)


@pytest.mark.parametrize("size", [(60, 16), (200, 60)], ids=["60x16", "200x60"])
@pytest.mark.parametrize("screen", ["faults", "faults-none"])
def test_faults_at_other_sizes(
    snap_compare: Compare, screen: str, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    app, show = shown_over(screen, monkeypatch)
    assert snap_compare(app, terminal_size=size, run_before=show)


def shown_over(
    screen: str, monkeypatch: pytest.MonkeyPatch, abilities: Abilities = EVERYTHING
) -> tuple[Any, Callable[[Pilot[None]], Awaitable[None]]]:
    """The panel on a drive, and what opens a screen of OVER on it."""
    state, keys = OVER[screen]
    app, monitor = panel(state, abilities)
    held = {**fakes.RUNNING, **fakes.CHANNELS, **fakes.STORED, **BRAKING, **LIMITS}
    if screen == "control-switched":
        held |= SWITCHED
    monitor.session.image.confirm("LFR", 300, fakes.NOW)

    async def read(codes: list[str], **_: Any) -> Any:
        profile = monitor.session.profile
        raws = {code: held.get(code, 0) for code in (*codes, "INR")}  # INR scales the ramps
        for code, raw in raws.items():
            monitor.session.image.confirm(code, raw, fakes.NOW)
        return fakes.readings_of(profile, raws, fakes.NOW)

    monkeypatch.setattr(monitor.console, "read", read)
    if screen == "leave-running":
        app.fleet.line_watch.commanded = [monitor.session]
    monkeypatch.setattr("tui.screens.faults.screen.state_folder", lambda: fakes.FOLDER)

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(monitor)
        await pilot.pause()
        await pilot.press(*keys[:1])
        await app.workers.wait_for_complete()  # of what a screen reads before keys do anything
        await pilot.press(*keys[1:])
        await app.workers.wait_for_complete()
        await pilot.pause()
        await pilot.pause()

    return app, show
