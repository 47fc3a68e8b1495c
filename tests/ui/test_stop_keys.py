"""Where a stop key stops and where it is text, and that every stop has a stamp of its own."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from typing import Any

import pytest
from textual.events import Key, Paste
from textual.widgets import Input

from tui.bus.shared_facts import SharedFacts
from tui.screens.base import PanelScreen
from tui.screens.dialogs.ask import Ask
from tui.screens.hands import NOBODY_TO_STOP
from tui.session.command.commander import Commander
from tui.session.fleet import FoundDrive
from tui.terminal.stroke import Stroke, attach

from . import fakes
from .fakes import app_of
from .test_command_flows import bench
from .test_flows import until


@pytest.mark.parametrize("field", ["baud", "format", "addresses", "profile", "lines"])
async def test_space_stops_where_a_space_is_no_text(field: str) -> None:
    app = app_of()
    async with app.run_test() as pilot:
        await until(pilot, lambda: bool(app.connection.query(f"#{field}")))
        app.connection.query_one(f"#{field}").focus()
        await pilot.pause()
        before = app.stop_stamp()
        assert app.take_stop_key("space")
        assert app.stop_stamp() != before


@pytest.mark.parametrize("number", [True, False])
async def test_space_stops_where_a_number_is_asked_for_and_is_text_in_a_name(number: bool) -> None:
    app = app_of()
    async with app.run_test() as pilot:
        app.push_screen(Ask("Save to", str, number=number))
        await until(pilot, lambda: isinstance(app.focused, Input))
        before = app.stop_stamp()
        assert app.take_stop_key("space") is number
        assert (app.stop_stamp() != before) is number


async def test_f12_and_f9_stop_in_every_field_and_nothing_else_does() -> None:
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


async def test_keys_that_were_not_taken_are_told_of_without_markup() -> None:
    app = app_of()
    async with app.run_test() as pilot:
        app.keys_not_taken(3)
        app.keys_not_taken(1)
        app.keys_not_taken(2, late=True)
        await pilot.pause()
        assert [event.text for event in app.events.events] == [
            "3 keys came at once and were not taken.",
            "1 key did not come alone and was not taken.",
            "2 keys came too late and were not taken.",
        ]
        assert not app._notifications, "a toast is for a motor that does not stop"


async def test_what_is_known_of_a_key_is_known_while_it_has_its_effect() -> None:
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


async def test_a_paste_outside_of_a_text_is_nothing() -> None:
    app = app_of()
    async with app.run_test() as pilot:
        await until(pilot, lambda: bool(app.connection.query("#lines")))
        app.connection.query_one("#lines").focus()
        await pilot.pause()
        before = app.stop_stamp(), app.screen
        app.post_message(Paste("q \r"))
        await pilot.press("down")
        assert (app.stop_stamp(), app.screen) == before


async def test_space_is_text_again_once_a_key_that_may_leave_has_had_its_effect() -> None:
    app = app_of()
    async with app.run_test() as pilot:
        app.push_screen(Ask("Save to", lambda _: "not that"))
        await until(pilot, lambda: isinstance(app.focused, Input))
        await asyncio.sleep(Ask.SETTLED)
        key, read_at = Key("enter", "\r"), time.monotonic()
        assert app.take_stop_key("space", read_at)  # Enter may close the text yet
        attach(key, Stroke(read_at, app.stop_stamp()))
        app.post_message(key)
        await until(pilot, lambda: not app.take_stop_key("space", read_at))
        assert isinstance(app.focused, Input)


async def test_a_stop_voids_a_key_that_is_on_its_way_through_the_screen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The screen may take seconds for it, where the terminal takes nothing."""
    app = app_of()
    done: list[str] = []
    monkeypatch.setattr(app, "action_help", lambda: done.append("help"))
    async with app.run_test() as pilot:
        await until(pilot, lambda: bool(app.connection.query("#lines")))
        before = PanelScreen.on_key

        def stopped_meanwhile(screen: PanelScreen, event: Key) -> None:
            app.take_stop_key("f12")
            before(screen, event)

        for on_key, expected in ((stopped_meanwhile, []), (before, ["help"])):
            monkeypatch.setattr(PanelScreen, "on_key", on_key)
            key = Key("question_mark", "?")
            attach(key, Stroke(time.monotonic(), app.stop_stamp()))
            app.post_message(key)
            await until(pilot, lambda: app.stroke is None)
            await pilot.pause()
            assert done == expected


async def test_a_first_f12_stops_before_it_is_noted(monkeypatch: pytest.MonkeyPatch) -> None:
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


async def test_a_stop_that_reaches_nobody_says_so() -> None:
    app = fakes.app_of()
    async with app.run_test(notifications=True) as pilot:
        assert app.take_stop_key("f9")
        await until(pilot, lambda: app.events.newest is not None)
        assert [event.text for event in app.events.events] == [NOBODY_TO_STOP]


async def test_a_stop_tells_of_a_device_that_nobody_knows_how_to_stop() -> None:
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
        told = [event for event in app.events.events if event.kind == "failed"]
        assert {event.text.partition(",")[0] for event in told} == {"NOT STOPPED: device 7"}
        assert len(app._notifications) == 1, "over everything it is said once"
        app.chosen = app.fleet.consoles[0]
        assert app.take_stop_key("space")  # one drive is meant, and reached
        await pilot.pause()
        assert [event for event in app.events.events if event.kind == "failed"] == told


@pytest.mark.parametrize("passed", [(SharedFacts, "commander"), (Commander, "arm")])
async def test_a_stop_while_the_key_that_arms_has_its_effect_is_the_last_word(
    monkeypatch: pytest.MonkeyPatch, passed: tuple[type, str]
) -> None:
    """The keys are read in a thread of their own: a stop may come at any place of that way."""
    kind, name = passed
    async with bench("atv71") as made:
        goes_on, stops = getattr(kind, name), iter(["f12"])

        def behind_a_stop(*given: Any, **named: Any) -> Any:
            for key in stops:
                made.app.take_stop_key(key)
            return goes_on(*given, **named)

        monkeypatch.setattr(kind, name, behind_a_stop)
        await made.pilot.press("a")
        await made.stopped()
        assert made.app.chosen is not None
        assert not made.app.chosen.session.arming.armed
        await made.armed()
