"""Listening as a mode of Frames: nothing is sent, and where the panel may not fall silent."""

from __future__ import annotations

import threading
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any, cast

import pytest
from textual.pilot import Pilot

from tests.bus.peer import PtyPeer, Step, silent
from tui.app import DrivePanelApp
from tui.bus.link import Link, SerialLink, TcpLink
from tui.drive.profile import library
from tui.screens.dialogs.confirm import Confirm
from tui.screens.frames.heard import ListeningScreen
from tui.screens.hear import why_not_hear
from tui.session.connect import address_prober
from tui.session.connect.identify import DriveIdentity
from tui.session.fleet import Fleet, FoundDrive
from tui.session.listening.background import BackgroundListener, PortListener
from tui.session.listening.families import Families
from tui.session.listening.summary import ListeningSummary
from tui.simulator import DriveSpec, Simulation
from tui.wire.frames import frame, read_frame

from . import fakes
from .test_flows import shown, until
from .test_pictures import BOTH_SIZES

pytestmark = pytest.mark.long

ATV71 = frame(6, bytes.fromhex("2b 0e 01 01 00 00 01 01 0b") + b"ATV71HU15M3")
"""Identification of the drive at 6."""


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", list)
    monkeypatch.setattr("tui.session.connect.other_masters.LISTEN", 0.5)
    monkeypatch.setattr(address_prober, "JITTER", 0.25)


def output(app: DrivePanelApp) -> str:
    return "\n".join(event.text for event in app.events.events)


def talk(peer: PtyPeer) -> None:
    """A master identifies and reads the drive at 6, and gives it a reference."""
    exchanges = (
        (frame(6, bytes.fromhex("2b 0e 01 00")), ATV71),
        (read_frame(6, 3201, 1), frame(6, bytes.fromhex("03 02 0637"))),
        (frame(6, bytes.fromhex("06 2136 012c")), frame(6, bytes.fromhex("06 2136 012c"))),
    )
    for request, reply in exchanges:
        peer.send(request)
        peer.send(reply)


async def heard(app: DrivePanelApp, pilot: Pilot[None], peer: PtyPeer) -> None:
    """H was pressed: the screen is open, and shows the traffic."""
    await until(pilot, lambda: isinstance(app.screen, ListeningScreen))
    talk(peer)
    await until(pilot, lambda: "6 write LFR ← 30.0 Hz" in shown(app, "frames"))
    assert "← 6 ETA 16#0637" in shown(app, "frames")


async def test_closed_line_is_monitored_and_released() -> None:
    with PtyPeer(silent) as peer:
        app = DrivePanelApp()
        async with app.run_test(size=(80, 24)) as pilot:
            app.connection.lines.offer(f"{peer.path},19200,8E1")
            await pilot.press("H")
            await heard(app, pilot, peer)
            assert "listening" in shown(app, "strip")
            # the commander, and the margin
            await pilot.press("tab", "tab")
            await until(pilot, lambda: "Device 6: Altivar 71" in shown(app, "frames"))
            page = " ".join(shown(app, "frames").split())
            assert "commanded by the master: LFR 30.0 Hz once" in page
            assert "TTO 10 s" in page
            # there is no stop, and that is said
            assert "cannot stop here" in shown(app, "keys")
            await pilot.press("space")
            await until(pilot, lambda: "No stop is sent" in output(app))
            await pilot.press("escape")
            await until(pilot, lambda: app.screen is app.connection)
            assert not app.hearing
            assert peer.requests == []
            # the port is free again immediately
            await pilot.press("H")
            await until(pilot, lambda: isinstance(app.screen, ListeningScreen))
            await pilot.press("1")
            await until(pilot, lambda: app.screen is app.connection and not app.hearing)


