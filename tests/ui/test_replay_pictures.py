"""Pictures of a replay: Monitor and Faults after a trip, and a dialog over them."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.pilot import Pilot

from tests.session.test_replay import BEGIN, event, record, row
from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.drive.profile import library
from tui.session.connect.open_line import OpenLine, open_line

from .fakes import CHANNELS, FAULT, RUNNING, STORED
from .test_frame import Panel
from .test_pictures import SIZES, Compare

SECONDS = 120
TRIP = 90
SCENES = {"monitor": (60, ()), "trip": (95, ()), "faults": (95, ("5",)), "time": (60, ("@",))}


@pytest.fixture
def trip(tmp_path: Path) -> Path:
    """Two minutes of an Altivar 71 that runs, changes its speed and trips."""
    profile = library.load("atv71")
    rows = []
    for at in range(SECONDS):
        hertz = 300 if at < 40 else 520 if at < 75 else 400
        running = {**RUNNING, "RFR": hertz, "FRH": hertz}
        now = FAULT if at >= TRIP else running
        for code, word in {**CHANNELS, **STORED, **now}.items():
            rows.append(row(at + 0.01, (word & 0xFFFF,), address=profile[code].address))
    notes = (
        event(0, "profile", '{"profile": "atv71", "reference": "ATV71HD15N4"}', 1),
        event(20, "commander", "It commands the drive.", 1),
        event(TRIP, "fault", "Tripped on ObF Overbraking.", 1),
        event(110, "stop", "the stop key", 1),
    )
    return record(tmp_path, *rows, events=notes)


def opener(text: str, **_: object) -> OpenLine:
    return open_line(text)


@SIZES
@pytest.mark.parametrize("scene", kept(SCENES, "monitor"))
def test_replay(scene: str, size: tuple[int, int], trip: Path, snap_compare: Compare) -> None:
    at, keys = SCENES[scene]
    app = DrivePanelApp(open_line=opener, start=f"replay:{trip}", device=1)

    async def show(pilot: Pilot[None]) -> None:
        made = Panel(app, pilot)
        await made.until(lambda: app.chosen is not None and not app.opening.goes_on)
        assert app.replay is not None
        app.replay.clock.hold()
        await app._begin_again(app.replay, BEGIN + at + 0.5)
        app.replay.clock.hold()
        await made.until(lambda: app.chosen is not None and app.chosen.latest is not None)
        for key in keys:
            await pilot.press(key)
        await pilot.pause(0.6)
        for screen in app.screen_stack:
            getattr(screen, "look", lambda: None)()
        app.look_around()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)
