"""Make the screenshots from simulated drives on a real line: `python screenshots/make.py`."""

from __future__ import annotations

import asyncio
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).resolve().parent
SIZES = ((80, 24), (120, 40))
DRIVES = {"atv21": 35.0, "atv31": 25.0, "atv312": 42.0, "atv71": 50.0, "powerdrive": 30.0}
WATCHED = 4
TREND_SECONDS = 62.0
FAULT_CODE = "ObF"
NO_SEARCH = ["backspace"] * 4
MARKED = [*["left"] * 32, "M", *["right"] * 20, "M", *["left"] * 8]
TO_NAMEPLATE = 10
"""Steps of the start-up before the nameplate of the motor."""
STEPS: tuple[tuple[list[str], float, str], ...] = (
    (["8"], 5.0, ""),
    (MARKED, 2.0, "trend"),
    (["escape", "escape"], 0.5, ""),
    (["question_mark"], 0.5, "help"),
    (["escape", "a"], 1.0, "armed"),
    (["r", *"42"], 1.0, "run-line"),
    (["escape", "6"], 1.5, ""),
    (["down"], 0.5, "control-source"),
    (["3"], 6.0, ""),
    (["slash", *"ramp", "enter"], 1.5, "parameters-found"),
    (["slash", *NO_SEARCH, *"acc", "enter"], 0.5, ""),
    ([*"5.03"], 0.5, "parameters-edit"),
    (["enter", "slash", *NO_SEARCH, *"speed", "enter", "minus"], 1.0, "parameters"),
    (["a", "w"], 0.5, "parameters-write"),
    (["escape", "4"], 3.0, ""),
    (["down", "down", "enter", *"lcr"], 0.5, "blocks-pick"),
    (["enter", "down", "enter", *"uln"], 0.5, ""),
    (["enter"], 1.0, "blocks"),
    (["u", "escape"], 0.5, ""),
    (["B"], 2.0, ""),
    (["tab"] * TO_NAMEPLATE, 2.5, "start-up"),
    (["escape"], 0.5, ""),
)
"""Keys pressed on Monitor, the seconds to wait, and the name of the picture taken then."""


async def main() -> None:
    """One run a size: every screen in a usual state."""
    from tui.session.connect import open_line

    open_line.serial_ports = list  # the same on every machine: no port
    with tempfile.TemporaryDirectory() as folder:
        os.environ["DRIVEPANEL_STATE"] = os.environ["DRIVEPANEL_CONFIG"] = folder
        for size in SIZES:
            await _run(size)


async def _run(size: tuple[int, int]) -> None:
    from textual.pilot import Pilot

    from tui.app import DrivePanelApp
    from tui.screens.monitor.screen import MonitorScreen
    from tui.session.connect.open_line import demo_line

    app = DrivePanelApp(open_line=lambda *_, **__: demo_line(DRIVES), start="demo")

    async def until(pilot: Pilot[None], holds: Callable[[], bool]) -> None:
        end = time.monotonic() + 60
        while not holds():
            if time.monotonic() > end:
                raise TimeoutError("the screen did not get there")
            await pilot.pause(0.1)

    def save(name: str) -> None:
        app.save_screenshot(f"{name}-{size[0]}x{size[1]}.svg", str(HERE))

    async with app.run_test(size=size) as pilot:
        await until(pilot, lambda: len(app.connection.found) == len(DRIVES))
        fleet = app.fleet
        if fleet is None:
            raise RuntimeError("drives were found on no line")
        await until(pilot, lambda: len(fleet.line_watch.looks) == len(DRIVES))
        await pilot.pause(1.0)
        save("connection")
        await pilot.press(*["down"] * (WATCHED - 1), "enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        await pilot.pause(TREND_SECONDS)
        save("monitor")
        for keys, seconds, name in STEPS:
            await pilot.press(*keys)
            await pilot.pause(seconds)
            if name:
                save(name)
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        simulation = app.opened.simulation if app.opened else None
        if simulation is None:
            raise RuntimeError("the screenshots are made from simulated drives")
        simulation.drive(WATCHED).provoke(FAULT_CODE)
        await pilot.pause(4.0)
        save("monitor-fault")
        await pilot.press("5")
        await pilot.pause(2.0)
        save("faults")


if __name__ == "__main__":
    asyncio.run(main())
