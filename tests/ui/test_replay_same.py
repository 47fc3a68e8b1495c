"""At any time of a replay, the screens show what they showed live."""

from __future__ import annotations

import re
import sqlite3
import time
from contextlib import closing
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import pytest

from tui.app import DrivePanelApp
from tui.session.connect.open_line import OpenLine, demo_line, open_line
from tui.session.monitor.trend import TrendPoint
from tui.widgets.lines import Lines

from .test_frame import Panel

FRAME = {"strip", "tabs", "said", "keys", "curve"}
"""Parts that a replay marks; the curve is compared by its points."""
OF_CURVE = re.compile(r" +\d+ s(?= │)|(?<=max) +[\d.]+|(?<=min) +[\d.]+")
"""Extremes and length of the curve: the cycles of the first second are not regular ones."""
ANSWERS = re.compile(r"Answers +(\d+)/(\d+)")
NOW = re.compile(r"[\d.]+(?= \w+$)", re.MULTILINE)
"""Present values of Faults: live ones are of the last cycle, though another read may be newer."""
SMALL_CURVE = re.compile(r" *\d* *[┤│└├].*$", re.MULTILINE)
"""Curve of Faults: its first second is not regular either."""
FULL_READ = re.compile(r"─+ (?:reading \d+ of \d+ · )?")
"""Progress of the read of all settings, which has a pace of its own, and the rule before it."""
TRIPPED = re.compile(r"tripped \d\d:\d\d:\d\d")
"""A trip is up to one cycle later: the panel began new cycles since."""
CYCLE = 0.5
SETTLED = 0.15
"""Seconds after the end of a cycle: that of a replay ends a moment later than the recorded one."""


class Seen(NamedTuple):
    """Texts of a screen at a time."""

    wall: float
    place: str
    texts: dict[str, str]
    trend: tuple[TrendPoint, ...]


def texts_of(app: DrivePanelApp) -> dict[str, str]:
    found = {}
    for part in app.screen.query(Lines).results():
        lines = "\n".join(line.plain.rstrip() for line in part.lines)
        if part.id not in FRAME:
            found[str(part.id)] = FULL_READ.sub("─ ", OF_CURVE.sub("", lines))
    return found


async def settled(made: Panel) -> None:
    """Wait until a cycle has just ended, and the screen shows it."""

    def cycle() -> int:
        latest = made.app.chosen.latest if made.app.chosen else None
        return latest.cycle if latest is not None else 0

    before = cycle()
    await made.until(lambda: cycle() > before)
    await made.pilot.pause(SETTLED)
    made.app.screen.look()  # type: ignore[attr-defined]


def seen(app: DrivePanelApp) -> Seen:
    assert app.chosen is not None
    return Seen(time.time(), app.place, texts_of(app), app.chosen.monitor.trend)


async def live(record: Path) -> list[Seen]:
    """Run, trip and look at a drive; keep the record of its line."""
    app = DrivePanelApp(open_line=lambda *_, **__: demo_line({"atv71": 30.0}), start="x", device=1)
    found = []
    async with app.run_test(size=(80, 24)) as pilot:
        made = Panel(app, pilot)
        await made.until(lambda: app.chosen is not None and app.chosen.latest is not None)
        assert app.opened is not None
        assert app.opened.simulation is not None
        assert app.opened.private is not None
        await pilot.pause(2.0)
        for trips in (False, True, False):
            if trips:
                app.opened.simulation.drive(1).provoke("ObF")
            await pilot.pause(1.0)
            await settled(made)
            found.append(seen(app))
        for key in ("5", "3"):
            await pilot.press(key)
            await pilot.pause(1.5)
            await settled(made)
            found.append(seen(app))
        await pilot.pause(1.0)
        keep(Path(app.opened.private.name), record)
    return found


def keep(folder: Path, record: Path) -> None:
    (path,) = folder.rglob("*.sqlite")
    with closing(sqlite3.connect(path)) as base:
        base.execute("VACUUM INTO ?", (str(record),))


def opener(text: str, **_: object) -> OpenLine:
    return open_line(text)


@pytest.mark.sweep
async def test_screens_of_a_replay_show_what_they_showed_live(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DRIVEPANEL_RECORD", "on")
    record = tmp_path / "run.sqlite"
    was = await live(record)
    assert [item.place for item in was] == ["monitor"] * 3 + ["faults", "parameters"]
    assert "FAULT" in was[2].texts["state"]
    app = DrivePanelApp(open_line=opener, start=f"replay:{record}", device=1)
    async with app.run_test(size=(80, 24)) as pilot:
        made = Panel(app, pilot)
        await made.until(lambda: app.chosen is not None and app.chosen.latest is not None)
        for item in (*was, *reversed(was)):
            assert app.replay is not None
            app.replay.clock.hold()
            # as `@` does, to the microsecond
            await app._begin_again(app.replay, item.wall)
            app.replay.clock.hold()
            assert datetime.fromtimestamp(app.clock.wall()) == datetime.fromtimestamp(item.wall)
            app.action_goto(item.place)
            await made.until(lambda item=item: app.place == item.place)  # type: ignore[misc]
            await made.until(lambda item=item: same(app, item))  # type: ignore[misc]
            compare(item, app)


def same(app: DrivePanelApp, item: Seen) -> bool:
    """True once the screen has read everything; after 3 s, to show the difference."""
    return without_keys(texts_of(app)) == without_keys(item.texts) or bool(
        time.monotonic() > deadline(item)
    )


DEADLINES: dict[int, float] = {}


def deadline(item: Seen) -> float:
    return DEADLINES.setdefault(id(item), time.monotonic() + 10)


def without_keys(texts: dict[str, str]) -> dict[str, str]:
    """Texts without counts, and the part of Faults that says what a key does: it is refused."""
    return {
        place: NOW.sub("now", SMALL_CURVE.sub("", text.partition("  x      ")[0]))
        if place == "doctor"
        else TRIPPED.sub("tripped", ANSWERS.sub("", text))
        for place, text in texts.items()
    }


def compare(item: Seen, app: DrivePanelApp) -> None:
    now, was = texts_of(app), item.texts
    for place, text in without_keys(was).items():
        assert without_keys(now)[place].splitlines() == text.splitlines(), place
    if (counts := ANSWERS.search(was.get("state", ""))) is not None:
        again = ANSWERS.search(now["state"])
        assert again is not None
        # a reply that may be a copy of the one before is counted when it is asked again
        assert abs(int(again[1]) - int(counts[1])) <= 1
        assert int(again[2]) - int(again[1]) == int(counts[2]) - int(counts[1])
    assert app.chosen is not None
    points = app.chosen.monitor.trend
    assert len(points) > 2
    for point in points:
        # a cycle that goes on may have read some of the next point
        shown = [past for past in item.trend if to_wall(past) <= point.time + CYCLE]
        if len(shown) > 2 and all(value is not None for value in point.values):
            for values in zip(point.values, *(past.values for past in shown[-3:]), strict=True):
                assert values[0] in values[1:], point


def to_wall(point: TrendPoint) -> float:
    """The time of day of a live point, which has monotonic time."""
    return point.time + time.time() - time.monotonic()
