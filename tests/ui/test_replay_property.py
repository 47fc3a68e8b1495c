"""At any time of a replay, the screens show what they showed live.

The time of the live panel is controlled, so that a minute takes seconds. Screens, times and the
order of the seeks are random. What differs for a reason is left out, see `LEFT_OUT`.
"""

from __future__ import annotations

import asyncio
import random
import re
import time
from collections.abc import Callable, Sequence
from itertools import pairwise, zip_longest
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.session.virtual_line import VirtualLine
from tui.app import DrivePanelApp
from tui.bus.model import LineStatus
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.trend.screen import TrendScreen
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.events import EventLog
from tui.session.monitor.trend import TrendPoint
from tui.session.record.ghost import read_recorded
from tui.simulator import DriveSpec

from .test_frame import Panel

DIGITS = {
    "line": "1", "monitor": "2", "values": "2", "parameters": "3", "faults": "5", "control": "6",
    "trend": "8",
}  # fmt: skip
ALL = tuple(DIGITS)
RESET = bytes.fromhex("0621350080")
LEFT_OUT: dict[str, tuple[str, ...]] = {
    # a replay has no other lines, and searches for no drives; the curve, see `curves_differ`
    "line": (r"^ +Lines .*", r"scan done.*", r"[⠀-⣿]+ ?"),
    # keys that a replay refuses: to run a motor; and the curve
    "monitor": (
        r"─* (press a, then r|standby)(?= ┐)", r" +\d+ s(?= │)",
        r"^ *[\d.]* *[┤│└]([^─]| ·|─┬|─ ).*", r"^ +(\d\d:){2}.*", r"(?<=reference)  [^<]*(?=<)",
    ),
    # of the reads for other screens, a replay knows the registers between those that were wanted
    "parameters": (r"reading \d+ of \d+",),
    # A key that a replay refuses: to reset a fault. The curve before the trip ends where Monitor
    # was closed, which is not recorded. Ages change the room for names.
    "faults": (
        r"(?s)\n  x {2}.*?(?=\n +History|\Z)", r" *[\d.]* *[┤│└├](?![^\n]*│).*$",
        r"(?<=^  [A-Z0-9]{3}) +[^ ].*?(?=  )", r"(?<=^  [A-Z0-9]{4}) +[^ ].*?(?=  )", r"─+",
    ),
}  # fmt: skip
OF_SILENT: dict[str, str] = {
    # What a drive has stored has no age, so a screen shows only what it has read itself. A seek
    # opens Faults again, and a silent drive cannot be read. Faults reads each 2 s of real time, so
    # whether it shows its last read or one of Monitor with its age is not sure.
    "faults": r"^History .*|~|, \d+s old",
}
SAME_POINT, SAME_CHECK = 1.6, 3.2
"""Seconds between a point of a live curve and one of its replay with the same values: cycles. The
first cycle after a change of screens has no pause before it. A check of a lost line is not
recorded, so its mark may be a check earlier or later. A reference is marked after two points with
another one, so not surely after a loss. What else was read between two checks may be
a point, too, with values of one of them."""
BEGUN_WITHIN = 2.0
"""Seconds in which the panel began: identification, checks and cycles without a pause."""


class Moment(NamedTuple):
    """A screen that was opened at a time of day, and what it showed at another one."""

    opened: float
    wall: float
    place: str
    rows: list[str]
    trend: tuple[TrendPoint, ...]
    silent: bool
    """True if the drive did not answer, or its line was lost."""


