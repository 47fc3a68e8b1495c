"""Places where a stop key stops and where it is text; every stop has its own stamp."""

from __future__ import annotations

import asyncio
import inspect
import pkgutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from textual.events import Key, Paste
from textual.widgets import Input

from tui.app import DrivePanelApp
from tui.bus.errors import LineLost
from tui.bus.fake import FakeLine
from tui.bus.shared_state import SharedState
from tui.screens.base import PanelScreen
from tui.screens.connection.line_keys import LineKeys
from tui.screens.connection.scanning import UNPROBED, UNSCANNED
from tui.screens.dialogs.ask import Ask
from tui.screens.frame_source import not_stopped_texts
from tui.screens.key_dispatcher import (
    NOBODY_TO_STOP,
    OTHERS_STOP,
    READ_ONLY_STOPS_NONE,
    SCAN_STOPS,
    STILL_OPENS,
)
from tui.screens.open_lines import LineOpening
from tui.session.command.commander import Commander
from tui.session.command.stop_report import Phase
from tui.session.connect.identify import DriveIdentity, ScanResult
from tui.session.connect.open_line import OpenLine, demo_line
from tui.session.connect.search import Search
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.fleet import Fleet, FoundDrive
from tui.session.journal import Journal
from tui.terminal.reader import KeyReader
from tui.terminal.stroke import Stroke, attach
from tui.terminal.type_ahead import PASTE_IGNORED

from . import fakes
from .fakes import app_of
from .test_command_flows import bench, runs, writes
from .test_flows import picture, shown, until


@pytest.mark.parametrize("field", ["baud", "format", "addresses", "profile", "lines"])
async def test_space_stops_unless_it_is_text(field: str) -> None:
    app = app_of()
    async with app.run_test() as pilot:
        await until(pilot, lambda: bool(app.connection.query(f"#{field}")))
        app.connection.query_one(f"#{field}").focus()
        await pilot.pause()
        before = app.stop_stamp()
        assert app.take_stop_key("space")
        assert app.stop_stamp() != before


@pytest.mark.parametrize("number", [True, False])
async def test_space_stops_in_number_fields_and_is_text_in_names(number: bool) -> None:
    app = app_of()
    async with app.run_test() as pilot:
        app.push_screen(Ask("Save to", str, number=number))
        await until(pilot, lambda: isinstance(app.focused, Input))
        before = app.stop_stamp()
        assert app.take_stop_key("space") is number
        assert (app.stop_stamp() != before) is number


async def test_only_f12_and_f9_stop_in_every_field() -> None:
    app = app_of()
    async with app.run_test() as pilot:
        app.push_screen(Ask("Reference", str))
        await until(pilot, lambda: isinstance(app.focused, Input))
        stamps = [app.stop_stamp()]
        for key in ("f12", "f9"):
            assert app.take_stop_key(key)
            stamps.append(app.stop_stamp())
        assert len(set(map(str, stamps))) == 3
        assert not any(app.take_stop_key(key) for key in ("space", "enter", "r", "f1", "escape"))
        assert app.stop_stamp() == stamps[-1]


async def test_ignored_keys_are_reported_without_markup() -> None:
    app = app_of()
    async with app.run_test() as pilot:
        app.report_ignored_keys(3)
        app.report_ignored_keys(1)
        app.report_ignored_keys(2, late=True)
        await pilot.pause()
        assert [event.text for event in app.events.events] == [
            "Ignored 3 keys that arrived together.",
            "Ignored a key that did not arrive alone.",
            "Ignored 2 keys that arrived too late.",
        ]
        assert not app._notifications, "a toast is for a motor that does not stop"


async def test_stroke_is_known_while_its_key_is_handled() -> None:
    app = app_of()
    async with app.run_test() as pilot:
        seen: list[object] = []
        app.action_help = lambda: seen.append(app.stroke)  # type: ignore[method-assign]
        assert app.stroke is None
        app.post_message(Key("f1", None))
        await until(pilot, lambda: bool(seen))
        (stroke,) = seen
        assert stroke is not None
        await until(pilot, lambda: app.stroke is None)


