"""Pictures of Line in every state: no line, ports, searching, a wall of drives, lost ones."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import pytest
from textual.pilot import Pilot

from tui.bus.api import Contact, DeviceCounters, LastMinute, LineState
from tui.bus.errors import PortBusy
from tui.bus.program import KEEPER, Program
from tui.screens.open_lines import LineOpening
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.known_line import KnownLine
from tui.session.connect.known_lines import DriveMark, LineMark, LinesMemory, keep_memory
from tui.session.connect.line_key import line_key
from tui.session.connect.named_lines import settings_file
from tui.session.connect.search import Search
from tui.session.events import EventLog
from tui.session.fleet import FoundDrive
from tui.session.monitor.look import Look
from tui.session.monitor.trend import Trend, TrendPoint
from tui.session.paths import remember_line

from . import fakes
from .test_pictures import LARGE, SMALL

Compare = Callable[..., bool]
PORTS = [("/dev/ttyUSB0", "USB-RS485 adapter"), ("/dev/ttyS0", "")]
MODELS = ("ATV312HU09M3", "ATV21H075M3X", "ATV71HU15M3")
LONG_AGO = 1_600_000_031.0
"""Time of all messages, as time.time(): a warning has several lines while it is new."""
ADAPTER = "serial:/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0,19200,8E1"
SETTINGS = f"""
[lines]
pump = "{ADAPTER.replace("A50285BI", "AB0LQ2KX")}"
fan = {{ line = "tcp:192.168.0.10", device = 5, profile = "powerdrive" }}
old = 3
"""
OVERBRAKING, OVERLOAD = 18, 20
"""Raw fault codes of the Altivar 71: ObF, OLF."""


@pytest.fixture(autouse=True)
def same_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same serial ports on every machine."""
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", lambda: list(PORTS))
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")


def drive(device: int, looks: dict[int, Look], how: dict[str, int], age: float) -> FoundDrive:
    """A drive of the wall, as a look that is so old saw it."""
    name = f"PUMP {device:02}" if device % 3 == 0 else ""
    identity = replace(fakes.ATV71, device=device, reference=MODELS[device % 3], name=name)
    console = fakes.console_of(None, device=device)
    console.session.image.confirm("INV", 75, fakes.NOW)
    console.monitor = fakes.StillMonitor(console.session, None, minute_of(device, how, age))
    looks[device] = fakes.look_of(how, age=age)
    return FoundDrive(identity, console)


def minute_of(device: int, how: dict[str, int], age: float) -> list[TrendPoint]:
    """The last minute of a motor that has another frequency since some seconds."""
    now, change = how["RFR"] / 10, 20.0 + 7 * device % 30
    before = 0.0 if device % 2 else now * 0.7
    return [
        TrendPoint(fakes.NOW - back, (now if back < change else before, None, None))
        for back in range(60, int(age), -3)
    ]


def wall(count: int, *, line: LineState = fakes.CONNECTED) -> fakes.StillFleet:
    """This many drives; of more than 17 two are in fault, and the 17th tripped last."""
    looks: dict[int, Look] = {}
    drives = []
    for device in range(1, count + 1):
        how = {**fakes.RUNNING, "RFR": 190 + 37 * device % 300, "LCR": 15 + 11 * device % 66}
        how = fakes.READY if device % 5 == 4 else how
        if count > 17 and device in (3, 17):
            how = {**fakes.FAULT, "LFT": OVERLOAD if device == 17 else OVERBRAKING}
        drives.append(drive(device, looks, how, age=device * 7 % 4))
    fleet = fakes.StillFleet(*drives, line_watch=fakes.FakeLineWatch(looks=looks), line=line)
    fleet.search = Search(range(1, max(count, 10) + 1))
    fleet.search.ended, fleet.search.answered = "done", frozenset(range(1, count + 1))
    return fleet


async def show(app: Any, pilot: Pilot[None], fleet: Any, line: LineState) -> None:
    app.opened, app.fleet = fakes.opened(line), fleet
    app.events = EventLog(lambda: LONG_AGO)
    if fleet is not None:
        fleet.alarms._events = app.events
        watch = fleet.line_watch
        watch.tripped_at = LONG_AGO
        fleet.alarms.take(
            {d: s for d, s in watch.states.items() if d != 17}, watch.onsets.by_device
        )
        app.look_around()
    screen = app.connection
    screen.form.offer_addresses("1-31" if fleet and len(fleet.found) > 10 else "1-10")
    screen._redraw()
    if screen.found:
        screen.drives.focus()
    await pilot.pause()
    screen.look()
    app.draw_frame()
    await pilot.pause()


