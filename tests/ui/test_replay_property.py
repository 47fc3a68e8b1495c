"""At any time of a replay, the screens show what they showed live.

The time of the live panel is controlled, so that a minute takes seconds. Screens, times and the
order of the seeks are random. What differs for a reason is left out, see `LEFT_OUT`.
"""

from __future__ import annotations

import asyncio
import random
import re
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.session.virtual_line import VirtualLine
from tui.app import DrivePanelApp
from tui.bus.model import LineStatus
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.events import EventLog
from tui.session.record.ghost import read_recorded
from tui.simulator import DriveSpec

from .test_frame import Panel

DIGITS = {
    "line": "1", "monitor": "2", "parameters": "3", "faults": "5", "control": "6", "trend": "8",
}  # fmt: skip
ALL, WITHOUT_REPLY = tuple(DIGITS), ("line", "control", "trend")
"""Monitor, Faults and Parameters begin to read again when they open, which a seek does not know."""
LATE = (0.1, 0.2, 0.3, 0.4, 0.5)
"""Seconds by which a value may be late while a replay goes on: a cycle."""
RESET = bytes.fromhex("0621350080")
LEFT_OUT: dict[str, tuple[str, ...]] = {
    # messages with the time at which this program got them, and that of a trip: up to a cycle later
    "": (r"^ \d\d:\d\d:\d\d .*", r"^ +Stop it first\.$", r"(?<=tripped )[\d:]+"),
    # the line, its scan, curves, whose first point depends on the cycle, and ages and counts: both
    # may be a second late
    "line": (r"^ +Lines .*", r"scan done.*", r"[⠀-⣿×·]", r"\d+ s\b", r"\d+ (good|%)",
             r"(\d\d:){2}\d\d"),
    # the curve, what is taken from it, its marks without room on the axis, and the keys, which a
    # replay does not offer
    "monitor": (
        r"(?<=reference)  [^<]*(?=<)",
        r"^ *[\d.]* *[┤│└]([^─]| ·|─┬|─ ).*", r"^ +(\d\d:){2}.*", r"(min|max) +[\d.]+",
        r" +\d+ s(?= │)", r"^ └.*┘$", r"^ +│[ ·⠀-⣿┆]*$", r"─+ (press a, then r|standby)",
    ),
    # values that another read brought, the curve, and the reset, which a replay refuses
    "faults": (
        r"(?s)\n  x      .*", r" *[\d.]* *[┤│└├](?![^\n]*│).*$", r"[-~\d.]+ \w*%?$",
        r"not known: .*", r"no value decides", r"^ +(Highest|Monitored|Last trip) .*",
        r"^ +(\d\d:){2}\d\d\.$",
    ),
    # a read of all parameters has a pace of its own, and brings registers beside those it wants
    "parameters": (r"reading \d+ of \d+", r"Changed \d+", r"[─ ]+"),
    # signs of events: a program has those that it heard
    "trend": (r"^ +└.*",),
    # which of the failed requests was the first
    "control": (r"register \d+",),
}  # fmt: skip


class Moment(NamedTuple):
    """A screen at a time of day."""

    wall: float
    place: str
    rows: list[str]