def shown_text(app: DrivePanelApp) -> str:
    assert isinstance(app.focused, Input)
    return app.focused.value


async def test_paste_outside_a_text_is_ignored_and_reported() -> None:
    app = app_of()
    async with app.run_test() as pilot:
        await until(pilot, lambda: bool(app.connection.query("#lines")))
        app.connection.query_one("#lines").focus()
        await pilot.pause()
        before = app.stop_stamp(), app.screen
        app.post_message(Paste("q \r"))
        await pilot.press("down")
        assert (app.stop_stamp(), app.screen) == before
        texts = [event.text for event in app.events.events]
        assert texts.count(PASTE_IGNORED) == 1
        app.post_message(Paste(""))
        app.push_screen(Ask("Save to", str))
        await until(pilot, lambda: isinstance(app.focused, Input))
        app.post_message(Paste("motor"))
        await until(pilot, lambda: shown_text(app) == "motor")
        assert [event.text for event in app.events.events] == texts


async def test_space_is_text_again_after_a_pending_key_is_handled() -> None:
    app = app_of()
    async with app.run_test() as pilot:
        app.push_screen(Ask("Save to", lambda _: "not that"))
        await until(pilot, lambda: isinstance(app.focused, Input))
        await asyncio.sleep(Ask.SETTLED)
        key, read_at = Key("enter", "\r"), time.monotonic()
        assert app.take_stop_key("space", read_at)  # Enter may still close the text
        attach(key, Stroke(read_at, app.stop_stamp()))
        app.post_message(key)
        await until(pilot, lambda: not app.take_stop_key("space", read_at))
        assert isinstance(app.focused, Input)


