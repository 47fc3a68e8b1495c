"""One key, one meaning: the table of actions has no clash, and no letter writes without
confirmation.
"""

from __future__ import annotations

import ast
import string
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from textual.app import ComposeResult
from textual.events import Key
from textual.screen import ModalScreen
from textual.widgets import Input

from tests.sources import PACKAGE, modules, nodes_of
from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.drive.profile import library
from tui.screens.command.control import Control
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.keys.action import CONNECTION, KEY_NAMES, LISTENING, OPENING, Action
from tui.screens.keys.help import HelpScreen
from tui.screens.keys.table import ACTIONS, EVERYWHERE, TABBED, elsewhere, key_meanings, keys_line
from tui.screens.monitor.screen import order_keys
from tui.screens.open_lines import LineOpening
from tui.screens.parameters.screen import ParametersScreen
from tui.widgets.fields import NumberInput, WordField
from tui.widgets.palette import ATTENTION

from . import fakes
from .test_command_flows import Bench, bench, writes
from .test_flows import shown, until
from .test_places import view_of

CURSOR = "it moves what has a cursor; on Monitor that is the reference, which is armed or asks"
GENERIC = {
    "enter": "go in: open, edit, choose; what it writes on Control asks with y",
    "escape": "go out: back, close, end the search",
    "tab": "the next part of the screen: word, group, table",
    "shift+tab": "the part before",
    "up": CURSOR,
    "down": CURSOR,
    "left": CURSOR,
    "right": CURSOR,
    "pageup": CURSOR,
    "pagedown": CURSOR,
    "home": "the first of a list",
    "end": "the last of a list",
    "+": "one more, or one further, of what is staged or proposed; writes nothing",
    "-": "one less, or one back, of what is staged or proposed; writes nothing",
    "delete": "what is under the cursor goes from what is staged or proposed; writes nothing",
    "u": "what is staged or proposed last goes; writes nothing",
    "U": "all that is staged or proposed goes; writes nothing",
    "w": "write all that is staged or proposed; armed, asks with y",
}
"""Keys that do alike on alike things: why each may have an action on each screen."""
AT_ONCE = {"k": "quick-stop", "e": "emergency-stop"}
"""Letters that write immediately: stops, which need no arming and wait for nothing."""
LETTERS = [*"wW", *(key for key in string.ascii_letters if key not in "kewWuU"), *"uU"]
"""Every other letter; letters that write come first, letters that drop pending work last."""


def meanings() -> dict[str, set[str]]:
    """By key, the actions that it has over all screens."""
    found: dict[str, set[str]] = defaultdict(set)
    for action in ACTIONS:
        for key in filter(None, action.keys.split(",")):
            found[key].add(action.id)
    return found


def test_key_has_one_meaning_on_every_screen() -> None:
    clashes = {key: ids for key, ids in meanings().items() if len(ids) > 1 and key not in GENERIC}
    assert clashes == {}


def test_every_exception_for_a_generic_key_is_needed() -> None:
    used = {key for key, ids in meanings().items()}
    assert set(GENERIC) <= used


@pytest.mark.parametrize("screen", EVERYWHERE)
def test_key_has_one_action_on_a_screen(screen: str) -> None:
    keys = [
        key
        for action in ACTIONS
        if screen in action.screens
        for key in action.keys.split(",")
        if key
    ]
    assert len(keys) == len(set(keys))


def test_global_keys_are_not_reused_by_a_screen() -> None:
    everywhere = {key for a in ACTIONS if a.app for key in a.keys.split(",")}
    single = {key for a in ACTIONS if not a.app for key in a.keys.split(",") if key}
    assert everywhere & single == set()
    assert {a.screens for a in ACTIONS if a.app} == {EVERYWHERE}


def test_letters_that_act_immediately_are_stops() -> None:
    assert {*LETTERS, *AT_ONCE} == set(string.ascii_letters)
    found = {a.keys: a.id for a in ACTIONS if a.keys in AT_ONCE}
    assert found == {key: f"stop_as('{order}')" for key, order in AT_ONCE.items()}


