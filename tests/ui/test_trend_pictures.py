"""Pictures of Trend: live, held with cursor and marks, reduced, old and missing values, events."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pytest
from textual.pilot import Pilot

from tests.sweeps import kept
from tui.drive.profile import library
from tui.screens.trend import loading as trend_loading
from tui.screens.trend import screen as trend_screen
from tui.screens.trend.screen import TrendScreen
from tui.session.events import EventLog
from tui.session.fleet import FoundDrive
from tui.session.monitor.trend_bands import TrendBand
from tui.session.record.decoding import HistoryPoint
from tui.session.record.history import History
from tui.session.record.schema import EventRow
from tui.terminal.abilities import EVERYTHING, Abilities

from . import fakes
from .test_pictures import Compare
from .test_poor_terminals import POOR

WALL = 1_795_259_250.4
BANDS = [TrendBand(2, "RFR"), TrendBand(2, "LCR"), TrendBand(2, "OTR")]
FOUR = [*BANDS, TrendBand(2, "ULN")]
LEVELS = {"RFR": 50.0, "FRH": 48.0, "LCR": 8.4, "OTR": 72.5, "ULN": 398.0}
UNITS = {"RFR": "Hz", "FRH": "Hz", "LCR": "A", "OTR": "%", "ULN": "V"}


@dataclass(frozen=True)
class Scene:
    """Contents of the screen, and the keys that lead to it."""

    bands: Sequence[TrendBand] = tuple(BANDS)
    keys: Sequence[str] = ()
    age: float = 0.1
    error: str = ""
    reduced: bool = False
    recorded: bool = True


SCENES = {
    "live": Scene(),
    "marks": Scene(keys=[*["left"] * 8, "M", *["left"] * 24, "M", *["right"] * 12]),
    "four": Scene(bands=FOUR, keys=["left"]),
    "reduced": Scene(keys=[*[">"] * 6, *["left"] * 20], reduced=True),
    "old": Scene(age=14.0),
    "not-read": Scene(
        bands=[BANDS[0], TrendBand(9, "LCR"), TrendBand(2, "XYZ")],
    ),
    "failed": Scene(error="Device 2 did not answer (function 3).", age=14.0),
    "events": Scene(keys=["tab", "down"]),
    "empty": Scene(recorded=False, bands=[BANDS[0]], keys=["down"]),
}
SHOWN_AT = {
    "80x24": ["live", "marks", "four", "reduced", "old", "not-read", "failed", "events", "empty"],
    "120x40": ["marks", "four"],
    "60x16": ["marks", "four"],
    "200x60": ["four"],
}


def value_of(code: str, at: float) -> float:
    """The value of a code, some seconds before the picture."""
    level = LEVELS[code]
    if code == "FRH":
        return level if at < 46 else 0.0
    if code == "RFR":
        return level * min(1.0, max(0.0, (44 - at) / 6))
    return level * (1 + 0.08 * math.sin(at / 4)) * (0.1 if at > 44 and code != "ULN" else 1)


def recorded(code: str, since: float, *, reduced: bool) -> list[HistoryPoint]:
    """A run with a gap; reduced to 10 s before the last minute."""
    found = []
    at = min(WALL - since, 3600.0)
    while at > 0.3:
        if reduced and at > 60:
            values = [value_of(code, at - 40 * (number / 9)) for number in range(10)]
            mean = sum(values) / 10
            found.append(
                HistoryPoint(
                    WALL - at, WALL - at + 9.8, min(values), mean, max(values), good=20,
                    reduced=True,
                )
            )  # fmt: skip
            at -= 10
            continue
        if not 20 < at < 25:
            value = value_of(code, at)
            found.append(HistoryPoint(WALL - at, WALL - at, value, value, value))
        at -= 0.5
    return found


def panel(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, abilities: Abilities = EVERYTHING
) -> tuple[Any, TrendScreen]:
    """The panel on Trend in that scene."""

    def read(_: object, traces: Sequence[Any], since: float, until: float) -> list[History]:
        found = []
        for trace in traces:
            code = trace.band.code
            known = scene.recorded and code in LEVELS and trace.console is not None
            points = recorded(code, since, reduced=scene.reduced) if known else []
            inside = [point for point in points if since <= point.time <= until]
            found.append(History(inside, UNITS.get(code, "")))
        return found

    rows = [
        EventRow(round((WALL - 44) * 1e6), 0, 2, "done", "Run forward: Operation enabled"),
        EventRow(round((WALL - 12) * 1e6), 0, 2, "stop", "Space"),
        EventRow(round((WALL - 300) * 1e6), 0, 2, "fault", "Fault ObF"),
    ]
    monkeypatch.setattr(trend_loading, "read_traces", read)
    monkeypatch.setattr(trend_loading, "recorded_events", lambda *_: rows if scene.recorded else [])
    oldest = WALL - 20 * 3600 if scene.recorded else None
    monkeypatch.setattr(trend_loading, "oldest_reply", lambda *_: oldest)
    monkeypatch.setattr(trend_screen, "stored_bands", lambda _: list(scene.bands))
    snapshot = fakes.snapshot_of(
        library.load("atv71"), fakes.RUNNING, age=scene.age, error=scene.error
    )
    app = fakes.app_of(abilities=abilities, kind=fakes.Easel)
    app.opened = fakes.opened()
    console = fakes.console_of(snapshot, clock=fakes.StillClock())
    app.fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, console))
    fakes.choose(app, console)
    app.events = EventLog(lambda: WALL)
    return app, TrendScreen(console)


async def show(app: Any, screen: TrendScreen, scene: Scene, pilot: Pilot[None]) -> None:
    await app.push_screen(screen)
    await app.workers.wait_for_complete()
    await pilot.pause()
    for key in scene.keys:
        await pilot.press(key)
        await app.workers.wait_for_complete()
    await pilot.pause()
    screen.look()
    await pilot.pause()


PLACES = [
    pytest.param(
        name, size, id=f"{name}-{size}", marks=[] if size == "80x24" else [pytest.mark.sweep]
    )
    for size, names in SHOWN_AT.items()
    for name in names
]


@pytest.mark.drawn
@pytest.mark.parametrize(
    "terminal", kept(["plain signs", "vt100", "sixteen colors"], "plain signs")
)
def test_trend_on_a_poor_terminal(
    snap_compare: Compare, terminal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, screen = panel(SCENES["marks"], monkeypatch, POOR[terminal])

    async def run(pilot: Pilot[None]) -> None:
        await show(app, screen, SCENES["marks"], pilot)

    assert snap_compare(app, terminal_size=(80, 24), run_before=run)


@pytest.mark.parametrize(("name", "size"), PLACES)
def test_trend(
    snap_compare: Compare, monkeypatch: pytest.MonkeyPatch, name: str, size: str
) -> None:
    scene = SCENES[name]
    app, screen = panel(scene, monkeypatch)
    width, height = map(int, size.split("x"))

    async def run(pilot: Pilot[None]) -> None:
        await show(app, screen, scene, pilot)

    assert snap_compare(app, terminal_size=(width, height), run_before=run)
