"""The panel with a drive named at the start: what stands first, and where it leads."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from tui.app import DrivePanelApp
from tui.bus.errors import PortMissing
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.opening import OpeningScreen
from tui.session.connect.open_line import OpenLine, demo_line
from tui.widgets.lines import Lines

from .test_flows import shown, until


class Held:
    """Opens a line once the test lets it."""

    def __init__(self, error: Exception | None = None) -> None:
        self._free = asyncio.Event()
        self._loop = asyncio.get_running_loop()
        self._error = error

    def open(self, *_: Any, **__: Any) -> OpenLine:
        asyncio.run_coroutine_threadsafe(self._free.wait(), self._loop).result()
        if self._error is not None:
            raise self._error
        return demo_line({"atv71": 50.0})

    def let(self) -> None:
        self._free.set()


async def test_monitor_stands_first_and_its_drive_takes_its_place() -> None:
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


@pytest.mark.parametrize("key", ["escape", "1"])
async def test_line_can_be_looked_at_meanwhile(key: str) -> None:
    held = Held()
    app = DrivePanelApp(open_line=held.open, start="demo", device=1)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, OpeningScreen))
        await pilot.press(key)
        await until(pilot, lambda: app.screen is app.connection)
        held.let()
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))


async def test_a_line_that_cannot_be_opened_says_why_on_line() -> None:
    held = Held(PortMissing("There is no /dev/ttyUSB9."))
    app = DrivePanelApp(open_line=held.open, start="/dev/ttyUSB9", device=1)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, OpeningScreen))
        held.let()
        await until(pilot, lambda: app.screen is app.connection)
        await until(pilot, lambda: "There is no /dev/ttyUSB9." in shown(app, "message"))


async def test_a_picture_while_the_panel_ends_draws_nothing(
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


async def test_a_drive_that_does_not_answer_says_so_on_line() -> None:
    held = Held()
    app = DrivePanelApp(open_line=held.open, start="demo", device=77)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, OpeningScreen))
        held.let()
        await until(pilot, lambda: app.screen is app.connection)
        await until(pilot, lambda: "No drive answered at address 77" in shown(app, "message"))
