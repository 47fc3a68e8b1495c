"""Several lines in one panel: one is shown, the drives of all are kept alive and stopped."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from tui.app import DrivePanelApp
from tui.bus.line import Line
from tui.screens.dialogs.confirm import Confirm
from tui.session.connect.open_line import OpenLine, demo_line
from tui.session.monitor.line_health import SEVERAL_FRAMES

from .test_frame import Panel

pytestmark = pytest.mark.long

FIRST, SECOND = "sim:atv71@1", "sim:atv312@1"


@asynccontextmanager
async def two_lines() -> AsyncIterator[Panel]:
    """The panel with a running drive on each of two lines, the second of them shown."""

    def opener(text: str, **_: object) -> OpenLine:
        opened = demo_line({"atv71": 30.0} if text == FIRST else {"atv312": 20.0})
        opened.text = text
        return opened

    app = DrivePanelApp(open_line=opener, start=FIRST)
    async with app.run_test(size=(120, 40)) as pilot:
        made = Panel(app, pilot)
        await made.until(lambda: app.fleet is not None and len(app.fleet.sessions) == 1)
        app.connection.open_line(SECOND)
        await made.until(lambda: len(app.panel_lines) == 2)
        await made.until(lambda: app.fleet is not None and len(app.fleet.sessions) == 1)
        yield made


def turning(made: Panel) -> list[bool]:
    """True for each line whose motor turns, by the simulated drives."""
    found = []
    for line in made.app.panel_lines:
        assert line.opened.simulation is not None
        found.append(line.opened.simulation.drive(1).motor.frequency > 0)
    return found


async def test_second_line_opens_beside_and_both_can_be_shown() -> None:
    async with two_lines() as made:
        app = made.app
        first, second = app.panel_lines
        assert app.opened is second.opened
        assert app.screen is app.connection  # no question, and nothing is closed
        assert first.opened.line.state.status.value == "connected"
        await made.until(lambda: "1 of 2 lines" in made.shown("strip"))
        app.connection.open_line(FIRST)
        await made.until(lambda: app.opened is first.opened)
        await made.until(lambda: app.connection.drives.option_count == 1)
        assert len(app.panel_lines) == 2
        await made.until(
            lambda: "ATV71" in str(app.connection.drives.get_option_at_index(0).prompt)
        )


async def test_fault_on_a_hidden_line_is_counted_and_reported() -> None:
    async with two_lines() as made:
        simulation = made.app.panel_lines[0].opened.simulation
        assert simulation is not None
        simulation.drive(1).provoke("ObF")
        await made.until(lambda: "1 fault" in made.shown("strip"))
        label = made.app.panel_lines[0].opened.label
        await made.until(
            lambda: any(
                event.text.startswith(label) and "ObF" in event.text
                for event in made.app.events.events
            )
        )


async def test_stop_all_stops_the_motors_of_every_line() -> None:
    async with two_lines() as made:
        await made.until(lambda: turning(made) == [True, True])
        await made.pilot.press("f9")
        await made.until(lambda: turning(made) == [False, False])


async def test_stop_on_line_stops_the_motors_of_every_line() -> None:
    async with two_lines() as made:
        await made.until(lambda: turning(made) == [True, True])
        assert made.app.stop_target_text == "STOP ALL"
        await made.pilot.press("space")
        await made.until(lambda: turning(made) == [False, False])


async def test_closing_one_line_shows_the_other_unchanged() -> None:
    async with two_lines() as made:
        app = made.app
        first, second = app.panel_lines
        await app.disconnect()
        assert app.panel_lines == (first,)
        assert app.opened is first.opened
        assert second.opened.line.state.status.value == "closed"
        assert first.opened.line.state.status.value == "connected"
        assert turning(made) == [True]


async def test_leaving_reports_drives_of_both_lines() -> None:
    async with two_lines() as made:
        app = made.app
        for line in app.panel_lines:
            await made.until(lambda line=line: not line.fleet.line_watch.unread())  # type: ignore[misc]
        for line in app.panel_lines:
            line.fleet.sessions[0].note_command()
        await made.pilot.press("q")
        await made.until(lambda: app.screen is not app.connection)
        output = "\n".join(str(widget.render()) for widget in app.screen.query("#follows"))
        for line in app.panel_lines:
            assert line.opened.label in output
        assert "Altivar 71" in output
        assert "Altivar 312" in output


async def test_same_line_with_other_settings_is_closed_only_if_confirmed() -> None:
    async with two_lines() as made:
        app = made.app
        app.panel_lines[0].opened.text = "serial:/dev/ttyUSB7,19200,8N1"
        app.connection.open_line("serial:/dev/ttyUSB7,9600,8N1")
        await made.until(lambda: isinstance(app.screen, Confirm))
        await made.pilot.press("escape")
        await made.until(lambda: app.screen is app.connection)
        assert len(app.panel_lines) == 2


async def test_foreign_frames_on_a_hidden_line_are_reported_with_its_name() -> None:
    async with two_lines() as made:
        below, shown = made.app.panel_lines
        for item in (below, shown):
            line = item.opened.line
            assert isinstance(line, Line)
            for _ in range(SEVERAL_FRAMES):
                line._engine.tally.count_minute(None, "foreign")
        reported = f"{SEVERAL_FRAMES} foreign frames in the last minute."

        def reports() -> set[str]:
            return {
                e.text.partition(reported)[0] for e in made.app.events.events if reported in e.text
            }

        await made.until(lambda: reports() == {"", f"{below.opened.label}: "})
        await made.until(lambda: "▲ foreign frames" in made.shown("strip"))
        assert "1▲Line" in made.shown("tabs")


async def test_lost_line_has_no_health() -> None:
    async with two_lines() as made:
        shown = made.app.panel_lines[1]
        line, simulation = shown.opened.line, shown.opened.simulation
        assert isinstance(line, Line)
        assert simulation is not None
        for _ in range(SEVERAL_FRAMES):
            line._engine.tally.count_minute(None, "foreign")
        await made.until(lambda: "▲ foreign frames" in made.shown("strip"))
        simulation.unplug()
        await made.until(lambda: "▲" not in made.shown("strip"))
        assert not shown.fleet.health.troubles
