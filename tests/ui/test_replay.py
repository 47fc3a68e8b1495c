"""The panel on a record: unmistakable on every screen, and it promises no stop for its drives."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from time import monotonic

import pytest
from textual.widgets import Input

from tests.session.test_replay import BEGIN, event, record, row
from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.drive.profile import library
from tui.screens.dialogs.ask import Ask
from tui.screens.keys.table import TABBED
from tui.screens.trend.screen import TrendScreen
from tui.session.connect.open_line import OpenLine, demo_line, open_line
from tui.session.journal import Journal
from tui.widgets.lines import Lines

from .test_frame import Panel
from .test_text_is_text import MARKUP

pytestmark = pytest.mark.long

LIVE = "sim:atv71@1"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A minute of an Altivar 71: its status, frequency and current once a second."""
    profile = library.load("atv71")
    codes = {"ETA": 0x0637, "ETI": 0x0812, "LFT": 0, "LCR": 84, "CHCF": 1, "FRH": 500}
    rows = []
    for at in range(60):
        for code, word in {**codes, "RFR": 100 + at}.items():
            rows.append(row(at, (word,), address=profile[code].address))
    notes = (event(0, "profile", '{"profile": "atv71"}', 1), event(40, "fault", "Tripped.", 1))
    return record(tmp_path, *rows, events=notes)


@asynccontextmanager
async def replaying(
    path: Path, at: int = 30, *, size: tuple[int, int] = (80, 24)
) -> AsyncIterator[Panel]:
    """The panel on a record, held at so many seconds from its begin."""

    def opener(text: str, **how: object) -> OpenLine:
        if text == LIVE:
            opened = demo_line({"atv71": 30.0})
            opened.text = text
            return opened
        return open_line(text)

    start = f"replay:{path},at={at_text(at)}"
    app = DrivePanelApp(open_line=opener, start=start, device=1)
    async with app.run_test(size=size) as pilot:
        made = Panel(app, pilot)
        await made.until(lambda: app.chosen is not None and not app.opening.goes_on)
        assert app.replay is not None
        app.replay.clock.hold()
        await made.until(lambda: app.chosen is not None and app.chosen.latest is not None)
        yield made


def at_text(at: float) -> str:
    from datetime import datetime

    return datetime.fromtimestamp(BEGIN + at).astimezone().isoformat()


async def test_every_screen_and_dialog_of_a_replay_is_marked(run: Path) -> None:
    async with replaying(run) as made:
        for screen in TABBED:
            await made.pilot.press(screen.digit)
            await made.until(lambda name=screen.name: made.app.place == name)  # type: ignore[misc]
            await made.until(lambda: "REPLAY" in made.shown("strip"))
            assert "nothing is sent" in made.shown("strip")
            await made.until(lambda: "no motor to stop" in made.shown("keys"))
            assert "STOP" not in made.shown("keys")
        for key in ("@", "ctrl+p", "?"):
            await made.pilot.press(key)
            await made.until(lambda: made.app.screen.is_modal or made.app.place == "help")
            await made.until(lambda: "REPLAY" in made.shown("strip"))
            await made.pilot.press("escape")
            await made.until(lambda: not made.app.screen.is_modal)


async def test_help_of_a_replay_promises_no_stop_of_its_drives(run: Path) -> None:
    async with replaying(run) as made:
        await made.pilot.press("?")
        await made.until(lambda: made.app.screen.is_modal)
        lines = made.app.screen.query("#help Lines").results(Lines)
        text = " ".join("\n".join(line.plain for each in lines for line in each.lines).split())
        assert "The drives of a replay are not there." in text
        assert "Stop the open drive" not in text
        assert "run forward" not in text.lower()


async def test_values_and_time_are_those_of_the_record(run: Path) -> None:
    began = monotonic()
    async with replaying(run, at=30) as made:
        console = made.app.chosen
        assert console is not None
        latest = console.latest
        assert latest is not None
        speed = latest.readings["RFR"]
        assert speed.raw == 100 + round(speed.time - BEGIN)
        assert "OTR" not in latest.readings or latest.readings["OTR"].raw is None
        # it was played until it was held
        assert -0.1 < made.app.clock.wall() - (BEGIN + 30) < monotonic() - began


async def test_stop_keys_stop_nothing_and_say_so(run: Path) -> None:
    async with replaying(run) as made:
        for key in ("space", "f9", "f12"):
            made.app.events.add("told", "before")
            await made.pilot.press(key)
            await made.until(lambda: "this is a replay" in newest(made).lower())
        for key in ("k", "e"):
            await made.pilot.press(key)
            await made.until(lambda: "this is a replay" in newest(made).lower())
        assert not made.app.fleet.stopper.reports  # type: ignore[union-attr]


async def test_arming_and_commands_are_refused_with_the_reason(run: Path) -> None:
    async with replaying(run) as made:
        for key in ("a", "r", "v", "f", "x", "t", "z", "up", "S", "N", "H"):
            made.app.events.add("told", "before")
            await made.pilot.press(key)
            await made.until(lambda: "replay: nothing is sent" in newest(made))
            assert not made.app.chosen.session.arming.armed  # type: ignore[union-attr]
        assert made.app.journal.recent == ()


