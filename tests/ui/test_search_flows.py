"""The scan continues below other screens; addresses are changed in place."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest
from textual.pilot import Pilot
from textual.widgets import Input

from tests.programs import rtu_tcp
from tui.app import DrivePanelApp
from tui.screens.monitor.screen import MonitorScreen
from tui.session.connect.identify import DriveIdentity, ScanResult
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.paths import recent_lines
from tui.simulator import DriveSpec, FaultRates, Simulation

from .test_flows import shown, until

pytestmark = pytest.mark.long


@asynccontextmanager
async def panel(
    *specs: DriveSpec, faults: FaultRates | None = None
) -> AsyncIterator[tuple[DrivePanelApp, Pilot[None]]]:
    """The panel on a line with unknown drives."""
    simulation = Simulation(list(specs), faults=faults)
    simulation.start()
    text = rtu_tcp(simulation)

    def opener(_: str, **how: object) -> OpenLine:
        return open_line(text, **how)  # type: ignore[arg-type]

    app = DrivePanelApp(open_line=opener, start=text)
    try:
        async with app.run_test(size=(80, 24)) as pilot:
            yield app, pilot
    finally:
        simulation.stop()


def output(app: DrivePanelApp) -> list[str]:
    return [event.text for event in app.events.events]


async def test_drive_is_opened_during_the_scan() -> None:
    async with panel(DriveSpec("atv71", 1), DriveSpec("atv71", 4)) as (app, pilot):
        await until(pilot, lambda: app.connection.drives.has_focus)
        search = app.connection.search
        assert search is not None
        assert search.goes_on
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert search.goes_on
        await until(pilot, lambda: set(app.connection.found) == {1, 4})
        assert isinstance(app.screen, MonitorScreen)
        assert "…" in shown(app, "tabs"), "the tab of Line says that it goes on"
        # back there it is the same one, and Esc ends it
        await pilot.press("1")
        await until(pilot, lambda: app.connection.drives.option_count == 2)
        assert app.connection.search is search
        assert search.goes_on
        assert f"scan {search.requested} of" in shown(app, "drives-title")
        await pilot.press("escape")
        await until(pilot, lambda: "scan stopped: 2 of " in shown(app, "drives-title"))
        assert not search.goes_on


async def test_scan_ends_silently_with_its_line() -> None:
    async with panel(DriveSpec("atv71", 1)) as (app, pilot):
        await until(pilot, lambda: bool(app.connection.found))
        search = app.connection.search
        assert search is not None
        await app.disconnect()
        await until(pilot, lambda: not search.goes_on)
        assert "closed" not in " ".join(output(app))


async def test_typed_addresses_are_stored_for_the_line() -> None:
    async with panel(DriveSpec("atv71", 1), DriveSpec("atv71", 14)) as (app, pilot):
        await until(pilot, lambda: app.connection.drives.has_focus)
        await pilot.press("c", "1", "3", "-", "enter")
        field = app.connection.query_one("#addresses", Input)
        await until(pilot, lambda: "is not a list of addresses" in output(app)[-1])
        assert field.has_focus
        await pilot.press("1", "4", "enter")
        await until(pilot, lambda: set(app.connection.found) == {1, 14})
        await until(pilot, lambda: app.connection.drives.has_focus)
        await until(pilot, lambda: "1 of 2 addresses" in shown(app, "drives-title"))
        assert "2 drives: " in shown(app, "drives-title"), "those found stay, and count"
        text = app.line_text
        await app.disconnect()
        app.connection.form.offer_addresses("1-10")
        app.connection.start(text, None)
        await until(pilot, lambda: app.opened is not None and field.value == "13-14")


async def test_invalid_line_is_not_stored() -> None:
    app = DrivePanelApp(start="sim:")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "names no profile" in shown(app, "message"))
        choices = [choice.text for choice in app.connection.lines._choices.values()]
        assert "sim:" not in choices
        assert recent_lines() == []


async def test_pending_timeout_is_reported_once() -> None:
    async with panel(DriveSpec("atv21", 1), DriveSpec("atv71", 2)) as (app, pilot):
        await until(pilot, lambda: app.connection.drives.option_count == 2)
        await pilot.press("escape")
        await until(pilot, lambda: any("1 (3 s)" in text for text in output(app)))
        await pilot.press("s")
        await until(pilot, lambda: app.connection.scanning)
        await pilot.press("escape")
        await until(pilot, lambda: not app.connection.scanning)
        assert sum("Kept alive" in text for text in output(app)) == 1


async def test_drive_with_its_timeout_reaction_off_has_no_pending_timeout() -> None:
    ignoring = DriveSpec("atv31", 1, sets={"SLL": 0})
    async with panel(ignoring, DriveSpec("atv21", 2)) as (app, pilot):
        await until(pilot, lambda: any("Kept alive" in text for text in output(app)))
        (text,) = (text for text in output(app) if "Kept alive" in text)
        assert "Kept alive while this line is open: 2 (3 s). If polling stops, they trip" in text
        assert app.fleet is not None
        assert set(app.fleet.line_watch.pending_timeouts()) <= {2}


async def test_drive_with_damaged_identification_keeps_its_stop_keys() -> None:
    damaged = ScanResult(1, DriveIdentity(1, "", "", "", "", None, ()), "It came damaged.")
    other = replace(damaged, device=9, identity=DriveIdentity(9, "", "", "", "", None, ()))
    async with panel(DriveSpec("atv71", 1)) as (app, pilot):
        await until(pilot, lambda: 1 in app.connection.found)
        app.connection.end_search()
        fleet = app.fleet
        assert fleet is not None
        console = fleet.console(1)
        assert console is not None
        await app.connection._take(damaged)
        assert fleet.console(1) is console
        await app.connection._take(other)
        assert fleet.found[9].console is None
        assert "It came damaged. A device has this address." in output(app)


async def test_swapped_bytes_are_shown_on_line_and_monitor() -> None:
    async with panel(DriveSpec("atv71", 1), faults=FaultRates(swapped=1.0)) as (app, pilot):
        await until(pilot, lambda: any("arrive swapped" in text for text in output(app)))
        await until(pilot, lambda: 1 in app.connection.found)
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        await until(pilot, lambda: "BYTES SWAPPED" in shown(app, "state"))
