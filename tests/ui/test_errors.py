"""The panel after unforeseen errors, and events that come too late."""

from __future__ import annotations

import asyncio
import threading
import time
from typing import Any

import pytest
from textual.events import Key

from tui.app import DrivePanelApp
from tui.bus.errors import PortBusy
from tui.screens.dialogs.confirm import Confirm
from tui.session.connect.open_line import OpenLine, demo_line
from tui.widgets.lines import Lines

from . import fakes
from .test_flows import alone, until


class Opener:
    """Opens fake lines; the one called `slow` only on release."""

    def __init__(self) -> None:
        self.let = threading.Event()
        self.closed: list[str] = []
        self.opened: list[str] = []

    def __call__(self, text: str, **_: Any) -> OpenLine:
        if text == "tcp:slow":
            assert self.let.wait(30)
        self.opened.append(text)
        opened = fakes.opened()
        opened.text = text
        opened.line.close = lambda: self.closed.append(text)  # type: ignore[method-assign]
        return opened


def message(app: DrivePanelApp) -> str:
    lines = (line.plain for line in app.connection.query_one("#message", Lines).lines)
    return " ".join(" ".join(lines).split())


@pytest.mark.internal_errors
async def test_unforeseen_error_is_one_line_and_the_panel_continues() -> None:
    def broken(*_: Any, **__: Any) -> OpenLine:
        raise RuntimeError("the register of lines is upside down")

    app = DrivePanelApp(open_line=broken, start="tcp:anything")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "upside down" in message(app))
        assert "Internal error" in message(app)
        await pilot.press("question_mark", "escape")
        assert app.screen is app.connection


async def test_enter_retries_a_line_that_could_not_be_opened(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried: list[str] = []

    def busy(text: str, **_: Any) -> OpenLine:
        tried.append(text)
        raise PortBusy("The port is in use by another program.")

    ports = [("/dev/ttyUSB0", "")]
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", lambda: list(ports))
    app = DrivePanelApp(open_line=busy, start="tcp:elsewhere")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "in use" in message(app))
        await pilot.press("enter")
        await until(pilot, lambda: len(tried) == 2)
        # a port that comes and goes moves the list, and not the cursor from its line
        ports.insert(0, ("/dev/ttyUSB9", ""))
        await fakes.press(pilot, "(refresh_lines)")
        await pilot.press("enter")
        await until(pilot, lambda: len(tried) == 3)
        ports.clear()
        await fakes.press(pilot, "(refresh_lines)")
        await pilot.press("enter")
        await until(pilot, lambda: len(tried) == 4)
    assert set(tried) == {"tcp:elsewhere"}


async def test_enter_on_a_port_retries_that_port(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []

    def busy(text: str, **_: Any) -> OpenLine:
        tried.append(text)
        raise PortBusy("The port is in use by another program.")

    monkeypatch.setattr(
        "tui.session.connect.open_line.serial_ports", lambda: [("/dev/ttyUSB0", "")]
    )
    app = DrivePanelApp(open_line=busy)
    async with app.run_test(size=(80, 24)) as pilot:
        for count in (1, 2, 3):
            await pilot.press("enter")
            await until(pilot, lambda count=count: len(tried) == count)  # type: ignore[misc]
    assert set(tried) == {"serial:/dev/ttyUSB0,19200,8E1"}


async def test_line_that_opens_after_another_was_selected_is_closed() -> None:
    opener = Opener()
    app = DrivePanelApp(open_line=opener, start="tcp:slow")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.pause(0.2)
        await pilot.press("escape")
        app.connection.open_line("tcp:other")
        await until(pilot, lambda: app.line_text == "tcp:other")
        opener.let.set()
        await until(pilot, lambda: "tcp:slow" in opener.closed)
        assert app.line_text == "tcp:other"
        assert opener.closed == ["tcp:slow"]
    assert opener.closed == ["tcp:slow", "tcp:other"]


async def test_line_that_opens_after_the_panel_exited_is_closed() -> None:
    opener = Opener()
    app = DrivePanelApp(open_line=opener, start="tcp:slow")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.pause(0.2)
        app.leave_now()  # by a signal; q is ignored until the line is open
    opener.let.set()
    end = time.monotonic() + 60
    while opener.closed != ["tcp:slow"]:
        assert time.monotonic() < end
        await asyncio.sleep(0.05)


@pytest.mark.internal_errors
async def test_internal_error_prints_one_line_without_a_traceback(
    capsys: pytest.CaptureFixture[str],
) -> None:
    app = DrivePanelApp(open_line=Opener())

    def fail() -> None:
        raise RuntimeError("a screw is loose")

    async def run() -> None:
        async with app.run_test(size=(80, 24)) as pilot:
            app.call_later(fail)
            await pilot.pause(0.5)

    with pytest.raises(RuntimeError, match="a screw is loose"):
        await run()
    output = capsys.readouterr()
    assert "Traceback" not in output.out + output.err
    assert "The panel had to stop" in output.err
    assert app.return_code == 1


@pytest.mark.parametrize("size", [(20, 5), (40, 12), (79, 23), (200, 60)])
async def test_screens_survive_every_terminal_size(size: tuple[int, int]) -> None:
    from tui.drive.profile import library
    from tui.screens.monitor.screen import MonitorScreen

    app = fakes.app_of()
    app.opened = fakes.opened()
    async with app.run_test(size=size) as pilot:
        snapshot = fakes.snapshot_of(library.load("atv71"), fakes.FAULT)
        console = fakes.console_of(snapshot)
        fakes.choose(app, console)
        await app.push_screen(MonitorScreen(console))
        await pilot.pause(0.4)
        await pilot.press("tab", "7", "escape", "question_mark", "escape")
        await pilot.resize_terminal(80, 24)
        await pilot.pause(0.4)
        lines = [str(line) for line in app.screen.query_one("#state", Lines).lines]
        assert "FAULT" in lines[0]
        assert "press 5 for what to do" in lines[3]


async def test_closing_the_line_of_a_drive_with_a_timeout_asks_first() -> None:
    app = DrivePanelApp(open_line=lambda *_, **__: demo_line({"atv21": 35.0}), start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(
            pilot, lambda: app.fleet is not None and alone(app.fleet.line_watch) == {1: 3.0}
        )
        for answer in ("escape", "y"):
            assert app.opened is not None
            await fakes.press(pilot, "(disconnect)")
            await until(pilot, lambda: isinstance(app.screen, Confirm))
            await pilot.press(answer)
            await until(pilot, lambda: app.screen is app.connection)
        await until(pilot, lambda: app.opened is None)


async def test_exiting_panel_without_screens_raises_nothing() -> None:
    """Textual takes the screens away first; a look around or a key just then ended it badly."""
    app = DrivePanelApp(open_line=lambda text, **_: fakes.opened())
    async with app.run_test(size=(80, 24)):
        pass
    assert app.screen_stack == []
    app.look_around()
    await app.on_event(Key("a", "a"))