async def test_a_trip_in_a_replay_is_not_written_to_the_journal(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    added: list[object] = []
    monkeypatch.setattr(Journal, "add", lambda self, entry, **_: added.append(entry))
    async with replaying(run, at=50) as made:
        made.app.look_around()
        assert added == []


async def test_seek_back_and_forward_shows_the_state_of_then(run: Path) -> None:
    async with replaying(run, at=50) as made:
        app = made.app

        def frequency() -> int | None:
            latest = app.chosen.latest if app.chosen else None
            return latest.readings["RFR"].raw if latest and "RFR" in latest.readings else None

        def shows(at: float) -> bool:
            found = frequency()
            return found is not None and abs(found - 100 - at) <= 1.1

        begun = app.clock.monotonic() - BEGIN  # the replay may have played for a moment
        await made.until(lambda: shows(begun))
        assert app.replay is not None
        app.replay.clock.set_speed(5.0)
        await made.pilot.press("comma", "comma")
        await made.until(lambda: shows(begun - 10))
        assert (app.replay.clock.speed, app.replay.clock.playing) == (5.0, False)
        assert abs(app.clock.monotonic() - BEGIN - (begun - 10)) < 0.1
        await made.pilot.press(";")
        await made.until(lambda: shows(begun - 5))
        assert app.place == "monitor"
        await made.pilot.press("$")
        await made.until(lambda: shows(38))


async def test_monitor_reads_on_after_trend_was_opened_from_line(run: Path) -> None:
    async with replaying(run, at=50) as made:
        monitor = made.app.chosen.monitor if made.app.chosen else None
        assert monitor is not None
        for key, place in (("1", "line"), ("8", "trend"), ("2", "monitor")):
            await made.pilot.press(key)
            await made.until(lambda place=place: made.app.place == place)  # type: ignore[misc]
            await made.pilot.pause()
        assert monitor.started


async def test_marks_of_trend_stay_when_a_replay_goes_to_another_time(run: Path) -> None:
    async with replaying(run, at=50) as made:
        await made.pilot.press("8")
        await made.until(lambda: made.app.place == "trend")
        before = made.app.screen
        assert isinstance(before, TrendScreen)
        await made.pilot.press("M")
        await made.pilot.press(">")
        marked = before.page.mark_a
        assert marked is not None
        await made.pilot.press("comma")
        await made.until(lambda: made.app.place == "trend" and made.app.screen is not before)
        after = made.app.screen
        assert isinstance(after, TrendScreen)
        assert (after.page.mark_a, after.page.step) == (marked, before.page.step)
        assert not after.page.held


async def test_hold_and_speed_keys(run: Path) -> None:
    async with replaying(run) as made:
        clock = made.app.replay.clock  # type: ignore[union-attr]
        await made.pilot.press("}")
        assert clock.speed == 2.0
        await made.pilot.press("0")
        assert clock.playing
        await made.until(lambda: clock.monotonic() > BEGIN + 31)
        await made.pilot.press("0")
        assert not clock.playing
        await made.until(lambda: "HELD" in made.shown("strip"))


@pytest.mark.parametrize("key", kept(["space", "f9", "f12"], "space"))
async def test_live_line_beside_a_replay_is_stopped_by_its_keys(run: Path, key: str) -> None:
    async with replaying(run) as made:
        app = made.app
        replay = app.panel_lines[0]
        await app.connect(LIVE, remember=False)
        simulation = app.panel_lines[1].opened.simulation
        assert simulation is not None
        app.connection.scan([1])
        await made.until(lambda: bool(app.panel_lines[1].fleet.sessions))
        await made.until(lambda: simulation.drive(1).motor.frequency > 1)
        app.show_line(replay)
        console = replay.fleet.console(1)
        assert console is not None
        app.show_monitor(console)
        await made.until(lambda: "Space STOP LIVE ALL" in made.shown("keys"))
        await made.until(lambda: "REPLAY" in made.shown("strip"))
        await made.pilot.press(key)
        await made.until(lambda: simulation.drive(1).motor.frequency == 0)
        assert any("live lines" in item.text for item in app.events.events)


async def test_replay_beside_a_live_line_can_be_shown_again(run: Path) -> None:
    async with replaying(run) as made:
        app = made.app
        replay = app.panel_lines[0]
        await app.connect(LIVE, remember=False)
        await made.pilot.press("1")
        await made.until(lambda: app.place == "line")
        await made.until(lambda: "REPLAY" not in made.shown("strip"))
        listed = app.connection.lines
        listed.offer(LIVE)
        listed.fill(app.line_text, app.open_texts)
        texts = [choice.text for choice in listed._choices.values()]
        assert texts.count(replay.opened.text) == 1


def newest(made: Panel) -> str:
    event = made.app.events.newest
    return event.text if event is not None else ""


async def test_markup_is_no_time_of_a_replay(run: Path) -> None:
    async with replaying(run) as made:
        assert made.app.replay is not None
        at = made.app.replay.clock.monotonic()
        for text in MARKUP:
            await made.pilot.press("@")
            await made.until(lambda: isinstance(made.app.screen, Ask))
            field = made.app.focused
            assert isinstance(field, Input)
            field.value = text
            await made.pilot.press("enter", "escape")
            await made.until(lambda: not isinstance(made.app.screen, Ask))
        assert made.app.replay.clock.monotonic() == at


async def test_trip_that_no_program_reported_is_an_event_to_go_to(tmp_path: Path) -> None:
    profile = library.load("atv71")
    rows = [
        row(at, (word,), address=profile[code].address)
        for at in range(60)
        for code, word in (("ETA", 0x0637 if at < 40 else 0x0218), ("LFT", 0 if at < 41 else 9))
    ]
    about = '{"profile": "atv71", "hash": ""}'
    path = record(tmp_path, *rows, events=(event(0, "profile", about, 1),))
    async with replaying(path, 10) as made:
        replay = made.app.replay
        assert replay is not None
        await made.until(lambda: bool(replay.events))
        (found,) = replay.events
        assert (found.utc, found.text) == (round((BEGIN + 40) * 1e6), "Tripped on OCF Overcurrent.")
        await made.pilot.press("#")
        await made.until(lambda: abs(made.app.clock.monotonic() - BEGIN - 38) < 0.5)
