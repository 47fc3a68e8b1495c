"""A drive of an unproved profile is armed only after its own question."""

from __future__ import annotations

from textual.widgets import Input

from tui.screens.dialogs.confirm import Confirm
from tui.screens.monitor.screen import MonitorScreen
from tui.simulator import DriveSpec

from .test_flows import until
from .test_search_flows import output, panel


async def test_unproved_profile_is_confirmed_by_a_person_before_arming() -> None:
    async with panel(DriveSpec("ms300", 1)) as (app, pilot):
        await until(pilot, lambda: app.connection.drives.has_focus)
        app.connection.query_one("#profile", Input).value = "ms300"
        await pilot.press("s")
        await until(pilot, lambda: bool(app.connection.found))
        app.connection.drives.focus()
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        console = app.connection.found[1].console
        assert console is not None
        await pilot.press("a")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert console.session.is_unconfirmed
        await pilot.press("a")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        await pilot.pause(0.4)
        await pilot.press("y")
        await until(pilot, lambda: output(app)[-1].startswith("Confirmed until this program ends."))
        assert console.commander.armed_for is None
        await pilot.press("a")
        await until(pilot, lambda: console.commander.armed_for is not None)
