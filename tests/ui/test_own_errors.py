"""Internal errors of the panel on a simulated line: stop frames first, then the line closes."""

from __future__ import annotations

import asyncio
import inspect
import threading
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from textual import _wait
from textual.pilot import Pilot
from textual.widgets import OptionList

from tests.programs import PATIENCE, rtu_tcp
from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.screens.base import PanelScreen
from tui.screens.dialogs.leave import Leave
from tui.screens.leaving import Leaving
from tui.screens.monitor.screen import MonitorScreen
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.paths import state_folder
from tui.simulator import DriveSpec, Simulation
from tui.terminal.last_words import FAILED

from .test_command_flows import Bench, knows_the_state
from .test_flows import until

TEXT = "a screw is loose"
STOP = 7
"""Command word of an Altivar 71 that stops its motor."""


class Ends:
    """The drive's command word and motor frequency at each close of its line."""

    def __init__(self, simulation: Simulation) -> None:
        self.seen: list[tuple[int, float]] = []
        self._text = rtu_tcp(simulation)
        self._drive = simulation.drive(1)

    def open(self, _: str, **how: Any) -> OpenLine:
        """Open the line."""
        opened = open_line(self._text, **how)
        opened.devices = (1,)
        close = opened.line.close

        def closing() -> None:
            self.seen.append((self._drive.raw("CMD"), self._drive.motor.frequency))
            close()

        opened.line.close = closing  # type: ignore[method-assign]
        return opened


async def monitor(made: Bench) -> None:
    """Go to the drive's Monitor."""
    app, pilot = made.app, made.pilot
    await until(pilot, lambda: bool(app.connection.query("#drives")))
    await until(pilot, lambda: app.connection.drives.option_count == 1)
    drives = app.connection.query_one("#drives", OptionList)
    drives.focus()
    drives.highlighted = 0
    await pilot.press("enter")
    await until(pilot, lambda: isinstance(app.screen, MonitorScreen) and knows_the_state(app))


Fail = Callable[[type, str], None]


async def in_drawing(_: Bench, fail: Fail) -> None:
    fail(MonitorScreen, "draw")


async def in_a_key(made: Bench, fail: Fail) -> None:
    fail(PanelScreen, "on_key")
    made.app.simulate_key("z")


async def in_a_worker(made: Bench, fail: Fail) -> None:
    fail(Leaving, "_stop_and_leave")
    await made.pilot.press("q")
    await until(made.pilot, lambda: isinstance(made.app.screen, Leave))
    made.app.simulate_key("s")


@pytest.mark.parametrize("where", kept([in_drawing, in_a_key, in_a_worker], in_a_worker))
@pytest.mark.internal_errors
def test_internal_error_stops_the_motor_before_the_line_closes(
    where: Callable[[Bench, Fail], Awaitable[None]],
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """The whole panel runs as a program does, but for its terminal."""
    failed = threading.Event()

    def fail(owner: type, name: str) -> None:
        async def later(*_: object) -> None:
            now()

        def now(*_: object) -> None:
            failed.set()
            raise RuntimeError(TEXT)

        whole = getattr(owner, name)
        monkeypatch.setattr(owner, name, later if inspect.iscoroutinefunction(whole) else now)

    monkeypatch.setattr(_wait, "SLEEP_IDLE", _wait.SLEEP_GRANULARITY / 4)
    with Simulation([DriveSpec("atv71", 1)]) as simulation:
        ends = Ends(simulation)
        app = DrivePanelApp(open_line=ends.open, start="the line")

        async def hands(pilot: Pilot[Any]) -> None:
            made = Bench(app, pilot, simulation)
            await monitor(made)
            await made.running()
            await made.commanded()
            assert simulation.drive(1).raw("CMD") != STOP
            await where(made, fail)
            await asyncio.to_thread(failed.wait, PATIENCE)

        app.run(headless=True, size=(80, 24), auto_pilot=hands)
        assert failed.is_set()
        assert ends.seen[0] == (STOP, 0.0)
    assert app.return_code == FAILED
    printed = capfd.readouterr()
    assert printed.out == ""
    words = (
        f"The panel had to stop after an internal error (RuntimeError: {TEXT});"
        f" details are in {state_folder() / 'drivepanel.log'}."
        " Stopping device 1. Device 1: stopped."
    )
    assert "".join(printed.err.split()) == words.replace(" ", "")