# A key without a meaning on a screen


def test_every_key_has_a_meaning_on_its_screen() -> None:
    assert elsewhere(CONNECTION, "r").startswith("r works on Monitor (2): Run forward")
    assert elsewhere("frames", "V").startswith("V works on Scanner (4)")
    assert elsewhere("monitor", "asterisk", "*").startswith("* works on Parameters (3)")
    assert elsewhere("parameters", "less_than_sign", "<").startswith("< works on Monitor")
    # what waits to be written may be on either
    assert elsewhere("monitor", "w") == "w works on Parameters (3) and Scanner (4)."
    assert elsewhere("monitor", "r") == ""
    assert elsewhere("monitor", "Y", "Y") == ""
    assert elsewhere("monitor", "P", "P").startswith("P works on Control (6)")
    assert "Start-up (B)" in elsewhere("monitor", "enter")
    assert "another screen" not in " ".join(elsewhere("trend", key) for key in ("enter", "tab"))


def test_a_capital_letter_names_caps_lock_if_the_small_one_works_here() -> None:
    run = "Is Caps Lock on? x means: Reset the fault."
    assert run in elsewhere("monitor", "X", "X")
    assert elsewhere("monitor", "K", "K").startswith("Is Caps Lock on? k means: Quick stop")
    assert "Caps Lock" not in elsewhere("line", "K", "K")


async def test_digits_of_a_french_keyboard_open_screens_and_are_typed_in_numbers() -> None:
    async with bench("atv71") as made:
        await until(made.pilot, lambda: made.app.place == "monitor")
        for key, place in (("quotation_mark", "parameters"), ("é", "monitor")):
            await made.pilot.press(key)
            await until(made.pilot, lambda: made.app.place == place)  # noqa: B023
        await made.pilot.press("a", "r", "quotation_mark", "à", "full_stop", "left_parenthesis")
        await until(made.pilot, lambda: "30.5" in shown(made.app, "message"))
        assert writes(made.app) == []
        await made.pilot.press("escape")
        made.app.push_screen(Ask("Current", str, number=True))
        await until(made.pilot, lambda: isinstance(made.app.focused, NumberInput))
        await made.pilot.press("ampersand", "é", ".", "ç", "minus")
        field = made.app.focused
        assert isinstance(field, NumberInput)
        assert field.value == "12.9-"
        await made.pilot.press("left", "left", "backspace", "2")
        assert field.value == "1229-"
        # a search has its words as they were typed
        await made.pilot.press("escape", "slash", "é", "ç")
        await until(made.pilot, lambda: isinstance(made.app.focused, WordField))
        words = made.app.focused
        assert isinstance(words, WordField)
        await until(made.pilot, lambda: words.words == "éç")


KEY_OF = {tab.name: tab.digit for tab in TABBED}
OVER = {"messages": "m", "wiring": "I", "start-up": "B"}
"""Screens that are none of the seven places, and their keys."""


def strange_on(screen: str) -> dict[str, Action]:
    """Keys without a meaning there, each with its action on other screens."""
    here = {key for a in ACTIONS if screen in a.screens for key in a.keys.split(",")}
    strange: dict[str, Action] = {}
    for action in ACTIONS:
        for key in action.keys.split(","):
            if len(key) == 1 and key not in here:
                strange.setdefault(key, action)
    return strange


@pytest.mark.sweep  # every key on every screen
async def test_key_without_a_meaning_says_where_it_works_and_does_nothing() -> None:
    async with bench("atv71") as made:
        await made.armed()
        for screen, way in KEY_OF.items():
            await made.pilot.press(way)
            await until(made.pilot, lambda: made.app.place == screen)  # noqa: B023
            assert strange_on(screen)
            stack, before = list(made.app.screen_stack), time.monotonic()
            for key, action in strange_on(screen).items():
                made.app.clear_notifications()
                if screen == CONNECTION:
                    made.app.connection.drives.focus()  # in a field it is text
                made.app.events.add("told", f"{key} is next on {screen}")
                await made.pilot.press(key)
                reported = f"{action.shown} works on"
                await until(made.pilot, lambda: notices(made).startswith(reported))  # noqa: B023
                assert list(made.app.screen_stack) == stack, (screen, key)
            assert writes(made.app, before) == [], screen


