"""A drive of an unproved profile is armed only after its own question."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from textual.pilot import Pilot
from textual.widgets import Input

from tests.session.test_site_proof import ALL, MS300, evidence
from tui.app import DrivePanelApp
from tui.drive.profile import library
from tui.drive.profile.evidence import evidence_text
from tui.screens.dialogs.confirm import Confirm
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.parameters.screen import ParametersScreen
from tui.session.console import DriveConsole
from tui.simulator import DriveSpec

from .test_flows import picture, until
from .test_search_flows import output, panel


@asynccontextmanager
async def monitored() -> AsyncIterator[tuple[DrivePanelApp, Pilot[None], DriveConsole]]:
    """Monitor of a drive with an unproved profile."""
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
        yield app, pilot, console


async def test_unproved_profile_is_confirmed_by_a_person_before_arming() -> None:
    async with monitored() as (app, pilot, console):
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


async def test_proved_commands_need_no_question_but_settings_do() -> None:
    library.evidence_folder().mkdir(parents=True)
    known = evidence(library.load_file(MS300), *ALL)
    (library.evidence_folder() / "1.json").write_text(evidence_text(known), "utf-8")
    library.load.cache_clear()
    async with monitored() as (app, pilot, console):
        await pilot.press("a")
        await until(pilot, lambda: console.commander.armed_for is not None)
        await pilot.press("3")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen))
        console.editor.staging.stage("01-00", "50")
        await pilot.press("w")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        assert "by the unproved profile ms300?" in picture(app)
        await pilot.pause(0.4)
        await pilot.press("y")
        await until(pilot, lambda: not console.session.is_unconfirmed)
        assert console.commander.armed_for is not None
    library.load.cache_clear()