async def no_line(app: Any, pilot: Pilot[None]) -> None:
    await pilot.pause()


async def named(app: Any, pilot: Pilot[None]) -> None:
    path = settings_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(SETTINGS, "utf-8")
    remember_line(ADAPTER)
    app.connection.action_refresh_lines()
    await pilot.pause()


async def another_drive(app: Any, pilot: Pilot[None]) -> None:
    fleet = wall(5)
    await show(app, pilot, fleet, fakes.CONNECTED)
    line = fleet.line
    drives = {2: DriveMark("Schneider Electric", "ATV31H037M2", "0104", "MIXER", "atv31")}
    keep_memory(LinesMemory({line_key("/dev/ttyUSB0"): LineMark("", drives)}))
    app.opened.known = KnownLine(line)
    app.opened.known.note(fleet.found[2].identity, 2, "atv21")
    app.look_around()
    app.draw_frame()
    await pilot.pause()


async def read_only(app: Any, pilot: Pilot[None]) -> None:
    app.read_only = True
    app.connection.look()
    app.draw_frame()
    await pilot.pause()


async def opening(app: Any, pilot: Pilot[None]) -> None:
    app.opening = LineOpening("serial:/dev/ttyUSB0,19200,8E1")
    app.connection.tell_opening("serial:/dev/ttyUSB0,19200,8E1")
    await pilot.pause()


async def busy(app: Any, pilot: Pilot[None]) -> None:
    app.events = EventLog(lambda: LONG_AGO)
    app.connection.fail(PortBusy("/dev/ttyUSB0", "mbpoll (pid 4711)"))
    app.connection.look()
    app.draw_frame()
    await pilot.pause()


async def searching(app: Any, pilot: Pilot[None]) -> None:
    fleet = wall(0)
    fleet.search = Search(range(1, 32))
    fleet.search.requested = fleet.search.at = 7
    app.connection.tell_search()
    await show(app, pilot, fleet, fakes.CONNECTED)


async def searching_found(app: Any, pilot: Pilot[None]) -> None:
    fleet = wall(3)
    fleet.search = Search(range(1, 32))
    fleet.search.requested = fleet.search.at = 7
    fleet.search.answered = frozenset(range(1, 4))
    await show(app, pilot, fleet, fakes.CONNECTED)


async def nobody(app: Any, pilot: Pilot[None]) -> None:
    fleet = wall(0)
    fleet.search = Search(range(1, 11))
    fleet.search.ended = "done"
    await show(app, pilot, fleet, fakes.CONNECTED)
    app.connection.sum_up(range(1, 11))
    app.draw_frame()
    await pilot.pause()


async def five(app: Any, pilot: Pilot[None]) -> None:
    fleet = wall(5)
    unknown = DriveIdentity(8, "", "", "", "", None, ("powerdrive", "proxidrive", "varmeca"))
    fleet.hold(FoundDrive(unknown))
    await show(app, pilot, fleet, fakes.CONNECTED)


async def thirty_one(app: Any, pilot: Pilot[None]) -> None:
    await show(app, pilot, wall(31), fakes.CONNECTED)


async def lost_drive(app: Any, pilot: Pilot[None]) -> None:
    fleet = wall(5)
    looks: dict[int, Look] = fleet.line_watch.looks  # type: ignore[assignment]
    for device, age in ((2, 47.0), (4, 5.0)):
        before = replace(looks[device], time=fakes.NOW - age)
        monitor = fleet.found[device].console.monitor  # type: ignore[union-attr]
        points = [p for p in monitor.trend if p.time < fakes.NOW - age]
        monitor._trend = Trend(
            monitor.profile, [*points, TrendPoint(fakes.NOW - age + 3, (None,) * 3, "lost")]
        )
        looks[device] = Look(
            None, "Device did not answer.", fakes.NOW - 1, None, {}, before, "silent"
        )
    await show(app, pilot, fleet, fakes.CONNECTED)


