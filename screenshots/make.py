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


async def main() -> None:
    """One run a size: every screen in a usual state."""
    import tui.session.lines

    tui.session.lines.serial_ports = list  # the same on every machine: no port
    with tempfile.TemporaryDirectory() as folder:
        os.environ["DRIVEPANEL_STATE"] = os.environ["DRIVEPANEL_CONFIG"] = folder
        for size in SIZES:
            await _run(size)


async def _run(size: tuple[int, int]) -> None:
    from textual.pilot import Pilot

    from tui.app import DrivePanelApp
    from tui.screens.monitor import MonitorScreen
    from tui.session.lines import demo_line

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
        known = app.connection.found
        await until(pilot, lambda: len(known) == len(DRIVES))
        await until(pilot, lambda: all(d.state not in ("", "asking") for d in known.values()))
        await pilot.pause(1.0)
        save("connection")
        await pilot.press(*["down"] * (WATCHED - 1), "enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        await pilot.pause(TREND_SECONDS)
        save("monitor")
        await pilot.press("question_mark")
        await pilot.pause(0.5)
        save("help")
        await pilot.press("escape", "a")
        await pilot.pause(1.0)
        save("armed")
        await pilot.press("c")
        await pilot.pause(1.5)
        await pilot.press("down")
        await pilot.pause(0.5)
        save("control-source")
        await pilot.press("escape", "3")
        await pilot.pause(6.0)
        await pilot.press("slash", *"ramp", "enter")
        await pilot.pause(1.5)
        save("parameters-found")
        await pilot.press("slash", *[*["backspace"] * 4], *"acc", "enter", "enter")
        await pilot.pause(0.5)
        await pilot.press(*"5.03")
        await pilot.pause(0.5)
        save("parameters-edit")
        await pilot.press("enter", "slash", *[*["backspace"] * 3], *"speed", "enter", "minus")
        await pilot.pause(1.0)
        save("parameters")
        await pilot.press("a", "a", "w")
        await pilot.pause(0.5)
        save("parameters-write")
        await pilot.press("escape", "2")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        simulation = app.opened.simulation if app.opened else None
        if simulation is None:
            raise RuntimeError("the screenshots are made from simulated drives")
        simulation.drive(WATCHED).provoke(FAULT_CODE)
        await pilot.pause(4.0)
        save("monitor-fault")
        await pilot.press("h")
        await pilot.pause(2.0)
        save("faults")


if __name__ == "__main__":
    asyncio.run(main())