class RecordedFiles:
    """The recorder of a line, for Trend."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def files(self) -> list[Path]:
        return [self.path]

    def close(self) -> bool:
        return True


def rows_of(app: DrivePanelApp) -> list[str]:
    """The rows of the screen without its frame: a replay marks that, and has its own messages."""
    strips = app.screen._compositor.render_strips()
    rows = ["".join(part.text for part in strip).rstrip() for strip in strips]
    below = 1 + app.screen.message_rows  # type: ignore[attr-defined]
    text = "\n".join(rows[2:-below])
    for pattern in LEFT_OUT.get(app.place, ()):
        text = re.sub(pattern, "", text, flags=re.MULTILINE)
    return [" ".join(row.split()) for row in text.splitlines() if row.strip()]


def without_stored(item: Moment, rows: list[str]) -> list[str]:
    """Return rows without what depends on the screens that were opened before; see OF_SILENT."""
    pattern = OF_SILENT.get(item.place, "") if item.silent else ""
    return [re.sub(pattern, "", row) for row in rows] if pattern else rows


def is_shown(app: DrivePanelApp, place: str) -> bool:
    return app.place == {"values": "monitor"}.get(place, place)


async def show(made: Panel, place: str) -> None:
    """Go to a screen; on Monitor to its curve, or to the table of all values."""
    app = made.app
    if not is_shown(app, place):
        await made.pilot.press(DIGITS[place])
        await made.until(lambda: is_shown(app, place))
    for _ in range(9):
        if not isinstance(app.screen, MonitorScreen):
            break
        if app.screen._word == {"values": 0}.get(place):
            break
        await made.pilot.press("tab")


class LivePanel:
    """A panel on a line whose time the test lets go on."""

    def __init__(self, made: Panel, line: VirtualLine, seed: int) -> None:
        self.made, self.app, self.line = made, made.app, line
        self.chance = random.Random(seed)
        self.moments: list[Moment] = []
        self.answers = True
        """False while the drive does not answer, or the line is lost."""

    async def until(self, holds: Callable[[], object]) -> None:
        end = time.monotonic() + 30
        while not holds():
            assert time.monotonic() < end, rows_of(self.app)
            await self.made.pilot.pause(0.01)
            await self.line.pass_time(0.02)

    async def go_on(self, seconds: float) -> None:
        end = self.line.time.monotonic() + seconds
        while (rest := end - self.line.time.monotonic()) > 0.001:
            self.heat()
            await self.line.pass_time(min(rest, 0.1))
            await asyncio.sleep(0.001)

    def heat(self) -> None:
        """Change a value of the slow rate, so that the time of its read shows."""
        for drive in self.line.simulation.drives:
            drive.set("THR", round(self.line.time.wall()) % 100)

    async def look(self, *places: str) -> None:
        """Look at each screen for a while."""
        for place in places:
            opened = self.line.time.wall()
            await show(self.made, place)
            for _ in range(10):
                await self.made.pilot.pause(0.01)
                await self.go_on(0.1)
            await self.go_on(self.chance.uniform(0.5, 3))
            if isinstance(self.app.screen, TrendScreen):
                await self.load(self.app.screen)
            await self.settle()
            while any(work.group == "faults" for work in self.app.workers):
                await self.made.pilot.pause(0.01)  # Faults shows what it reads once it has all
                await self.go_on(0.01)
                await self.settle()
            self.app.screen.look()  # type: ignore[attr-defined]
            await self.made.pilot.pause(0.05)
            rows = rows_of(self.app)
            now, trend = self.line.time.wall(), self.app.chosen.monitor.trend  # type: ignore[union-attr]
            self.moments.append(Moment(opened, now, place, rows, trend, not self.answers))
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

    async def load(self, screen: TrendScreen) -> None:
        """Have Trend read the record now, and not at some real time."""
        await self.go_on(0.1)
        screen._load()
        await self.until(lambda: not screen._loading)

    def some(self, places: tuple[str, ...], count: int) -> list[str]:
        return self.chance.sample(places, count)


async def live(record: Path, seed: int) -> list[Moment]:
    """A drive that runs, trips, stops answering, loses its line, and is reset."""
    line = VirtualLine(record, DriveSpec("atv71", 1, run_hz=30.0, wander=True))
    line.simulation.drive(1).set("ULN", 2310)  # read with others more often than it is shown

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
        await panel.look("values", *panel.some(ALL, 4), "monitor")
        line.silence(1)
        panel.answers = False
        await panel.look("monitor", *panel.some(ALL, 3))
        line.silence(1, False)
        await panel.go_on(4)
        panel.answers = True
        await panel.look(*panel.some(ALL, 2))
        line.become(LineStatus.LOST, "The adapter is unplugged.")
        panel.answers = False
        await panel.look(*panel.some(ALL, 1))
        line.become(LineStatus.CONNECTED)
        await panel.go_on(4)
        panel.answers = True
        line.simulation.line.ask(1, RESET)
        await panel.look("monitor", *panel.some(ALL, 3))
        await panel.go_on(4)  # so that the record ends later
    line.end_record()
    return panel.moments


async def shown_at(made: Panel, item: Moment, *, goes_on: bool = False) -> list[str]:
    """Go to a time on a screen of the replay; return its rows once they are the same, or later.

    `goes_on`: the replay plays up to that time, as fast as it can.
    """
    app = made.app
    assert app.replay is not None
    app.replay.clock.hold()
    if goes_on:
        await app.replay.run_to(item.opened)
    await show(made, item.place)
    if goes_on:
        await made.pilot.pause(0.3)  # the screen begins to read
    else:
        await app._begin_again(app.replay, item.wall)  # as `@` does, to the microsecond
    assert app.replay is not None
    app.replay.clock.hold()
    await made.until(lambda: is_shown(app, item.place))
    await show(made, item.place)
    await app.replay.run_to(item.wall)
    end = time.monotonic() + 6
    while (now := rows_of(app)) != item.rows and time.monotonic() < end:
        await made.pilot.pause(0.05)
        app.screen.look()  # type: ignore[attr-defined]
    assert app.chosen is not None
    return [*now, *curves_differ(item.trend, app.chosen.monitor.trend)]


def curves_differ(live: Sequence[TrendPoint], again: Sequence[TrendPoint]) -> list[str]:
    """Return the points of a live curve that its replay lacks, and the other way round.

    The pictures of curves differ by a dot if the end of a cycle is not sure.
    """

    def lacks(point: TrendPoint, others: Sequence[TrendPoint], *, extra: bool) -> bool:
        if point.time < live[0].time + BEGUN_WITHIN or all(value is None for value in point.values):
            return False
        within = SAME_CHECK if extra else SAME_POINT
        near = [other for other in others if abs(other.time - point.time) <= within]
        return all(other.values != point.values for other in near)

    def marked(points: Sequence[TrendPoint]) -> list[tuple[str, float]]:
        begun = live[0].time + BEGUN_WITHIN
        failed = [point.time for point in points if all(value is None for value in point.values)]
        return [
            (point.mark, point.time)
            for point in points
            if point.mark
            and point.time > begun
            and not (point.mark == "reference" and any(0 < point.time - at < 6 for at in failed))
        ]

    found = [f"not in the replay: {point}" for point in live if lacks(point, again, extra=False)]
    found += [f"in the replay only: {point}" for point in again if lacks(point, live, extra=True)]
    was, now = marked(live), marked(again)
    same = [mark for mark, _ in was] == [mark for mark, _ in now] and all(
        abs(begun - again_at) <= SAME_CHECK
        for (_, begun), (_, again_at) in zip(was, now, strict=True)
    )
    return found if same else [*found, f"marks: {was}", f"> {now}"]


def opener(text: str, **_: object) -> OpenLine:
    return open_line(text)


@pytest.mark.sweep
@pytest.mark.parametrize(
    ("seed", "goes_on"),
    [(0, False), (1, False), (1, True), (4, False)],
)
async def test_screens_of_a_replay_show_what_they_showed_live(
    seed: int, *, goes_on: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DRIVEPANEL_RECORD", "off")
    record = tmp_path / "run.sqlite"
    was = await live(record, seed)
    order = was if goes_on else [*was, *random.Random(seed).sample(was, len(was))]
    assert goes_on or any(after.wall < before.wall for before, after in pairwise(order))
    different = []
    app = DrivePanelApp(open_line=opener, start=f"replay:{record}", device=1)
    app.events = EventLog(lambda: 0.0)  # old messages have one row
    async with app.run_test(size=(80, 24)) as pilot:
        made = Panel(app, pilot)
        await made.until(lambda: app.chosen is not None and app.chosen.latest is not None)
        for place, item in enumerate(order):
            now = await shown_at(made, item, goes_on=goes_on and place > 0)
            if without_stored(item, now) != without_stored(item, item.rows):
                pairs = zip_longest(item.rows, now, fillvalue="")
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
