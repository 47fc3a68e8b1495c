"""A profile typed on Line, against the identification of a drive."""

from __future__ import annotations

from textual.widgets import Input

from tui.screens.monitor.screen import MonitorScreen
from tui.simulator import DriveSpec

from .test_flows import shown, until
from .test_search_flows import output, panel


async def test_drive_with_a_contradicting_profile_is_not_armed() -> None:
    async with panel(DriveSpec("atv71", 1)) as (app, pilot):
        await until(pilot, lambda: app.connection.drives.has_focus)
        field = app.connection.query_one("#profile", Input)
        field.value = "atv312"
        await pilot.press("s")
        reported = (
            "Device 1 says it is ATV71HU15M3, Altivar 71: the profile Altivar 312 does not fit it."
        )
        await until(pilot, lambda: any(text.startswith(reported) for text in output(app)))
        way = "Cannot be armed: wrong profile. Enter atv71 as Profile, then press s."
        await until(pilot, lambda: way in shown(app, "about"))
        app.connection.drives.focus()
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        await pilot.press("a")
        await until(pilot, lambda: output(app)[-1].startswith(f"Not armed: {reported}"))
        console = app.connection.found[1].console
        assert console is not None
        assert console.commander.armed_for is None
        # its own profile, and it is armed as usual
        await pilot.press("1")
        await until(pilot, lambda: app.screen is app.connection)
        field.value = ""
        await pilot.press("s")
        await until(pilot, lambda: "Cannot be armed" not in shown(app, "about"))
        drive = app.connection.found[1]
        assert drive.session is not None
        assert drive.session.profile.id == "atv71"
