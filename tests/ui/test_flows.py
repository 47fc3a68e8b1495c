"""The panel on simulated drives over a real line, driven by its keys."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence

import pytest
from rich.text import Text
from textual.app import App
from textual.pilot import Pilot
from textual.screen import ModalScreen
from textual.widgets import OptionList

from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.screens.blocks.screen import BlocksScreen
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.control.map_screen import MapScreen
from tui.screens.control.screen import ControlSourceScreen
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.dialogs.question import Question
from tui.screens.faults.screen import FaultsScreen
from tui.screens.frames.frame_list import FEW
from tui.screens.frames.heard import ListeningScreen
from tui.screens.frames.screen import FramesScreen
from tui.screens.keys.action import OPENING
from tui.screens.keys.help import HelpScreen
from tui.screens.keys.table import ACTIONS, EVERYWHERE
from tui.screens.messages.screen import MessagesScreen
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.opening import OpeningScreen
from tui.screens.parameters.screen import ParametersScreen
from tui.screens.startup.screen import StartUpScreen
from tui.screens.trend.screen import TrendScreen
from tui.screens.wiring.screen import WiringScreen
from tui.session.connect.open_line import OpenLine, demo_line
from tui.session.monitor.line_watch import LineWatch
from tui.widgets.lines import Lines

from .fakes import press

pytestmark = pytest.mark.long

DRIVES = {"atv21": 35.0, "atv71": 50.0, "powerdrive": 30.0}


def demo(*_: object, **__: object) -> OpenLine:
    return demo_line(DRIVES)


async def until(pilot: Pilot[None], holds: Callable[[], bool], seconds: float = 60.0) -> None:
    """Wait for a condition of the screen; a slow machine only waits longer."""
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, f"the screen did not get there:\n{picture(pilot.app)}"
        await pilot.pause(0.05)


async def arm(pilot: Pilot[None]) -> None:
    """Press the key that arms; a state that is not fresh is read first."""
    app = pilot.app
    assert isinstance(app, DrivePanelApp)
    await pilot.press("a")
    await until(pilot, lambda: app.chosen is not None and app.chosen.session.arming.armed)


def picture(app: App[None]) -> str:
    """The screen on top, as text."""
    return "\n".join(strip.text for strip in app.screen._compositor.render_strips())


def shown(app: DrivePanelApp, part: str) -> str:
    """The text of a part of the screen on top; nothing while it is being put together."""
    found = app.screen.query(f"#{part}").results(Lines)
    return "\n".join(line.plain for lines in found for line in lines.lines)


async def to_monitor(app: DrivePanelApp, pilot: Pilot[None], device: int) -> MonitorScreen:
    # a drive is listed once it has its profile; Enter before that opens no drive
    await until(pilot, lambda: app.connection.drives.option_count == len(DRIVES))
    drives = app.connection.query_one("#drives", OptionList)
    drives.focus()
    drives.highlighted = sorted(app.connection.found).index(device)
    await pilot.press("enter")
    await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
    screen = app.screen
    assert isinstance(screen, MonitorScreen)
    return screen


async def test_drive_is_selected_monitored_and_left() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await to_monitor(app, pilot, 2)
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        assert "MACHINE" in shown(app, "strip")
        await until(pilot, lambda: "Hz" in shown(app, "readouts"))
        assert screen.console.monitor.running
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, ConnectionScreen))
        await until(pilot, lambda: not screen.console.monitor.running)


@pytest.mark.sweep
async def test_keys_select_the_next_and_previous_drive() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        first = await to_monitor(app, pilot, 1)
        await pilot.press("right_square_bracket")
        await until(pilot, lambda: shown(app, "strip").startswith(" 2 "))
        assert not first.console.monitor.running
        # back on Line, Enter opens the drive that is open, not the one chosen there before
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, ConnectionScreen))
        assert app.connection.drives.chosen == 2
        await pilot.press("right_square_bracket")
        assert app.connection.drives.chosen == 3
        await pilot.press("left_square_bracket", "enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert app.chosen is not None
        assert app.chosen.device == 2
        await pilot.press("left_square_bracket")
        await until(pilot, lambda: shown(app, "strip").startswith(" 1 "))
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))


async def test_lost_line_is_shown_until_it_recovers() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await to_monitor(app, pilot, 2)
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        assert app.opened is not None
        assert app.opened.simulation is not None
        app.opened.simulation.unplug()
        await until(pilot, lambda: "LINE LOST" in shown(app, "said"))
        await until(pilot, lambda: "STATE UNKNOWN" in shown(app, "state"))
        app.opened.simulation.replug()
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))


async def test_drive_with_a_timeout_is_still_polled() -> None:
    """The Altivar 21 trips after 3 s without a request: once found, it is kept alive."""
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await to_monitor(app, pilot, 2)
        await asyncio.sleep(5.0)
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, ConnectionScreen))
        await pilot.pause(1.0)
        state = app.connection.drives.get_option_at_index(0).prompt
        assert "▶ FORWARD" in str(state)


async def test_frames_help_and_palette_open_and_close() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(120, 40)) as pilot:
        await to_monitor(app, pilot, 2)
        await pilot.press("7")
        await until(pilot, lambda: isinstance(app.screen, FramesScreen))
        await until(pilot, lambda: "→" in shown(app, "frames"))
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        await pilot.press("question_mark")
        await until(pilot, lambda: isinstance(app.screen, HelpScreen))
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        await pilot.press("ctrl+p")
        await until(pilot, lambda: isinstance(app.screen, ModalScreen))
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))


async def test_line_that_cannot_be_opened_shows_advice() -> None:
    app = DrivePanelApp()
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("n")
        await until(pilot, lambda: isinstance(app.screen, Ask))
        await pilot.press(*"tcp:127.0.0.1:9", "enter")
        await until(pilot, lambda: "cannot be reached" in shown(app, "message"))
        assert app.opened is None


async def test_percentage_becomes_amperes_once_the_rating_is_known() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await to_monitor(app, pilot, 1)
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        await press(pilot, "(rating)")
        await until(pilot, lambda: isinstance(app.screen, Ask))
        await pilot.press(*"3x", "enter", "backspace", *".3", "enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))

        def in_amperes() -> bool:
            return "┌ Current A ─" in shown(app, "readouts")

        await until(pilot, in_amperes)


def alone(line_watch: LineWatch) -> dict[int, float]:
    """Seconds after which drives react once polling stops, by device."""
    return {device: watch.timeout for device, watch in line_watch.pending_timeouts().items()}


async def test_leaving_a_drive_with_a_timeout_asks_first() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await to_monitor(app, pilot, 2)
        assert app.fleet is not None
        line_watch = app.fleet.line_watch
        await until(pilot, lambda: alone(line_watch) == {1: 3.0, 2: 10.0})
        await pilot.press("q")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert app.is_running
        await pilot.press("q", "y")
        await until(pilot, lambda: not app.is_running)


async def test_unknown_simulated_profile_is_reported() -> None:
    app = DrivePanelApp(start="sim:nothing")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "nothing" in shown(app, "message"))


async def test_line_and_device_arguments_open_monitor() -> None:
    app = DrivePanelApp(start="sim:atv71@2", device=2)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        await until(pilot, lambda: "press a, then r" in shown(app, "state"))


def test_every_action_has_a_method_and_a_text() -> None:
    screens = (
        ConnectionScreen,
        MonitorScreen,
        FramesScreen,
        ControlSourceScreen,
        MapScreen,
        FaultsScreen,
        ParametersScreen,
        BlocksScreen,
        MessagesScreen,
        WiringScreen,
        StartUpScreen,
        ListeningScreen,
        TrendScreen,
    )
    owners: dict[str, type] = {(screen.TITLE or "line").lower(): screen for screen in screens}
    owners[OPENING] = OpeningScreen
    for action in ACTIONS:
        name = f"action_{action.id.partition('(')[0]}"
        for screen in action.screens:
            owner = DrivePanelApp if action.app else owners[screen]
            assert hasattr(owner, name), (screen, name)
        assert action.help.endswith(".")
        assert set(action.screens) <= set(EVERYWHERE)


async def test_only_changed_rows_are_drawn() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await to_monitor(app, pilot, 2)
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        word = screen.query_one("#message", Lines)
        await pilot.pause(1.0)
        screen.look()
        before = word.redrawn
        screen.look()
        screen.look()
        assert word.redrawn == before


@pytest.mark.parametrize("size", kept([(80, 24), (120, 40)], (80, 24)))
async def test_selecting_another_bit_word_draws_that_alone(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=size) as pilot:
        screen = await to_monitor(app, pilot, 2)
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        monkeypatch.setattr(screen, "look_in_time", lambda: None)
        words, motor = screen.query_one("#curve", Lines), screen.query_one("#motor", Lines)
        before = words.lines
        motor.show([Text("as it was")])
        screen.action_next_word()
        assert words.lines != before
        assert [line.plain for line in motor.lines] == ["as it was"]


async def test_question_pauses_drawing_below_it_and_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tui.screens.monitor.screen.FROZEN_AFTER", 0.5)
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await to_monitor(app, pilot, 2)
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        state, motor = screen.query_one("#state", Lines), screen.query_one("#motor", Lines)
        await pilot.press("q")
        await until(pilot, lambda: isinstance(app.screen, Question))
        await pilot.pause()
        before, latest = motor.redrawn, screen.console.monitor.latest
        await until(pilot, lambda: any("as of" in line.plain for line in state.lines))
        # the drive is still monitored
        await until(pilot, lambda: screen.console.monitor.latest is not latest)
        assert motor.redrawn == before
        await pilot.press("escape")
        await until(pilot, lambda: "as of" not in shown(app, "state"))
        await until(pilot, lambda: motor.redrawn > before)


@pytest.mark.parametrize("size", kept([(80, 24), (120, 40)], (80, 24)))
async def test_selecting_the_next_word_moves_nothing_else(size: tuple[int, int]) -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=size) as pilot:
        screen = await to_monitor(app, pilot, 2)
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        await until(pilot, lambda: bool(shown(app, "curve").strip()))
        places = {widget.id: widget.region for widget in screen.query(Lines)}
        titles = {shown(app, "curve").split()[0]}
        for _ in range(3):
            await pilot.press("tab")
            titles.add(shown(app, "curve").split()[0])
            assert {widget.id: widget.region for widget in screen.query(Lines)} == places
        assert len(titles) > 1


async def test_curve_follows_the_first_values_in_its_own_output(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A slow link shows the state a second sooner."""
    drawn: list[tuple[str, str]] = []
    put = MonitorScreen.put

    def recorded(screen: MonitorScreen, place: str, lines: Sequence[Text]) -> None:
        drawn.append((place, " ".join(line.plain for line in lines).strip()))
        put(screen, place, lines)

    monkeypatch.setattr(MonitorScreen, "put", recorded)
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await to_monitor(app, pilot, 2)
        await until(pilot, lambda: bool(shown(app, "curve").strip()))
    with_values = next(at for at, drawing in enumerate(drawn) if " Hz" in drawing[1])
    curves = [text for place, text in drawn[with_values:] if place == "curve"]
    assert curves[0] == ""
    assert curves[1] != ""


async def test_polling_rate_is_shown() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await to_monitor(app, pilot, 2)
        screen.action_change_rate(1)
        await until(pilot, lambda: "polled 5.0 times a second" in shown(app, "said"))


async def test_slow_link_shows_few_frames_but_all_when_paused() -> None:
    app = DrivePanelApp(open_line=demo, start="demo", low_bandwidth=True)
    async with app.run_test(size=(80, 24)) as pilot:
        await to_monitor(app, pilot, 2)
        await pilot.press("7")
        await until(pilot, lambda: "h for all" in shown(app, "frames"))
        assert len(shown(app, "frames").splitlines()) == 1 + FEW
        await pilot.press("h")
        await until(pilot, lambda: len(shown(app, "frames").splitlines()) == 20)