def attributes_of_classes(path: Path) -> Iterator[str]:
    """Names that the classes of a module define."""
    for node in nodes_of(path):
        match node:
            case ast.Attribute(value=ast.Name(id="self"), attr=name, ctx=ast.Store()):
                yield name
            case ast.ClassDef(body=body):
                parts = (part for part in body if isinstance(part, ast.FunctionDef))
                yield from (part.name for part in parts)


def test_no_method_has_the_name_of_a_key() -> None:
    """Textual calls methods named key_ and the name of a key: @ is called at."""
    named = {
        f"{path.relative_to(PACKAGE)}: {name}"
        for path in modules()
        if "key_" in path.read_text("utf-8")
        for name in attributes_of_classes(path)
        if name.startswith(("key_", "_key_"))
    }
    assert named == set()


async def test_key_with_a_word_as_its_name_ends_nothing() -> None:
    app = fakes.app_of()
    async with app.run_test() as pilot:
        for place in (None, Confirm("Write?", "It is written.", yes="y", no="n", loses=True)):
            if place is not None:
                await app.push_screen(place)
            await pilot.press("@")
            await pilot.pause()
            assert app.screen is (place or app.connection)


def notices(made: Bench) -> str:
    newest = made.app.events.newest
    return newest.text if newest else ""


@pytest.mark.parametrize("key", kept("123567", "1", "3"))
async def test_text_after_slash_is_searched(key: str) -> None:
    """Typed quickly on a slow machine, it was a key of the screen below: `a` armed."""
    async with bench("atv71") as made:
        await made.pilot.press(key)
        await until(made.pilot, lambda: KEY_OF[made.app.place] == key)
        for character in ("/", *"area"):
            made.app.post_message(Key("slash" if character == "/" else character, character))
        await until(made.pilot, lambda: made.app.place == "parameters")
        await until(made.pilot, lambda: found(made) == "area")
        assert made.app.chosen is not None
        assert not made.app.chosen.session.arming.armed


