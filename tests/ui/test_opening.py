"""The panel with a drive named at the start: its first screen, and the next ones."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from types import MappingProxyType
from typing import Any

import pytest
from textual.events import Key
from textual.pilot import Pilot
from textual.widgets import Input

from tui.app import DrivePanelApp
from tui.bus.errors import PortMissing
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.dialogs.confirm import Confirm
from tui.screens.keys.help import HelpScreen
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.opening import OpeningScreen
from tui.session.connect.open_line import OpenLine, demo_line
from tui.session.paths import remember_line
from tui.terminal.stroke import Stroke, attach
from tui.widgets.lines import Lines

from .test_flows import shown, until

pytestmark = pytest.mark.long

ONE = {"atv71": 50.0}


class Held:
    """Opens a line once the test lets it."""

    def __init__(
        self, error: Exception | None = None, line: Mapping[str, float] = MappingProxyType(ONE)
    ) -> None:
        self._free = asyncio.Event()
        self._loop = asyncio.get_running_loop()
        self._error = error
        self._line = line
        self.opened: list[str] = []
        self.lines: list[OpenLine] = []

    def open(self, text: str, **_: Any) -> OpenLine:
        self.opened.append(text)
        asyncio.run_coroutine_threadsafe(self._free.wait(), self._loop).result()
        if self._error is not None:
            raise self._error
        opened = demo_line(dict(self._line))
        opened.text = text if text != "demo" else opened.text
        self.lines.append(opened)
        return opened

    @property
    def closed(self) -> int:
        """Count the opened lines that are closed again."""
        return sum(line.line.state.status.value == "closed" for line in self.lines)

    def let(self) -> None:
        self._free.set()

    def hold(self) -> None:
        self._free.clear()


def newest(app: DrivePanelApp) -> str:
    """The newest message."""
    event = app.events.newest
    return event.text if event is not None else ""


async def test_monitor_opens_first_and_then_shows_its_drive() -> None:
    held, seen = Held(), []
    app = DrivePanelApp(
        open_line=held.open,
        start="demo",
        device=1,
        on_shown=lambda: seen.append(type(app.screen)),
    )
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: bool(seen))
        assert seen == [OpeningScreen]
        assert app.place == "monitor"
        doing = app.screen.query_one("#doing", Lines)
        assert "Drive 1 on demo" in doing.lines[1].plain
        await pilot.press("a", "r", "enter", "y")
        assert app.place == "monitor"
        held.let()
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        assert len(app.screen_stack) == 2, "Esc goes to Line"


async def test_escape_while_opening_a_named_drive_shows_line() -> None:
    held = Held()
    app = DrivePanelApp(open_line=held.open, start="demo", device=1)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, OpeningScreen))
        await pilot.press("1")  # leads nowhere while a line opens
        assert app.place == "monitor"
        await until(pilot, lambda: "keys are ignored" in newest(app))
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is app.connection)
        await until(pilot, lambda: "Opening demo was canceled." in shown(app, "message"))
        held.let()
        await until(pilot, lambda: held.closed == 1)
        assert not app.panel_lines
        assert app.screen is app.connection


def remember_others() -> None:
    """Lines of earlier days, which may be real ones, and are above those that are simulated."""
    for text in ("tcp:192.168.0.3:502", "tcp:192.168.0.4:502", "tcp:192.168.0.5:502"):
        remember_line(text)


async def begin_demo(app: DrivePanelApp, pilot: Pilot[None]) -> None:
    """It was named when the panel was started."""


async def begin_by_enter(app: DrivePanelApp, pilot: Pilot[None]) -> None:
    app.connection.lines.offer("demo")
    await pilot.press("enter")


async def begin_by_typing(app: DrivePanelApp, pilot: Pilot[None]) -> None:
    await pilot.press("n", "ctrl+u", *"sim:atv21", "enter")


async def begin_by_following(app: DrivePanelApp, pilot: Pilot[None]) -> None:
    app.follow("demo", 1)


WAYS = {
    "named at the start": begin_demo,
    "Enter in the list": begin_by_enter,
    "typed": begin_by_typing,
    "where a drive answers now": begin_by_following,
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
async def test_keys_typed_while_a_line_opens_are_ignored_and_reported(
    way: Callable[[DrivePanelApp, Pilot[None]], Awaitable[None]],
) -> None:
    """The tour's own keys opened another line, which may be a real one, without a question."""
    remember_others()
    held = Held()
    app = DrivePanelApp(open_line=held.open, start="demo" if way is begin_demo else None)
    async with app.run_test(size=(80, 24)) as pilot:
        await way(app, pilot)
        await until(pilot, lambda: len(held.opened) == 1)
        at = app.connection.lines.highlighted
        for key in ("down", "down", "down", "enter", "n", "s", "H", "q", "ctrl+p", "4", "x"):
            await pilot.press(key)
            assert app.screen is app.connection
            assert "keys are ignored until it is open. Press Esc to cancel." in newest(app)
            app.events.add("told", "the next key")
        assert app.connection.lines.highlighted == at
        await until(pilot, lambda: "Esc cancel" in shown(app, "keys"))
        assert "Enter" not in shown(app, "keys")
        await pilot.press("question_mark")
        await until(pilot, lambda: isinstance(app.screen, HelpScreen))
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is app.connection)
        held.let()
        await until(pilot, lambda: bool(app.panel_lines) and bool(app.connection.found))
        assert len(held.opened) == 1
        await until(pilot, lambda: not app.opening.goes_on)
        await until(pilot, lambda: "Esc cancel" not in shown(app, "keys"))