async def not_answering(app: Any, pilot: Pilot[None]) -> None:
    fleet = wall(5)
    looks: dict[int, Look] = fleet.line_watch.looks  # type: ignore[assignment]
    contacts: tuple[Contact, ...] = ("silent", "refused", "damaged")
    for device, contact in enumerate(contacts, start=2):
        looks[device] = Look(None, "In vain.", fakes.NOW - 1, None, {}, None, contact)
    del looks[5]
    await show(app, pilot, fleet, fakes.CONNECTED)


async def shared(app: Any, pilot: Pilot[None]) -> None:
    await show(app, pilot, wall(5), fakes.CONNECTED)
    line = app.opened.line
    others = [Program("2", "serve", 812), Program("3", "watch", 902), Program("4", "watch", 977)]
    line.facts.set_programs((line.facts.me, *others, Program("5", KEEPER, 811)))
    shares = {line.facts.me.id: 0.08, "2": 0.61, "3": 0.09}
    line.counters = replace(line.counters, programs=shares)
    app.connection.show_about()
    await pilot.pause()


async def poor_line(app: Any, pilot: Pilot[None]) -> None:
    fleet = wall(5)
    minutes = {device: DeviceCounters(minute=LastMinute(good=102)) for device in (1, 3, 4, 5)}
    minutes[2] = DeviceCounters(minute=LastMinute(good=81, lost=38, damaged=3, strays=2))
    line = LastMinute(good=489, lost=38, damaged=3, foreign=14, strays=2)
    counters = replace(fakes.COUNTED, minute=line, devices=minutes)
    await show(app, pilot, fleet, fakes.CONNECTED)
    app.opened.line.counters = counters
    for kind, text in fleet.health.look(counters):
        app.events.add(kind, text)
    await pilot.press("down")
    app.connection.look()
    app.draw_frame()
    await pilot.pause()


async def line_lost(app: Any, pilot: Pilot[None]) -> None:
    await show(app, pilot, wall(5, line=fakes.LOST), fakes.LOST)


async def wrong_addresses(app: Any, pilot: Pilot[None]) -> None:
    await show(app, pilot, wall(5), fakes.CONNECTED)
    await pilot.press("c", "1", "-", "enter")
    await pilot.pause()
    app.connection.look()  # the list of drives has another width now
    app.draw_frame()
    await pilot.pause()


async def address(app: Any, pilot: Pilot[None]) -> None:
    await show(app, pilot, wall(5), fakes.CONNECTED)
    await pilot.press("full_stop", "3")
    await pilot.pause()


async def dialog(_: Any, pilot: Pilot[None]) -> None:
    await pilot.press("n")
    await pilot.press(*"modbus", "enter")
    await pilot.pause()


STATES: dict[str, Callable[[Any, Pilot[None]], Awaitable[None]]] = {
    "no-line": no_line,
    "named": named,
    "another-drive": another_drive,
    "read-only": read_only,
    "opening": opening,
    "busy": busy,
    "searching": searching,
    "searching-found": searching_found,
    "nobody": nobody,
    "five": five,
    "thirty-one": thirty_one,
    "lost-drive": lost_drive,
    "not-answering": not_answering,
    "shared": shared,
    "poor-line": poor_line,
    "line-lost": line_lost,
    "wrong-addresses": wrong_addresses,
    "address": address,
    "dialog": dialog,
}
USUAL = [
    pytest.param(state, *size.values, id=f"{state}-{size.id}", marks=size.marks)
    for state in STATES
    for size in (SMALL, LARGE)
]
OTHERS = [
    pytest.param(state, size, marks=marks)
    for state in ("no-line", "thirty-one")
    for size, marks in (((60, 16), ()), ((200, 60), pytest.mark.sweep))
]


@pytest.mark.parametrize(
    ("state", "size"),
    [*USUAL, *OTHERS],
    ids=lambda item: item if isinstance(item, str) else f"{item[0]}x{item[1]}",
)
def test_line(snap_compare: Compare, state: str, size: tuple[int, int]) -> None:
    app = fakes.app_of()

    async def shown(pilot: Pilot[None]) -> None:
        await pilot.pause()
        await STATES[state](app, pilot)

    assert snap_compare(app, terminal_size=size, run_before=shown)