async def test_text_after_slash_is_searched_on_a_slow_computer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A screen that took half a second to open let the `a` arm."""
    compose = ParametersScreen.compose

    def slow(self: ParametersScreen) -> ComposeResult:
        time.sleep(0.5)
        return compose(self)

    monkeypatch.setattr(ParametersScreen, "compose", slow)
    async with bench("atv71") as made:
        for character in ("/", *"area"):
            made.app.post_message(Key("slash" if character == "/" else character, character))
        await until(made.pilot, lambda: made.app.place == "parameters")
        await until(made.pilot, lambda: found(made) == "area")
        assert made.app.chosen is not None
        assert not made.app.chosen.session.arming.armed


def found(made: Bench) -> str:
    """Text of the search; nothing while the screen is being composed."""
    return "".join(field.value for field in made.app.screen.query("#search").results(Input))


# No letter writes without confirmation


async def stage(made: Bench) -> None:
    """Something to write on Parameters and on Blocks, and an output to write through."""
    made.drive().set("NCA1", made.drive().profile["ACC"].address)
    await made.pilot.press("slash", *"hsp")
    made.app.screen.set_focus(None)
    await until(made.pilot, lambda: " raw " in shown(made.app, "detail"))
    await made.pilot.press("minus", "4")
    await until(made.pilot, lambda: "ACC" in shown(made.app, "second"))
    await made.pilot.press("delete")
    await until(made.pilot, lambda: "staged. Press" in shown(made.app, "detail"))


SWEPT = {
    "control", "faults", "frames", "line", "messages", "parameters", "scanner", "start-up", "trend",
    "wiring",
}  # fmt: skip
"""Screens other than Monitor, whose letters the sweeps press."""


@pytest.mark.parametrize(
    "screen",
    [
        pytest.param(name, marks=pytest.mark.sweep if name in SWEPT else ())
        for name in EVERYWHERE
        if name not in (OPENING, LISTENING, "map")  # there is nothing to write to
    ],
)
async def test_no_letter_writes_without_confirmation(screen: str) -> None:
    """Armed, with pending work; a question that opens is left unanswered."""
    async with bench("atv71") as made:
        await stage(made)
        await made.pilot.press("2")
        await until(made.pilot, lambda: bool(shown(made.app, "state")))
        for letter in LETTERS:
            await back_to(made, screen)
            await made.pilot.press(letter)
            await made.pilot.pause(0.05)
            assert writes(made.app) == [], letter
        await made.pilot.pause(0.5)
        assert writes(made.app) == []
        assert made.app._exit is False


async def back_to(made: Bench, screen: str) -> None:
    """Armed on that screen, with no question open and no line; nothing where that is so."""
    app = made.app
    while isinstance(app.screen, ModalScreen):
        await made.pilot.press("escape")
    console = app.chosen
    assert console is not None
    if app.place == "monitor" and "Enter" in shown(app, "message"):
        await made.pilot.press("escape")
    if app.place == CONNECTION:
        app.connection.drives.focus()  # in a field a letter is text
        if screen == CONNECTION:
            assert not console.session.arming.armed  # leaving Monitor for it disarms
            return
    if app.place == screen and console.session.arming.armed:
        return
    if app.place != "monitor":
        await made.pilot.press("2")
        await until(made.pilot, lambda: app.place == "monitor")
    await until(made.pilot, lambda: bool(shown(app, "state")))
    if "Esc cancel" in " ".join(shown(app, "message").split()):
        await made.pilot.press("escape")
    console = app.chosen
    assert console is not None
    if not console.session.arming.armed:
        await made.pilot.press("a")
        await until(made.pilot, lambda: console.session.arming.armed)
    if screen == CONNECTION:
        await made.pilot.press("1")
        app.connection.drives.focus()
    elif screen != "monitor":
        await made.pilot.press({**KEY_OF, **OVER}[screen])
    await until(made.pilot, lambda: app.place == screen)


# Keys that act before they are known to be single

REPLAY_KEYS = {*"0;{}$#@", "comma"}
SHOW_EVERYWHERE = {
    *"12345678", *"&é\"'(è_", "/", "m", "I", "B", "ctrl+p", "?", "f1", "ctrl+l", *REPLAY_KEYS
}  # fmt: skip
ARROWS = {"up", "down", "pageup", "pagedown"}
SHOW = {
    "line": set(),
    "monitor": {"tab", "<", ">", "=", "left", "right"},
    "opening": set(),
    "parameters": {
        *ARROWS, "home", "end", "tab", "right", "shift+tab", "left", "d", "D"
    },
    "scanner": {"up", "down", "tab", "left", "right"},
    "faults": {"up", "down", "left", "right", "tab"},
    "control": {"tab"},
    "map": {"left", "right", "tab", "pageup", "pagedown"},
    "frames": {*ARROWS, "tab"},
    "listening": {*ARROWS, "tab"},
    "trend": {*ARROWS, "left", "right", "<", ">", "M", "tab", "home", "end"},
    "messages": ARROWS,
    "start-up": {"up", "down", "tab", "shift+tab"},
    "wiring": {*ARROWS, "tab", "shift+tab"},
}  # fmt: skip


def test_only_keys_that_move_or_show_act_immediately() -> None:
    found = {
        screen: {key for key, only_shows in key_meanings(screen).items() if only_shows}
        for screen in EVERYWHERE
    }
    assert found == {screen: SHOW_EVERYWHERE | keys for screen, keys in SHOW.items()}


def test_no_action_that_writes_or_asks_acts_immediately() -> None:
    words = ("arming", "asks", "write", "stop", "propose", "leave")
    careful = [a for a in ACTIONS if any(word in a.help.lower() for word in words)]
    assert len(careful) > 20
    assert [a.id for a in careful if a.only_shows] == []


def at_once(app: DrivePanelApp, *keys: str) -> list[str]:
    """Those of these keys that do not wait now."""
    return [
        key
        for key in keys
        if app.acts_at_once(
            key, key if len(key) == 1 else None, begins=True, after=float("-inf")
        )
    ]  # fmt: skip


async def test_key_that_commands_waits_wherever_it_is_pressed() -> None:
    async with bench("atv71") as made:
        app = made.app
        keys = ("r", "x", "k", "up", "left", "2", "enter", "y", "a", "]", "q", "5", "escape")
        await until(made.pilot, lambda: app.place == "monitor")
        assert at_once(app, *keys) == ["left", "2", "5"]
        # in the run line a digit is typed, an arrow steps the reference, a letter closes it
        await made.pilot.press("a", "r")
        await until(made.pilot, lambda: "Enter" in shown(app, "message"))
        assert at_once(app, *keys) == ["2", "5"]
        await made.pilot.press("escape", "x")
        assert not isinstance(app.screen, ModalScreen)  # there is no fault to reset
        await made.pilot.press("t")
        await until(made.pilot, lambda: isinstance(app.screen, ModalScreen))
        assert at_once(app, *keys) == ["up", "left"]
        await made.pilot.press("escape", "question_mark")
        await until(made.pilot, lambda: isinstance(app.screen, HelpScreen))
        assert at_once(app, *keys) == ["up", "left", "q", "escape"]  # they only close the help
        await made.pilot.press("escape", "slash")
        await until(made.pilot, lambda: app.place == "parameters")
        await until(made.pilot, lambda: isinstance(app.focused, Input))
        assert at_once(app, *keys) == [key for key in keys if key not in ("enter", "escape")]


async def test_key_waits_while_the_one_before_has_its_effect_or_a_line_opens() -> None:
    async with bench("atv71") as made:
        app = made.app
        await until(made.pilot, lambda: app.place == "monitor")
        done = app._typed.done_to
        assert app.acts_at_once("3", "3", begins=True, after=done)
        assert not app.acts_at_once("3", "3", begins=True, after=done + 0.001)
        assert not app.acts_at_once("3", "3", begins=False, after=done)
        assert app.acts_at_once("left", None, begins=False, after=done)
        app.opening = LineOpening("sim:atv71")
        assert not app.acts_at_once("3", "3", begins=True, after=done)


@pytest.mark.internal_errors
async def test_key_waits_if_its_effect_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    async with bench("atv71") as made:
        monkeypatch.setattr(made.app, "only_shows", None)
        assert at_once(made.app, "3") == []


# The line of keys


@pytest.mark.parametrize("raws", [fakes.READY, fakes.FAULT], ids=["ready", "fault"])
@pytest.mark.parametrize("armed", [None, 57.0])
def test_unavailable_key_is_dim(raws: dict[str, int], armed: float | None) -> None:
    faulty = raws is fakes.FAULT
    view = replace(view_of(library.load("atv71"), raws), control=Control(armed_for=armed))
    line = order_keys(view, keys_line("monitor", 80))
    bright = {line.plain[span.start : span.end] for span in line.spans if span.style == ATTENTION}
    assert ("x" in bright) is (faulty and armed is not None)
    assert ("r" in bright) is (armed is not None and not faulty)


def test_keys_with_control_have_a_short_name() -> None:
    """The palette names them at the right; Ctrl+k stood among ^s and ^p."""
    found = {key for action in ACTIONS for key in action.keys.split(",") if key.startswith("ctrl+")}
    assert found - {"ctrl+q"} <= KEY_NAMES.keys()  # q itself is shown