async def test_tour_keys_typed_too_early_open_no_line_and_work_later() -> None:
    remember_others()
    held = Held(line={"atv21": 20.0, "atv31": 25.0, "atv312": 30.0, "atv71": 50.0})
    app = DrivePanelApp(open_line=held.open, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: held.opened == ["demo"])
        await pilot.press("down", "down", "down", "enter")
        held.let()
        await until(pilot, lambda: app.connection.drives.option_count == 4)
        await until(pilot, lambda: app.connection.drives.has_focus)
        await pilot.press("down", "down", "down", "enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert app.chosen is not None
        assert app.chosen.device == 4
        assert held.opened == ["demo"]


async def test_key_read_while_a_line_opens_is_ignored_even_if_handled_later() -> None:
    held = Held()
    held.let()
    app = DrivePanelApp(open_line=held.open, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: bool(app.connection.found))
        await until(pilot, lambda: app.connection.drives.has_focus)
        late = Key("enter", "\r")
        read_at = app.opening.ended - 0.1
        attach(late, Stroke(read_at, app.stop_stamp()))
        await app.on_event(late)
        await until(pilot, lambda: "it was typed while demo was being opened" in newest(app))
        assert app.screen is app.connection
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))


async def test_escape_cancels_opening_and_another_line_can_be_opened() -> None:
    held = Held()
    app = DrivePanelApp(open_line=held.open, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: held.opened == ["demo"])
        await pilot.press("escape")
        await until(pilot, lambda: "Opening demo was canceled." in shown(app, "message"))
        app.connection.open_line("sim:atv21")
        await until(pilot, lambda: len(held.opened) == 2)
        held.let()
        await until(pilot, lambda: bool(app.connection.found))
        await until(pilot, lambda: held.closed == 1)
        assert len(app.panel_lines) == 1


async def test_stops_work_while_a_second_line_opens() -> None:
    held = Held()
    held.let()
    app = DrivePanelApp(open_line=held.open, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: bool(app.connection.found))
        assert app.opened is not None
        first = app.opened.simulation
        assert first is not None
        await until(pilot, lambda: first.drive(1).motor.frequency > 0)
        held.hold()
        app.connection.open_line("sim:atv21")
        await until(pilot, lambda: len(held.opened) == 2)
        # in a field where a space is text: nothing is typed while a line opens
        field = app.connection.query_one("#profile", Input)
        field.focus()
        await pilot.pause()
        await pilot.press("space", "x")
        await until(pilot, lambda: first.drive(1).motor.frequency == 0)
        assert app.take_stop_key("space")
        assert field.value in ("", "identify")
        held.let()
        await until(pilot, lambda: len(app.panel_lines) == 2)


async def test_enter_on_another_line_asks_during_the_scan(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Keys of the tour that come between the opening and the first drive."""
    for place in ("line_form", "line_keys"):
        monkeypatch.setattr(f"tui.screens.connection.{place}.ADDRESSES", "100-247")
    monkeypatch.setattr(ConnectionScreen, "_addresses_here", lambda _: "100-247")
    remember_others()
    held = Held()
    held.let()
    app = DrivePanelApp(open_line=held.open, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.connection.scanning)
        app.connection.lines.offer("tcp:192.168.0.4:502")
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is app.connection)
        assert held.opened == ["demo"]
        assert app.panel_lines


async def test_line_that_cannot_be_opened_shows_the_reason() -> None:
    held = Held(PortMissing("There is no /dev/ttyUSB9."))
    app = DrivePanelApp(open_line=held.open, start="/dev/ttyUSB9", device=1)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, OpeningScreen))
        held.let()
        await until(pilot, lambda: app.screen is app.connection)
        await until(pilot, lambda: "There is no /dev/ttyUSB9." in shown(app, "message"))


async def test_screenshot_while_the_panel_exits_draws_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app = DrivePanelApp(open_line=Held().open)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.screen is app.connection)
        drawn: list[bool] = []
        with monkeypatch.context() as ending:
            ending.setattr(DrivePanelApp, "is_running", False)
            ending.setattr(app.connection, "show_drives", lambda: drawn.append(True))
            app.connection._redraw()
        assert not drawn


async def test_drive_that_does_not_answer_is_reported_on_line() -> None:
    held = Held()
    app = DrivePanelApp(open_line=held.open, start="demo", device=77)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, OpeningScreen))
        held.let()
        await until(pilot, lambda: app.screen is app.connection)
        await until(pilot, lambda: "No drive answered at address 77" in shown(app, "message"))
