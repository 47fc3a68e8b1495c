"""The panel on lines with a name, and on lines that are not as they were."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from textual.pilot import Pilot
from textual.widgets import Input

from tests.adapters import Adapters, adapters
from tests.programs import rtu_tcp
from tui.app import DrivePanelApp
from tui.bus.link import parse_link
from tui.drive.profile import library
from tui.screens.connection.choices import groups, line_in
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.messages.screen import MessagesScreen
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.opening import OpeningScreen, leave_opening
from tui.session.connect.known_line import KnownLine
from tui.session.connect.known_lines import (
    DriveMark,
    LineMark,
    LinesMemory,
    keep_memory,
    line_name,
    load_memory,
)
from tui.session.connect.line_key import line_key
from tui.session.connect.named_lines import LineSettings, NamedLine, settings_file
from tui.session.connect.open_line import OpenLine
from tui.session.paths import recent_lines
from tui.simulator import DriveSpec, Simulation

from . import fakes
from .test_flows import picture, shown, until

pytestmark = pytest.mark.long

__all__ = ["adapters"]

BY_ID = "serial:/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0,19200,8E1"


@pytest.fixture
def simulation() -> Iterator[Simulation]:
    """Two drives with running motors; the second does not identify itself."""
    made = Simulation([DriveSpec("atv71", 2, run_hz=30.0), DriveSpec("powerdrive", 5, run_hz=20.0)])
    made.start()
    yield made
    made.stop()


def another_before(line: str, device: int = 2) -> None:
    """Another drive was on the line when it was used last."""
    drives = {device: DriveMark("Telemecanique", "ATV31H037M2", "0201", "MIXER", "atv31")}
    keep_memory(LinesMemory({line_key(line): LineMark("", drives)}, {}))


def settings(text: str) -> None:
    settings_file().parent.mkdir(parents=True, exist_ok=True)
    settings_file().write_text(text, "utf-8")


async def test_changed_drive_is_read_only_until_confirmed(
    simulation: Simulation,
) -> None:
    line = rtu_tcp(simulation)
    another_before(line)
    app = DrivePanelApp(start=line, device=2)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: bool(app.screen.query("#follows")))
        reported = str(app.screen.query_one("#follows").render())
        assert "Device 2 was ATV31H037M2 MIXER" in reported
        assert "ATV71" in reported
        assert "read-only" in reported
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert app.chosen is not None
        await pilot.press("a")
        await until(pilot, lambda: "only stops are written" in shown(app, "said"))
        assert app.chosen.session.arming.armed_for is None
        # a stop needs no answer
        await pilot.press("space")
        await until(pilot, lambda: simulation.drive(2).motor.frequency == 0)
        # nor does the question come again automatically
        assert isinstance(app.screen, MonitorScreen)
        await app.run_action("accept_line")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        await pilot.pause(0.4)
        await pilot.press("y")
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert app.opened is not None
        await until(pilot, lambda: app.opened is not None and not app.opened.line.held)
        await pilot.press("a")
        await until(
            pilot, lambda: app.chosen is not None and bool(app.chosen.session.arming.armed_for)
        )
    assert load_memory().lines[line_key(line)].drives[2].profile == "atv71"


async def test_unchanged_line_needs_no_confirmation(simulation: Simulation) -> None:
    line = rtu_tcp(simulation)
    for _ in range(2):
        await opened_unasked(line)


async def opened_unasked(line: str) -> None:
    """Open the panel on a drive until that is remembered; no question may come."""
    app = DrivePanelApp(start=line, device=2)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        key = line_key(line)
        await until(pilot, lambda: bool(load_memory().lines.get(key, LineMark()).drives))
        app.look_around()
        assert isinstance(app.screen, MonitorScreen)
        await app.run_action("accept_line")
        await until(pilot, lambda: "Nothing to accept" in shown(app, "said"))


async def test_question_about_a_changed_line_comes_after_the_scan(simulation: Simulation) -> None:
    line = rtu_tcp(simulation)
    another_before(line)
    app = DrivePanelApp(start=line)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.opened is not None and bool(app.opened.line.held))
        assert app.fleet is not None
        assert app.fleet.search is not None
        if app.fleet.search.goes_on:
            assert app.screen is app.connection
        app.connection.action_stop_scan()
        await until(pilot, lambda: isinstance(app.screen, Confirm))


async def test_adapter_changed_while_the_line_was_lost_needs_confirmation(
    adapters: Adapters,
) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        line = fakes.StillLine()
        line.link = parse_link(port)
        app.opened = OpenLine(port, line, known=KnownLine(line))
        app.look_around()
        assert line.held == ""
        adapters.unplug("ttyUSB0")
        adapters.plug("ttyUSB0", "1.1", serial="B7")
        line.state = replace(fakes.CONNECTED, since=fakes.NOW - 1)
        app.look_around()
        await until(pilot, lambda: "B7" in line.held)
        app.look_around()
        await until(pilot, lambda: bool(app.screen.query("#follows")))
        assert "B7" in str(app.screen.query_one("#follows").render())
        app.opened = None


@asynccontextmanager
async def lost_with_adapter_changed(adapters: Adapters) -> AsyncIterator[Pilot[None]]:
    """A panel whose line now has another adapter, before the question."""
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    KnownLine(line_of(port))
    adapters.unplug("ttyUSB0")
    adapters.plug("ttyUSB0", "1.1", serial="B7")
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        line = line_of(port)
        app.opened = OpenLine(port, line, known=KnownLine(line))
        assert "B7" in line.held
        yield pilot
        app.opened = None


def line_of(port: str) -> fakes.StillLine:
    line = fakes.StillLine()
    line.link = parse_link(port)
    return line


async def test_question_waits_for_monitor_to_replace_first_picture(adapters: Adapters) -> None:
    async with lost_with_adapter_changed(adapters) as pilot:
        app = pilot.app
        assert isinstance(app, DrivePanelApp)
        app.push_screen(OpeningScreen("the line", 2))
        app.look_around()
        assert isinstance(app.screen, OpeningScreen)
        leave_opening(app)
        app.look_around()
        assert isinstance(app.screen, Confirm)


async def test_question_replaced_by_monitor_is_shown_again(adapters: Adapters) -> None:
    async with lost_with_adapter_changed(adapters) as pilot:
        app = pilot.app
        assert isinstance(app, DrivePanelApp)
        app.look_around()
        first = app.screen
        assert isinstance(first, Confirm)
        app.show_monitor(fakes.console_of(fakes.snapshot_of(library.load("atv71"), fakes.RUNNING)))
        assert isinstance(app.screen, MonitorScreen)
        app.look_around()
        assert isinstance(app.screen, Confirm)
        assert app.screen is not first
        assert app.screen.by_itself
        await until(pilot, lambda: bool(app.screen.query("#follows")))
        app.screen.action_no()
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
        app.look_around()
        assert isinstance(app.screen, MonitorScreen), "it was answered"


async def test_question_below_another_screen_is_shown_again_once(adapters: Adapters) -> None:
    async with lost_with_adapter_changed(adapters) as pilot:
        app = pilot.app
        assert isinstance(app, DrivePanelApp)
        await app.run_action("accept_line")
        hidden = app.screen
        assert isinstance(hidden, Confirm)
        await app.push_screen(MessagesScreen())
        app.look_around()
        again = app.screen
        assert isinstance(again, Confirm)
        assert again is not hidden
        assert again.by_itself, "no key has asked for it"
        await until(pilot, lambda: bool(again.query("#follows")))
        again.action_no()
        await until(pilot, lambda: isinstance(app.screen, MessagesScreen))
        app.pop_screen()
        await until(pilot, lambda: app.screen is app.connection)


async def test_port_is_stored_by_its_adapter(adapters: Adapters, simulation: Simulation) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5", leads_to=Path(simulation.serve_pty()))
    app = DrivePanelApp(start=port, device=2)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
    (recent,) = recent_lines()
    assert recent.startswith("serial:")
    assert "/by-id/usb-FTDI_6001_A5-if00-port0,19200," in recent
    assert line_name(parse_link(recent)).key == line_name(parse_link(port)).key


async def test_named_line_is_listed_and_opens_its_drive(simulation: Simulation) -> None:
    settings(
        f'[lines.fan]\nline = "{rtu_tcp(simulation)}"\ndevice = 5\nprofile = "powerdrive"\n'
        "[lines.old]\nline = 3\n"
    )
    app = DrivePanelApp()
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.connection.lines.chosen is not None)
        chosen = app.connection.lines.chosen
        assert chosen is not None
        assert (chosen.name, chosen.device) == ("fan", 5)
        rows = [str(option.prompt) for option in app.connection.lines.options]
        assert rows[0].strip() == "Named"
        assert any("error in settings.toml" in row for row in rows)
        assert any("settings.toml:6: lines.old.line" in event.text for event in app.events.events)
        await pilot.press("enter")
        await until(pilot, lambda: app.connection.drives.option_count == 1)
        (found,) = app.connection.found.values()
        assert found.identity.device == 5
        assert not found.guessed
        assert found.session is not None
        assert found.session.profile.id == "powerdrive"
        assert app.connection.query_one("#addresses", Input).value == "5"


async def test_drive_of_a_guessed_family_is_never_shown_as_stopped(
    simulation: Simulation,
) -> None:
    drive = simulation.drive(5)
    drive.set("6.43", 1)
    drive.set("6.42", 3)
    app = DrivePanelApp(start=rtu_tcp(simulation), device=5)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.chosen is not None and app.chosen.latest is not None)
        assert app.take_stop_key("space")
        await until(pilot, lambda: "NOT STOPPED" in picture(app))
        await until(pilot, lambda: drive.motor.frequency == 0)
        await until(pilot, lambda: "it is not known if the motor stopped" in picture(app))
        assert app.chosen is not None
        app.chosen.session.rest_seen = app.clock.monotonic()
        app.look_around()
        await pilot.pause()
        assert "it is not known if the motor stopped" in picture(app)


async def test_line_name_may_be_typed(simulation: Simulation) -> None:
    settings(f'[lines.fan]\nline = "{rtu_tcp(simulation)}"\ndevice = 5\n')
    app = DrivePanelApp()
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("n")
        await until(pilot, lambda: isinstance(app.screen, Ask))
        await pilot.press(*"fun", "enter")
        assert isinstance(app.screen, Ask)
        await pilot.press("backspace", "backspace", *"an", "enter")
        await until(pilot, lambda: 5 in app.connection.found)
        assert 2 not in app.connection.found


async def test_identification_overrides_the_profile_in_the_settings(
    simulation: Simulation,
) -> None:
    settings(f'[lines.all]\nline = "{rtu_tcp(simulation)}"\nprofile = "powerdrive"\n')
    app = DrivePanelApp(start=rtu_tcp(simulation), device=2)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.chosen is not None)
        assert app.chosen is not None
        assert app.chosen.session.profile.id == "atv71"


def test_names_are_listed_above_ports_without_duplicates() -> None:
    reported = LineSettings(Path("settings.toml"), {"fan": NamedLine("fan", BY_ID, 5)})
    named, serial, *_ = groups([("/dev/ttyUSB0", "")], [], reported)
    assert (named.title, serial.title) == ("Named", "Serial ports")
    (fan,) = named.choices
    assert (fan.text, fan.name, fan.device) == (BY_ID, "fan", 5)
    assert groups([], [], LineSettings(Path("settings.toml")))[0].title == "Serial ports"


@pytest.mark.parametrize(
    ("width", "text"),
    [
        (90, BY_ID),
        (40, "FTDI_FT232R_USB_UART_A50285BI,19200,8E1"),
        (24, "…USB_UART_A50285BI,19200,8E1"[-24:]),
        (20, "…T_A50285BI,19200,8E1"[-20:]),
    ],
)
def test_long_port_name_shows_its_end(width: int, text: str) -> None:
    reported = line_in(BY_ID, width)
    assert len(reported) <= width
    assert reported[1:] == text[1:]
    assert line_in("tcp:192.168.0.10", 10) == "tcp:192.1…"