async def test_stop_cancels_a_key_in_processing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The screen may take seconds for it if the terminal blocks."""
    app = app_of()
    done: list[str] = []
    monkeypatch.setattr(app, "action_help", lambda: done.append("help"))
    async with app.run_test() as pilot:
        await until(pilot, lambda: bool(app.connection.query("#lines")))
        before = PanelScreen.on_key

        def stopped_during_the_key(screen: PanelScreen, event: Key) -> None:
            app.take_stop_key("f12")
            before(screen, event)

        for on_key, expected in ((stopped_during_the_key, []), (before, ["help"])):
            monkeypatch.setattr(PanelScreen, "on_key", on_key)
            key = Key("question_mark", "?")
            attach(key, Stroke(time.monotonic(), app.stop_stamp()))
            app.post_message(key)
            await until(pilot, lambda: app.stroke is None)
            await pilot.pause()
            assert done == expected


async def test_first_f12_stops_before_it_is_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    app = app_of()
    stamps: list[object] = []
    monkeypatch.setattr(
        "tui.screens.keys.first_keys.remember", lambda: stamps.append(app.stop_stamp())
    )
    async with app.run_test():
        app._trying_f12 = True
        before = app.stop_stamp()
        assert app.take_stop_key("f12")
        assert before not in stamps
        assert stamps


async def test_stop_that_reaches_no_drive_says_so() -> None:
    app = fakes.app_of()
    async with app.run_test(notifications=True) as pilot:
        assert app.take_stop_key("f9")
        await until(pilot, lambda: app.events.newest is not None)
        assert [event.text for event in app.events.events] == [NOBODY_TO_STOP]


@pytest.mark.parametrize(
    ("text", "drives", "expected"),
    [
        ("tcp:10.0.0.5", False, STILL_OPENS.format("tcp:10.0.0.5")),
        ("tcp:10.0.0.5", True, OTHERS_STOP.format("tcp:10.0.0.5")),
        ("replay:day.sqlite", False, NOBODY_TO_STOP),
    ],
)
async def test_stop_of_all_names_the_line_that_is_still_being_opened(
    text: str, drives: bool, expected: str
) -> None:
    app = fakes.app_of()
    async with app.run_test(notifications=True) as pilot:
        if drives:
            app.opened = fakes.opened()
            app.fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, fakes.console_of(None)))
        app.opening = LineOpening(text)
        assert app.take_stop_key("f9")
        app.opening.end()  # the stop was given before
        await until(pilot, lambda: app.events.newest is not None)
        assert [event.text for event in app.events.events] == [expected]


async def test_read_only_panel_promises_no_stop_during_a_scan() -> None:
    app = fakes.app_of()
    app.read_only = True
    async with app.run_test(notifications=True) as pilot:
        app.fleet = fleet = Fleet(FakeLine(read_only=True), Journal(Path()))
        fleet.search = Search(range(1, 10))
        assert app.take_stop_key("f9")
        await until(pilot, lambda: app.events.newest is not None)
        assert [event.text for event in app.events.events] == [READ_ONLY_STOPS_NONE]
        assert not_stopped_texts(app, app.panel_clock.monotonic()) == (READ_ONLY_STOPS_NONE,)
        app.connection._report_unprobed(fleet.search)
        assert app.events.newest is not None
        assert app.events.newest.text == READ_ONLY_STOPS_NONE


async def test_stop_reports_a_device_without_a_known_stop() -> None:
    app = fakes.app_of()
    async with app.run_test(notifications=True) as pilot:
        app.opened = fakes.opened()
        app.fleet = fakes.StillFleet(
            FoundDrive(fakes.ATV71, fakes.console_of(None)),
            FoundDrive(replace(fakes.ATV71, device=7)),
        )
        for _ in range(2):
            assert app.take_stop_key("f9")
            await until(pilot, lambda: app.stroke is None)
            await pilot.pause()
        reported = [event for event in app.events.events if event.kind == "failed"]
        assert {event.text.partition(",")[0] for event in reported} == {"NOT STOPPED: device 7"}
        assert not app._notifications, "nothing may lie over it, and it over nothing else"
        (text,) = app.frame_now().not_stopped
        assert text.startswith("NOT STOPPED: device 7")
        app.chosen = app.fleet.consoles[0]
        assert app.take_stop_key("space")  # one drive is the target, and is reached
        await pilot.pause()
        assert [event for event in app.events.events if event.kind == "failed"] == reported


@pytest.mark.parametrize("passed", [(SharedState, "commander"), (Commander, "arm")])
async def test_stop_while_arming_leaves_the_drive_disarmed(
    monkeypatch: pytest.MonkeyPatch, passed: tuple[type, str]
) -> None:
    """The keys are read in their own thread: a stop may arrive at any point of this code."""
    kind, name = passed
    async with bench("atv71") as made:
        goes_on, stops = getattr(kind, name), iter(["f12"])

        def after_a_stop(*given: Any, **named: Any) -> Any:
            # drawing reads the commander, too, and may do so before the key
            if sys._getframe(1).f_code.co_name == "action_arm":
                for key in stops:
                    made.app.take_stop_key(key)
            return goes_on(*given, **named)

        monkeypatch.setattr(kind, name, after_a_stop)
        await made.pilot.press("a")
        await made.stopped()
        assert made.app.chosen is not None
        assert not made.app.chosen.session.arming.armed
        await made.armed()


PLANTED = (
    "tui.screens.key_dispatcher.takes_space",
    "tui.screens.key_dispatcher.is_too_small",
    "tui.screens.key_dispatcher.soon_in_loop",
    "tui.screens.key_dispatcher.carried_on",
    "tui.screens.key_dispatcher.every_fleet",
    "tui.screens.key_dispatcher.KeyDispatcher._open_drive",
    "tui.screens.key_dispatcher.KeyDispatcher._stop_sessions",
    "tui.screens.key_dispatcher.KeyDispatcher._stop",
    "tui.screens.key_dispatcher.KeyDispatcher._space_is_text",
    "tui.screens.key_dispatcher.KeyDispatcher.take_stop_key",
    "tui.app.DrivePanelApp.hurry",
    "tui.screens.app_port.Panel.fleets",
    "tui.session.fleet.Fleet.stop",
    "tui.session.fleet.Fleet.sessions",
    "tui.session.fleet.Fleet.consoles",
    "tui.terminal.reader.KeyReader._sorted",
    "tui.terminal.reader.Tokenizer.feed",
)


def waiting(app: DrivePanelApp) -> bool:
    """True if a stop was not acknowledged yet."""
    assert app.fleet is not None
    return any(
        not work.stop.sent and not work.stop.over for work in app.fleet.stopper._under_way.values()
    )


@pytest.mark.internal_errors
async def test_error_after_a_stop_key_does_not_prevent_its_frame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def failing(*_: object, **__: object) -> None:
        raise RuntimeError("planted")

    async with bench("atv31") as made:
        missing = []
        for place in PLANTED:
            for key in (b" ", b"\x1b[24~", b"\x1b[20~"):
                owner, _, name = place.rpartition(".")
                before = time.monotonic()
                with monkeypatch.context() as patch:
                    held = inspect.getattr_static(pkgutil.resolve_name(owner), name)
                    planted = property(failing) if isinstance(held, property) else failing
                    patch.setattr(place, planted)
                    KeyReader(made.app).read(key, before, made.app.stop_stamp())
                for _ in range(200):
                    await asyncio.sleep(0.0 if writes(made.app, before) else 0.05)
                if not writes(made.app, before):
                    missing.append(f"{place}, {key!r}")
                # a stop without a reply to its frame is not restarted by the next key
                await until(made.pilot, lambda: not waiting(made.app))
        assert not missing


async def test_not_stopped_message_is_never_covered() -> None:
    """Armed, in a question and on each size: its commander and where to stop it, uncut."""
    reported = (
        "drive 1: its command source is Terminals (Fr1), not Modbus. Stop it there or at the"
        " machine."
    )
    async with bench("atv31", sets={"CHCF": 1, "Fr1": 1}) as made:
        made.drive().set_input("LI1", "1")
        made.drive().set_input("AI1", "5")
        await until(made.pilot, lambda: made.speed() > 2 and runs(made.app))
        assert made.app.take_stop_key("space")
        await until(made.pilot, lambda: "NOT STOPPED" in shown(made.app, "said"))
        assert made.drive().motor.frequency > 1
        for size in ((60, 16), (80, 24), (120, 40)):
            await made.pilot.resize_terminal(*size)
            for keys in ([], ["a"], ["question_mark"], ["escape"]):
                await made.pilot.press(*keys)
                made.app.look_around()
                await made.pilot.pause()
                screen = " ".join(line.strip() for line in picture(made.app).splitlines())
                assert f"NOT STOPPED, {reported}" in " ".join(screen.split()), (size, keys)
                assert not made.app._notifications
        made.drive().set_input("LI1", "0")
        await until(made.pilot, lambda: "NOT STOPPED" not in picture(made.app))


async def test_stop_of_all_during_a_scan_stops_drives_that_it_finds_afterwards(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    take, reported = Fleet.take, list[str]()

    def take_and_stop(self: Fleet, session: DriveSession, *found: Any, **how: Any) -> DriveConsole:
        console = take(self, session, *found, **how)
        if session.device == 1:
            assert app.take_stop_key("f9")  # only this drive is known yet
            reported.extend(not_stopped_texts(app, app.panel_clock.monotonic()))
        return console

    monkeypatch.setattr(Fleet, "take", take_and_stop)
    opened = demo_line({"atv71": 30.0, "atv312": 30.0})
    app = DrivePanelApp(open_line=lambda *_, **__: opened, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.fleet is not None and len(app.fleet.stopper.reports) == 2)
        assert app.fleet is not None
        assert SCAN_STOPS in [event.text for event in app.events.events]
        assert any("NOT STOPPED YET, addresses " in text for text in reported), reported
        stopper = app.fleet.stopper
        await until(pilot, lambda: stopper.reports[2].phase in (Phase.STOPPING, Phase.STOPPED))
        assert app.fleet.search is not None
        await until(pilot, lambda: app.fleet.search.ended == "done")  # type: ignore[union-attr]
        assert not [event for event in app.events.events if "NOT STOPPED" in event.text]
        assert not_stopped_texts(app, app.panel_clock.monotonic()) == ()


@pytest.mark.parametrize("moment", ["connects", "open"])
async def test_scan_stops_drives_after_a_stop_of_all_while_its_line_is_opened(
    monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    goes_on, opened = LineKeys._addresses_here, demo_line({"atv71": 30.0, "atv312": 30.0})

    def opener(*_: object, **__: object) -> OpenLine:
        if moment == "connects":
            assert app.take_stop_key("f9")
        return opened

    def stopped(self: LineKeys) -> str:
        if moment == "open":
            assert app.take_stop_key("f9")
            assert self.app.fleet is not None
            assert self.app.fleet.search is None
        return goes_on(self)

    monkeypatch.setattr(LineKeys, "_addresses_here", stopped)
    app = DrivePanelApp(open_line=opener, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.fleet is not None and len(app.fleet.stopper.reports) == 2)
        assert STILL_OPENS.format("demo") in [event.text for event in app.events.events]
        assert app.fleet is not None
        stopper, search = app.fleet.stopper, app.fleet.search
        await until(pilot, lambda: search is not None and search.ended == "done")
        assert not [event for event in app.events.events if "NOT STOPPED" in event.text]
        app.connection.action_scan()
        await until(pilot, lambda: app.fleet.search is not search)  # type: ignore[union-attr]
        assert not app.fleet.search.stops_found  # type: ignore[union-attr]
        sent = {Phase.STOPPING, Phase.STOPPED}
        await until(pilot, lambda: {it.phase for it in stopper.reports.values()} <= sent)
        assert not [event for event in app.events.events if "NOT STOPPED" in event.text]


async def test_stop_of_all_before_a_line_that_does_not_open_is_reported() -> None:
    def refused(*_: object, **__: object) -> OpenLine:
        assert app.take_stop_key("f9")
        raise LineLost("no such port.")

    app = DrivePanelApp(open_line=refused, start="tcp:10.0.0.5")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: bool(app.unreached[0]))
        assert app.unreached[0] == UNSCANNED.format("tcp:10.0.0.5")


async def test_scan_that_ends_early_after_a_stop_of_all_names_what_it_has_not_reached() -> None:
    app = app_of()
    async with app.run_test():
        search = Search(range(1, 32))
        app.connection._report_unprobed(search)
        assert app.events.newest is None, "nobody has stopped all"
        search.stops_found, search._probed = True, 11
        app.connection._report_unprobed(search)
        assert app.events.newest is not None
        assert app.events.newest.text == app.unreached[0] == UNPROBED.format("12-31")


async def test_drive_found_without_a_profile_after_a_stop_of_all_is_reported() -> None:
    app = app_of()
    async with app.run_test():
        app.fleet = fleet = Fleet(FakeLine(), Journal(Path()))
        fleet.search = Search(range(1, 10))
        unknown = DriveIdentity(5, "", "", "", "", None, ())
        await app.connection._take(ScanResult(5, unknown))
        assert not app.unreached[0]
        fleet.search.stops_found = True
        await app.connection._take(ScanResult(5, unknown))
        assert app.unreached[0].startswith("NOT STOPPED: device 5, not identified.")
        await app.connection._take(ScanResult(6, None, "Damaged."))
        assert app.events.newest is not None
        assert "It was sent no stop." in app.events.newest.text