async def test_second_key_while_opening_leaves_no_monitor_behind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A slow computer opens it for a while: a second listener would keep the port for ever."""
    opens, may_open = BackgroundListener.open, threading.Event()

    def slow(heard: BackgroundListener) -> None:
        may_open.wait(10)
        opens(heard)

    monkeypatch.setattr(BackgroundListener, "open", slow)
    with PtyPeer(silent) as peer:
        app = DrivePanelApp()
        async with app.run_test(size=(80, 24)) as pilot:
            app.connection.lines.offer(f"{peer.path},19200,8E1")
            await pilot.press("H")
            await pilot.pause(0.2)
            await pilot.press("H")
            await until(pilot, lambda: "keys are ignored until it is open" in output(app))
            may_open.set()
            await until(pilot, lambda: isinstance(app.screen, ListeningScreen))
            await pilot.press("H")
            await until(pilot, lambda: "already listening" in output(app))
            await pilot.press("escape")
            await until(pilot, lambda: app.screen is app.connection)
            assert not [thread for thread in threading.enumerate() if thread.name == "listening"]
            # canceled while it opens: nothing listens, and the port is free again
            may_open.clear()
            await pilot.press("H")
            await until(pilot, lambda: app.opening.goes_on)
            await pilot.press("escape")
            await until(pilot, lambda: "was canceled" in output(app))
            may_open.set()
            await until(pilot, lambda: not app.hearing)
            assert not [thread for thread in threading.enumerate() if thread.name == "listening"]
            assert app.screen is app.connection
            await pilot.press("H")
            await heard(app, pilot, peer)


async def test_monitoring_is_offered_if_another_master_is_active() -> None:
    with PtyPeer(silent) as peer:
        app = DrivePanelApp(start=f"{peer.path},19200,8E1")
        async with app.run_test(size=(80, 24)) as pilot:
            await until(pilot, lambda: "Listening" in app.connection._advice[0])
            talk(peer)
            await until(pilot, lambda: "Another master polls" in output(app))
            await until(pilot, lambda: "Press H to listen" in shown(app, "message"))
            await pilot.press("H")
            await heard(app, pilot, peer)
            assert not app.panel_lines
            assert peer.requests == []


@asynccontextmanager
async def panel_with(
    spec: DriveSpec,
) -> AsyncIterator[tuple[DrivePanelApp, Pilot[None], PtyPeer]]:
    """The panel on a line with one drive, whose timeout it knows."""
    simulation = Simulation([spec], any_settings=True)

    def script(request: bytes, _count: int) -> Sequence[Step]:
        reply = simulation.line.receive(request)
        return [reply.data] if reply is not None else []

    with simulation, PtyPeer(script) as peer:
        app = DrivePanelApp(start=f"{peer.path},19200,8E1", device=spec.address)
        async with app.run_test(size=(80, 24)) as pilot:
            await until(pilot, lambda: app.chosen is not None and app.fleet is not None)
            assert app.fleet is not None
            fleet = app.fleet
            await until(pilot, lambda: bool(fleet.line_watch.looks))
            await until(pilot, lambda: not fleet.line_watch.unread())
            yield app, pilot, peer


async def test_drive_kept_alive_by_the_panel_blocks_monitoring() -> None:
    async with panel_with(DriveSpec("atv21", 1)) as (app, pilot, peer):
        await pilot.press("7", "H")
        await until(pilot, lambda: "Not monitored: the panel keeps drives alive" in output(app))
        assert "Device 1, Altivar 21: on loss of communication it acts 3 s after" in output(app)
        requested = len(peer.requests)
        await until(pilot, lambda: len(peer.requests) > requested + 2)
        assert not app.hearing


async def test_monitoring_pauses_polling_after_confirmation() -> None:
    async with panel_with(DriveSpec("atv71", 6)) as (app, pilot, peer):
        await pilot.press("H")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        await pilot.press("n")
        await until(pilot, lambda: not isinstance(app.screen, Confirm))
        assert app.panel_lines
        await pilot.press("H")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        await pilot.pause(0.4)  # a yes counts once the question has been open long enough
        await pilot.press("y")
        await heard(app, pilot, peer)
        requested = len(peer.requests)
        talk(peer)
        await pilot.pause(0.5)
        assert len(peer.requests) == requested


# Where the panel may not fall silent


@dataclass
class Watch:
    """Result of a look at all drives."""

    commanded: list[Any] = field(default_factory=list)
    acting: dict[int, Any] = field(default_factory=dict)
    not_read: list[Any] = field(default_factory=list)

    def under_command(self) -> list[Any]:
        return self.commanded

    def pending_timeouts(self) -> dict[int, Any]:
        return self.acting

    def unread(self) -> list[Any]:
        return self.not_read


def fleet_of(watch: Watch, *drives: FoundDrive, link: Link | None = None) -> Fleet:
    fleet = fakes.StillFleet(*drives)
    line = cast("Any", fleet.line)
    line.link = link or SerialLink("/dev/ttyUSB0", 19200, "8E1")
    cast("Any", fleet).line_watch = watch
    return cast("Fleet", fleet)


def test_reasons_that_block_monitoring_are_named() -> None:
    console = fakes.console_of(None)
    found, session = FoundDrive(fakes.ATV71, console), console.session
    nameless = DriveIdentity(9, "", "", "", "", None, ())
    assert why_not_hear(fleet_of(Watch(), found)) == ""
    network = fleet_of(Watch(), found, link=TcpLink("192.168.0.10"))
    assert why_not_hear(network).endswith("of this connection.")
    running = why_not_hear(fleet_of(Watch(commanded=[session]), found))
    assert "this panel commands a running motor" in running
    assert "has not been read" in why_not_hear(fleet_of(Watch(not_read=[session]), found))
    unknown = why_not_hear(fleet_of(Watch(), found, FoundDrive(nameless)))
    assert "device 9" in unknown
    assert "close the line first" in unknown


# How it looks


class StillHearing(BackgroundListener):
    """Recorded traffic: the same frames and figures each time."""

    def __init__(self) -> None:
        super().__init__("serial:/dev/ttyUSB0,19200,8E1", "panel")
        self.link = SerialLink("/dev/ttyUSB0", 19200, "8E1")
        place = cast("Any", type("Place", (), {"link": self.link, "character": 11 / 19200}))
        place.silence = 3.5 * 11 / 19200
        self._families = Families([library.load(text) for text in ("atv21", "atv71")])
        self._port_listener = PortListener(place, self._families, lambda _: None, self._keep)
        self._port_listener.listener.tally.begun = fakes.NOW - 30
        for number in range(12):
            self._say(fakes.NOW - 24 + 2 * number)

    def _say(self, at: float) -> None:
        """A cycle of a master: one drive polled in time, and one not."""
        cycle = (
            (read_frame(1, 0xFD00, 1), frame(1, bytes.fromhex("03 02 0bb8"))),
            (frame(6, bytes.fromhex("2b 0e 01 00")), ATV71),
            (read_frame(6, 3201, 1), frame(6, bytes.fromhex("03 02 0637"))),
            (frame(6, bytes.fromhex("06 2136 012c")), frame(6, bytes.fromhex("06 2136 012c"))),
            (read_frame(9, 3201, 1), b""),
        )
        for number, (request, reply) in enumerate(cycle):
            for part, data in enumerate((request, reply)):
                if data:
                    self._port_listener.take(data, at + 0.05 * number + 0.02 * part)
        self._port_listener.take(b"", at + 1.5)

    def summary(self) -> ListeningSummary:
        return self._port_listener.summary(fakes.NOW)

    def close(self) -> None:
        """Nothing was opened."""


@BOTH_SIZES
@pytest.mark.parametrize("page", ["words", "sum"])
def test_pictures(snap_compare: Callable[..., bool], page: str, size: tuple[int, int]) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    app.hearing = "serial:/dev/ttyUSB0,19200,8E1"

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(ListeningScreen(StillHearing()))
        await pilot.pause()
        if page == "sum":
            await pilot.press("tab", "tab")
        app.draw_frame()
        app.screen.look()  # type: ignore[attr-defined]
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


@pytest.mark.parametrize(("lines", "top"), [(-1, 4), (1, 6), (-10, 0), (10, 15)])
def test_up_scrolls_the_summary_up(lines: int, top: int) -> None:
    """The arguments are those of the keys Up, Down, PgUp and PgDn."""
    screen = ListeningScreen.__new__(ListeningScreen)
    screen._page, screen._top = "sum", 5
    screen.look = lambda: None  # type: ignore[method-assign]
    screen.action_scroll(lines)
    assert screen._top == top
