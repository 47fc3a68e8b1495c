"""Keys of the cursor that reads the curve, on a running drive, and what they leave alone."""

from __future__ import annotations

import re

import pytest

from tui.app import DrivePanelApp
from tui.screens.monitor.screen import MonitorScreen

from .test_flows import demo, shown, to_monitor, until

pytestmark = pytest.mark.long


def read_out(app: DrivePanelApp) -> str:
    return shown(app, "curve").split("\n")[0]


async def test_cursor_reads_moves_and_closes_and_only_then_esc_leaves() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await to_monitor(app, pilot, 2)
        await until(pilot, lambda: len(screen.console.monitor.trend) > 6)
        assert "= read" in read_out(app)
        await pilot.press("left")
        await until(pilot, lambda: "Press = first" in shown(app, "said"))
        assert not screen.reads_curve
        await pilot.press("equals_sign")
        await until(pilot, lambda: "← → move" in read_out(app))
        first = read_out(app)
        assert re.match(r" \d\d:\d\d:\d\d\.\d   output +\d", first)
        page = screen.time_cursor.page
        await pilot.press("left", "left", "left")
        await until(pilot, lambda: read_out(app)[:12] < first[:12])
        before = read_out(app)
        await pilot.press("right")
        await until(pilot, lambda: read_out(app)[:12] > before[:12])
        assert screen.time_cursor.page == page, "the page does not turn under the cursor"
        await pilot.press("escape")
        await until(pilot, lambda: "= read" in read_out(app))
        assert isinstance(app.screen, MonitorScreen)


async def test_arrows_up_and_down_keep_their_meaning_while_there_is_a_cursor() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await to_monitor(app, pilot, 2)
        await until(pilot, lambda: len(screen.console.monitor.trend) > 2)
        await pilot.press("equals_sign")
        await until(pilot, lambda: screen.reads_curve)
        moment = screen.time_cursor.moment
        await pilot.press("up")
        await until(pilot, lambda: "Not armed" in shown(app, "said"))
        assert screen.time_cursor.moment == moment


async def test_another_span_and_a_table_end_the_cursor() -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await to_monitor(app, pilot, 2)
        await until(pilot, lambda: bool(screen.console.monitor.trend))
        for key in (">", "tab"):
            await pilot.press("equals_sign")
            await until(pilot, lambda: screen.reads_curve)
            await pilot.press(key)
            await until(pilot, lambda: not screen.reads_curve)
        assert "All values" in read_out(app)
        assert screen.time_cursor.step.span == 120
