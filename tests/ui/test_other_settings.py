"""Line searches at other baud rates and formats, likely ones first, until a drive answers."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

import pytest
from textual.pilot import Pilot

from tests.bus.peer import PtyPeer, Step, silent
from tui.app import DrivePanelApp
from tui.drive.finding import LineSetting, likely_settings
from tui.screens.dialogs.confirm import Confirm
from tui.session.connect import address_prober
from tui.session.paths import recent_lines
from tui.simulator import DriveSpec, LineTiming, Simulation
from tui.widgets.plain import Plain
from tui.wire.frames import frame, read_frame

from .test_flows import shown, until

pytestmark = pytest.mark.long


@pytest.fixture(autouse=True)
def few_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", list)
    monkeypatch.setattr("tui.session.connect.other_masters.LISTEN", 0.5)
    monkeypatch.setattr(address_prober, "JITTER", 0.25)
    monkeypatch.setattr(address_prober, "likely_settings", lambda *a: likely_settings(*a)[:6])


@asynccontextmanager
async def panel_on(line: str) -> AsyncIterator[tuple[DrivePanelApp, Pilot[None]]]:
    """The panel on a line that was searched at its own setting."""
    app = DrivePanelApp(start=f"{line},19200,8E1")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.opened is not None)
        app.connection.form.offer_addresses("1-2")
        app.connection.action_scan()
        await until(pilot, lambda: bool(app.connection.search and app.connection.search.ended))
        yield app, pilot


def advice(app: DrivePanelApp) -> str:
    return " ".join(shown(app, "message").split())


def dialog(app: DrivePanelApp) -> str:
    return str(app.screen.query_one("#follows", Plain).visual)


def output(app: DrivePanelApp) -> str:
    return "\n".join(event.text for event in app.events.events)


async def test_drive_at_another_baud_is_found_and_the_line_keeps_it() -> None:
    drive = DriveSpec("atv71", 1, sets={"TBR": 28})
    with Simulation([drive], timing=LineTiming(19200, "8E1")) as simulation:
        async with panel_on(simulation.serve_pty()) as (app, pilot):
            assert not app.connection.found
            app.connection.action_scan_settings()
            await until(pilot, lambda: "Drives answer at 9600 8E1" in output(app))
            assert set(app.connection.found) == {1}
            assert app.line_text.endswith(",9600,8E1")
            assert app.connection.form.line_at("p") == "serial:p,9600,8E1"
            assert sum(",19200,8N2" in line for line in recent_lines()) == 0
            assert any(",9600,8E1" in line for line in recent_lines())


@pytest.mark.sweep
async def test_stop_of_all_holds_for_the_settings_that_are_still_to_be_tried() -> None:
    drive = DriveSpec("atv71", 1, sets={"TBR": 28})
    with Simulation([drive], timing=LineTiming(19200, "8E1")) as simulation:
        async with panel_on(simulation.serve_pty()) as (app, pilot):
            app.connection.action_scan_settings()
            first = app.connection.search
            await until(pilot, lambda: app.connection.search not in (None, first))
            assert app.take_stop_key("f9")
            await until(pilot, lambda: bool(app.fleet and app.fleet.stopper.reports))
            assert set(app.connection.found) == {1}


async def test_drive_with_a_timeout_is_left_unpolled_only_if_confirmed() -> None:
    with Simulation([DriveSpec("atv21", 1)], timing=LineTiming(19200, "8E1")) as simulation:
        async with panel_on(simulation.serve_pty()) as (app, pilot):
            await until(pilot, lambda: set(app.connection.found) == {1})
            app.connection.action_scan_settings()
            await until(pilot, lambda: isinstance(app.screen, Confirm))
            await pilot.press("n")
            await until(pilot, lambda: not isinstance(app.screen, Confirm))
            assert set(app.connection.found) == {1}
            assert app.line_text.endswith(",19200,8E1")


async def test_slow_setting_is_reported_before_it_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    slow = [LineSetting(9600, "8E1"), LineSetting(600, "8E1"), LineSetting(300, "8E1")]
    monkeypatch.setattr(address_prober, "likely_settings", lambda *_: slow)
    with PtyPeer(silent) as peer:
        async with panel_on(peer.path) as (app, pilot):
            app.connection.form.offer_addresses("1-3")
            app.connection.action_scan_settings()
            await until(pilot, lambda: "Not searched yet: 300 and 600 baud, " in output(app))
            assert "for Powerdrive, Proxidrive and Varmeca 33/34 only. Press Esc" in output(app)
            await until(pilot, lambda: "600 8E1, 2 of 3 settings. 3 s left." in advice(app))
            app.connection.action_stop_scan()


async def test_unexpected_reply_tries_other_settings_only_if_confirmed() -> None:
    def garbled(request: bytes, _count: int) -> Sequence[Step]:
        return [frame(2, bytes.fromhex("03 02 0001"))[:-1] + b"\0"] if request[0] == 2 else []

    with PtyPeer(garbled) as peer:
        async with panel_on(peer.path) as (app, pilot):
            assert "A device has this address." in output(app)
            assert "No drive answered" not in output(app)
            app.connection.action_scan_settings()
            await until(pilot, lambda: isinstance(app.screen, Confirm))
            assert "Device 2: its communication loss reaction" in dialog(app)
            await pilot.press("y")
            await until(pilot, lambda: "A device answers at 19200 8N2, but" in output(app))


async def test_possible_drives_are_named_before_first_request() -> None:
    with PtyPeer(silent) as peer:
        app = DrivePanelApp(start=f"{peer.path},19200,8E1")
        async with app.run_test(size=(80, 24)) as pilot:
            await until(pilot, lambda: "Altivar 21 (F803), and" in shown(app, "message"))
            assert "polled while the line is open" in advice(app)
            assert peer.requests == []
            await until(pilot, lambda: " s left." in advice(app))
            assert "of 10 addresses" in shown(app, "search")


async def test_drives_are_still_polled_during_the_question() -> None:
    def refusing(request: bytes, _count: int) -> Sequence[Step]:
        if request[0] == 2:
            return [frame(2, bytes([request[1] | 0x80, 1]))]
        reply = simulation.line.receive(request)
        return [reply.data] if reply is not None else []

    simulation = Simulation([DriveSpec("atv21", 1)], any_settings=True)
    with simulation, PtyPeer(refusing) as peer:
        async with panel_on(peer.path) as (app, pilot):
            await until(pilot, lambda: set(app.connection.found) == {1, 2})
            app.connection.action_scan_settings()
            await until(pilot, lambda: isinstance(app.screen, Confirm))
            assert "Device 2: its communication loss reaction is not" in dialog(app)
            before = len(peer.requests)
            for device in (1, 2):
                await until(pilot, lambda: _requested(peer, device, before) >= 2)  # noqa: B023
            assert app.line_text.endswith(",19200,8E1")


def _requested(peer: PtyPeer, device: int, since: int) -> int:
    return sum(request[0] == device for request in peer.requests[since:])


async def test_another_master_ends_the_scan_before_sending() -> None:
    with PtyPeer(silent) as peer:
        async with panel_on(peer.path) as (app, pilot):
            sent = len(peer.requests)
            app.connection.action_scan_settings()
            await until(pilot, lambda: "Listening" in app.connection._advice[0])
            peer.send(read_frame(6, 3201, 4))
            await until(pilot, lambda: "Address 6: read of registers 3201" in output(app))
            assert len(peer.requests) == sent


async def test_scan_of_a_port_monitors_first() -> None:
    with PtyPeer(silent) as peer:
        app = DrivePanelApp(start=f"{peer.path},19200,8E1")
        async with app.run_test(size=(80, 24)) as pilot:
            await until(pilot, lambda: "Listening" in app.connection._advice[0])
            peer.send(read_frame(6, 3201, 4))
            await until(pilot, lambda: "Address 6: read of registers 3201" in output(app))
            assert not app.connection.scanning
            assert peer.requests == []


async def test_esc_ends_the_monitoring_before_a_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.session.connect.other_masters.LISTEN", 600.0)
    with PtyPeer(silent) as peer:
        app = DrivePanelApp(start=f"{peer.path},19200,8E1")
        async with app.run_test(size=(80, 24)) as pilot:
            await until(pilot, lambda: "Listening" in app.connection._advice[0])
            app.connection.action_stop_scan()
            await until(pilot, lambda: not app.connection.scanning)
            assert peer.requests == []


async def test_line_without_settings_says_so() -> None:
    app = DrivePanelApp(start="sim:atv71")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.opened is not None)
        app.connection.action_scan_settings()
        await until(pilot, lambda: "no baud or format of its own" in output(app))