class RecordedFiles:
    """The recorder of a line, for Trend."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def files(self) -> list[Path]:
        return [self.path]

    def close(self) -> bool:
        return True


def rows_of(app: DrivePanelApp) -> list[str]:
    """The rows of the screen without its frame."""
    strips = app.screen._compositor.render_strips()
    rows = ["".join(part.text for part in strip).rstrip() for strip in strips][2:-2]
    text = "\n".join(rows)
    for pattern in (*LEFT_OUT[""], *LEFT_OUT[app.place]):
        text = re.sub(pattern, "", text, flags=re.MULTILINE)
    return [" ".join(row.split()) for row in text.splitlines() if row.strip()]


class LivePanel:
    """A panel on a line whose time the test lets go on."""

    def __init__(self, made: Panel, line: VirtualLine, seed: int) -> None:
        self.made, self.app, self.line = made, made.app, line
        self.chance = random.Random(seed)
        self.moments: list[Moment] = []

    async def until(self, holds: Callable[[], object]) -> None:
        end = time.monotonic() + 30
        while not holds():
            assert time.monotonic() < end, rows_of(self.app)
            await self.made.pilot.pause(0.01)
            await self.line.pass_time(0.02)

    async def go_on(self, seconds: float) -> None:
        end = self.line.time.monotonic() + seconds
        while (rest := end - self.line.time.monotonic()) > 0.001:
            await self.line.pass_time(min(rest, 0.1))
            await asyncio.sleep(0.001)

    async def look(self, *places: str) -> None:
        """Look at each screen for a while."""
        for place in places:
            if self.app.place != place:
                await self.made.pilot.press(DIGITS[place])
                await self.until(lambda place=place: self.app.place == place)  # type: ignore[misc]
            for _ in range(10):
                await self.made.pilot.pause(0.01)
                await self.go_on(0.1)
            await self.go_on(self.chance.uniform(0.5, 3))
            await self.settle()
            self.app.screen.look()  # type: ignore[attr-defined]
            await self.made.pilot.pause(0.05)
            self.moments.append(Moment(self.line.time.wall(), place, rows_of(self.app)))
            await self.go_on(0.2)

    async def settle(self) -> None:
        """Wait until a cycle has ended, and a moment longer: that of a replay ends a bit later."""

        def cycle() -> int:
            latest = self.app.chosen.latest if self.app.chosen else None
            return latest.cycle if latest is not None else 0

        before = cycle()
        for _ in range(60):
            if cycle() != before:
                break
            await self.go_on(0.01)
        await self.go_on(0.1)

    def some(self, places: tuple[str, ...], count: int) -> list[str]:
        return self.chance.sample(places, count)


async def live(record: Path, seed: int) -> list[Moment]:
    """A drive that runs, trips, stops answering, loses its line, and is reset."""
    line = VirtualLine(record, DriveSpec("atv71", 1, run_hz=30.0, wander=True))

    def opened(*_: object, **__: object) -> OpenLine:
        return OpenLine("x", line, devices=(1,), recorder=RecordedFiles(record))  # type: ignore[arg-type]

    app = DrivePanelApp(open_line=opened, start="x", device=1, clock=line.time)
    app.events = EventLog(line.time.wall)
    async with app.run_test(size=(80, 24)) as pilot:
        panel = LivePanel(Panel(app, pilot), line, seed)
        await panel.until(lambda: app.chosen is not None and app.chosen.latest is not None)
        await panel.go_on(8)
        await panel.look(*panel.some(ALL, 4), "monitor")
        line.simulation.drive(1).provoke("ObF")
        await panel.look("monitor", *panel.some(ALL, 4), "monitor")
        line.silence(1)
        await panel.look("monitor", *panel.some(WITHOUT_REPLY, 2))
        line.silence(1, False)
        await panel.go_on(4)
        await panel.look(*panel.some(("line", "monitor", "control", "trend"), 2))
        line.become(LineStatus.LOST, "The adapter is unplugged.")
        await panel.look(*panel.some(("line", "trend"), 1))
        line.become(LineStatus.CONNECTED)
        await panel.go_on(4)
        line.simulation.line.ask(1, RESET)
        await panel.look("monitor", *panel.some(("line", "monitor", "control", "trend"), 3))
        await panel.go_on(4)  # so that the record ends later
    line.end_record()
    return panel.moments


async def shown_at(made: Panel, item: Moment, *, goes_on: bool = False) -> list[str]:
    """Go to a time on a screen of the replay; return its rows once they are the same, or later.

    `goes_on`: the replay plays up to that time, as fast as it can, and a cycle longer if needed.
    """
    app = made.app
    assert app.replay is not None
    app.replay.clock.hold()
    if app.place != item.place:
        await made.pilot.press(DIGITS[item.place])
        await made.until(lambda: app.place == item.place)
    if goes_on:
        await made.pilot.pause(0.3)  # the screen begins to read
    else:
        await app._begin_again(app.replay, item.wall)  # as `@` does, to the microsecond
    assert app.replay is not None
    app.replay.clock.hold()
    await made.until(lambda: app.place == item.place)
    for late in (0.0, *LATE) if goes_on else (0.0,):
        await app.replay.run_to(item.wall + late)
        end = time.monotonic() + (10 if not goes_on else 1 if late else 3)
        while (now := rows_of(app)) != item.rows and time.monotonic() < end:
            await made.pilot.pause(0.05)
            app.screen.look()  # type: ignore[attr-defined]
        if now == item.rows:
            break
    return now


def opener(text: str, **_: object) -> OpenLine:
    return open_line(text)


@pytest.mark.sweep
@pytest.mark.parametrize(("seed", "goes_on"), [(0, False), (1, False), (1, True)])
async def test_screens_of_a_replay_show_what_they_showed_live(
    seed: int, *, goes_on: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DRIVEPANEL_RECORD", "off")
    record = tmp_path / "run.sqlite"
    was = await live(record, seed)
    # a read of all parameters has a pace of its own, which a seek does not have
    forward = [item for item in was if item.place != "parameters"]
    order = forward if goes_on else [*was, *random.Random(seed).sample(was, len(was))]
    assert goes_on or any(after.wall < before.wall for before, after in pairwise(order))
    different = []
    app = DrivePanelApp(open_line=opener, start=f"replay:{record}", device=1)
    async with app.run_test(size=(80, 24)) as pilot:
        made = Panel(app, pilot)
        await made.until(lambda: app.chosen is not None and app.chosen.latest is not None)
        for place, item in enumerate(order):
            now = await shown_at(made, item, goes_on=goes_on and place > 0)
            if now != item.rows:
                pairs = zip(item.rows, now, strict=False)
                rows = "\n  ".join(f"{a}\n  > {b}" for a, b in pairs if a != b)
                different.append(f"{item.place} at {item.wall % 1000:.1f}\n  {rows}")
    assert not different, "\n".join(different)


async def cycles(line: VirtualLine, since: float, seconds: float) -> list[list[str]]:
    """Open a panel on a line; return Monitor after each cycle of a time, then Control."""

    def opened(*_: object, **__: object) -> OpenLine:
        return OpenLine("x", line, devices=(1,))

    app = DrivePanelApp(open_line=opened, start="x", device=1, clock=line.time)
    found: list[list[str]] = []
    async with app.run_test(size=(80, 24)) as pilot:
        panel = LivePanel(Panel(app, pilot), line, 0)
        await panel.until(lambda: app.chosen is not None and app.chosen.latest is not None)
        await panel.go_on(since)
        end = line.time.monotonic() + seconds
        while line.time.monotonic() < end:
            await panel.settle()
            await pilot.pause()
            app.screen.look()  # type: ignore[attr-defined]
            found.append(rows_of(app))
        await panel.look("control")
        found.append(panel.moments[-1].rows)
    line.end_record()
    return found


def parts(rows: list[str]) -> list[str]:
    """Return each text of a screen, with the place of its row."""
    return [f"{at}: {part}" for at, row in enumerate(rows) for part in row.split()]


@pytest.mark.sweep
async def test_panel_on_a_ghost_shows_what_it_showed_on_the_running_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DRIVEPANEL_RECORD", "off")
    record = tmp_path / "run.sqlite"
    was = await cycles(VirtualLine(record, DriveSpec("atv71", 1, run_hz=30.0)), 5, 15)
    ghost = read_recorded(f"{record}@1")
    assert ghost.exchanges
    line = VirtualLine(tmp_path / "ghost.sqlite", ghost=ghost)
    again = await cycles(line, 8, 8)
    assert any("at reference" in row for row in was[0]), was[0]
    # a cycle on the ghost may have begun within a recorded one: its values are of two of them
    known = {part for rows in was for part in parts(rows)}
    assert sorted({part for rows in again for part in parts(rows)} - known) == []
    taken = {item.took for item in ghost.exchanges}
    own = {round(item.took, 6) for item in read_recorded(f"{tmp_path}/ghost.sqlite@1").exchanges}
    assert own <= {round(took, 6) for took in taken}
