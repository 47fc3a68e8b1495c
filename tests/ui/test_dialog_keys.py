"""Keys shown at the bottom of every dialog match the keys that work."""

from __future__ import annotations

import asyncio
import importlib
import pkgutil
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import Input

import tui.screens
from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.bus.errors import LinkSyntaxError
from tui.drive.profile import library
from tui.drive.settings.edits import Edits
from tui.screens.bundle import BundleScreen
from tui.screens.choosing import Palette
from tui.screens.command.command_keys import OptionsScreen
from tui.screens.command.teaching import PickWord, fault_of_look
from tui.screens.connection.choices import fault_of_line
from tui.screens.dialogs.address import AddressField
from tui.screens.dialogs.ask import Ask, fault_of_new
from tui.screens.dialogs.confirm import Confirm, Consequences
from tui.screens.dialogs.leave import Leave
from tui.screens.dialogs.now import MotorStates
from tui.screens.dialogs.pick_file import PickFile
from tui.screens.dialogs.pick_parameter import PickParameter
from tui.screens.dialogs.question import KeyQuestion, Question
from tui.screens.frame import Framed
from tui.screens.frames.choice import choice_of
from tui.screens.keys.help import HelpScreen
from tui.screens.monitor.screen import MonitorScreen, fault_of_rating
from tui.screens.parameters.edit_value import EditBits, EditNumber, PickValue
from tui.screens.parameters.set_keys import Skipped
from tui.screens.parameters.write_keys import RestQuestion, Results
from tui.screens.why import WhyScreen
from tui.session.bundle.parts import PartProgress
from tui.session.bundle.work import Bundle
from tui.session.connect.addresses import parse_addresses
from tui.session.console import DriveConsole
from tui.session.diagnosis.diagnosis import Diagnosis
from tui.session.fleet import FoundDrive
from tui.session.settings.applied import Applied

from . import fakes
from .test_flows import picture, until

pytestmark = pytest.mark.long

SIZES = pytest.mark.parametrize(
    "size", kept([(80, 24), (120, 40)], (80, 24)), ids=["80x24", "120x40"]
)
Make = Callable[[DrivePanelApp, DriveConsole], ModalScreen[Any]]
APPLIED = Applied((), Edits(()))


async def _no_bundle(_: PartProgress) -> Bundle:
    """It is collected while the test runs."""
    await asyncio.sleep(3600)
    raise AssertionError


async def _no_answer() -> Diagnosis:
    """It is found while the test runs."""
    await asyncio.sleep(3600)
    raise AssertionError


def _parameter(console: DriveConsole, code: str) -> Any:
    return console.session.profile[code]


DIALOGS: dict[str, Make] = {
    "AddressField": lambda *_: AddressField({2: "2 MACHINE 4"}),
    "Ask": lambda *_: Ask("Save to", lambda _: "wrong"),
    "Ask for a number": lambda *_: Ask("Rated current", lambda _: "wrong", number=True),
    "Confirm": lambda app, console: Confirm(
        "Write?",
        "It is.",
        yes="writes",
        no="no",
        loses=True,
        now=MotorStates(app, [console.session]),
    ),
    "Leave": lambda *_: Leave("It runs."),
    "Palette": lambda *_: Palette("monitor"),
    "PickFile": lambda *_: PickFile("Open", [("factory", "factory setting")], []),
    "WhyScreen": lambda *_: WhyScreen("Why no answer?", _no_answer),
    "HelpScreen": lambda *_: HelpScreen("monitor"),
    "OptionsScreen": lambda _, console: OptionsScreen(
        console.session.profile.data.charts[0].options, {}
    ),
    "PickWord": lambda app, console: PickWord(
        console, ["HSP"], MotorStates(app, [console.session])
    ),
    "PickParameter": lambda _, console: PickParameter(
        console.session.profile, console.session.profile.data.blocks[0], "NMA1"
    ),
    "EditNumber": lambda _, console: EditNumber(console.editor, _parameter(console, "HSP")),
    "PickValue": lambda _, console: PickValue(console.editor, _parameter(console, "FR1")),
    "EditBits": lambda _, console: EditBits(console.editor, _parameter(console, "CMD")),
    "Results": lambda *_: Results(APPLIED),
    "RestQuestion": lambda app, console: RestQuestion(APPLIED, MotorStates(app, [console.session])),
    "BundleScreen": lambda *_: BundleScreen(Path("a.zip"), _no_bundle),
    "Skipped": lambda *_: Skipped(1, "backup.toml", []),
}


def all_dialogs() -> set[str]:
    """Every dialog of the panel, by the name of its class."""
    for module in pkgutil.walk_packages(tui.screens.__path__, "tui.screens."):
        importlib.import_module(module.name)
    found: list[type] = []
    left: list[type] = [Framed]
    while left:
        item = left.pop()
        left += item.__subclasses__()
        found.append(item)
    bases = (Question, KeyQuestion, Consequences)
    return {
        cls.__name__
        for cls in found
        if issubclass(cls, ModalScreen) and cls not in bases and cls.__module__.startswith("tui.")
    }


def test_every_dialog_is_tested() -> None:
    assert all_dialogs() == {name.partition(" ")[0] for name in DIALOGS}


def bottom(app: DrivePanelApp) -> str:
    """The last line of the terminal."""
    return picture(app).splitlines()[-1]


async def on_monitor(app: DrivePanelApp, pilot: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The panel on Monitor of drive 2; each stop is kept, and stops nothing."""
    stopped: list[bool] = []
    monkeypatch.setattr(app, "_stop", lambda *, everything: stopped.append(everything))
    console = fakes.console_of(fakes.snapshot_of(library.load("atv71"), fakes.RUNNING))
    app.opened = fakes.opened()
    app.fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, console))
    app.chosen = console
    await app.push_screen(MonitorScreen(console))
    await until(pilot, lambda: bottom(app).startswith(" Space STOP 2 "))
    return console, stopped


@SIZES
async def test_stop_key_shown_in_a_dialog_stops(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    async with app.run_test(size=size) as pilot:
        console, stopped = await on_monitor(app, pilot, monkeypatch)
        for name, make in DIALOGS.items():
            below = app.screen
            app.push_screen(make(app, console))
            await until(pilot, lambda: app.screen is not below and app.focused is not None)  # noqa: B023
            stops = app.take_stop_key("space")
            output = " Space STOP 2  F9 STOP ALL" if stops else " F12 STOP 2  F9 STOP ALL"
            await until(pilot, lambda: bottom(app).rstrip() == output)  # noqa: B023
            assert stopped == [False] * stops, name
            assert app.take_stop_key("f12")
            assert app.take_stop_key("f9")
            assert stopped[-2:] == [False, True], name
            stopped.clear()
            if (field := app.focused) is not None and isinstance(field, Input):
                app.screen.set_focus(None)  # as a click beside the field
                await until(pilot, lambda: bottom(app).startswith(" Space STOP 2 "))
                assert app.take_stop_key("space")
                stopped.clear()
            app.pop_screen()
            await until(pilot, lambda: app.screen is below)  # noqa: B023
            await until(pilot, lambda: bottom(app).startswith(" Space STOP 2  "))


@pytest.mark.parametrize("size", kept([(60, 16), (80, 24)], (60, 16)))
async def test_frame_covers_no_part_of_a_dialog(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    async with app.run_test(size=size) as pilot:
        console, _ = await on_monitor(app, pilot, monkeypatch)
        app.tell("A message of three rows. " * (size[0] // 10))
        below = app.screen
        assert isinstance(below, Framed)
        await until(pilot, lambda: below.message_rows >= 3)
        for name, make in DIALOGS.items():
            app.push_screen(make(app, console))
            await until(pilot, lambda: app.screen is not below)
            await pilot.pause()
            dialog = app.screen
            assert isinstance(dialog, Framed)
            top, bottom = 2, size[1] - 1 - dialog.message_rows
            for part in dialog.children:
                if part.id in dialog._frame_parts:
                    continue
                assert top <= part.region.y < part.region.bottom <= bottom, name
                inner = part.region.shrink(part.styles.border.spacing)
                for keys in part.query("#hint"):
                    assert inner.contains_region(keys.region), name
            app.pop_screen()
            await until(pilot, lambda: app.screen is below)


@pytest.mark.sweep  # every key on every question
async def test_only_its_own_keys_affect_a_dialog(monkeypatch: pytest.MonkeyPatch) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    async with app.run_test(size=(80, 24)) as pilot:
        console, stopped = await on_monitor(app, pilot, monkeypatch)
        done: list[str] = []
        for name, make in DIALOGS.items():
            app.push_screen(make(app, console), lambda answer: done.append(repr(answer)))
            await until(pilot, lambda: not isinstance(app.screen, MonitorScreen))
            dialog = app.screen
            await pilot.press("ctrl+c", "ctrl+q", "1", "3", "r", "x", "a", "left_square_bracket")
            await pilot.press("tab", "f2", "ctrl+p", "ctrl+s", "ctrl+l")
            if name != "HelpScreen":  # whose key closes it, too
                await pilot.press("f1")
            assert app.screen is dialog, name
            assert "Esc" in picture(app), f"{name}\n{picture(app)}"
            await pilot.press("escape")
            await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
            assert done.pop() in ("None", "False", "'stay'"), name
        assert stopped == []


LETTERS = re.compile(r"(?:^|  )([^ -]) ")
"""A key of one letter in a line of keys."""


@pytest.mark.parametrize(("screen", "key"), [("3", "/"), ("7", "O"), ("7", "j"), ("1", "c")])
@pytest.mark.sweep
async def test_letters_typed_into_a_field_are_not_shown_as_keys(
    screen: str, key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        await on_monitor(app, pilot, monkeypatch)
        await until(pilot, lambda: app.connection.form._there or app.screen is not app.connection)
        await pilot.press(screen)
        await until(pilot, lambda: bool(LETTERS.findall(bottom(app))))
        before = bottom(app)
        await pilot.press(key)
        await until(pilot, lambda: isinstance(app.focused, Input))
        await until(pilot, lambda: bottom(app) != before)
        assert not LETTERS.findall(bottom(app))
        assert "F1 help" in bottom(app)
        assert "m messages" not in picture(app)
        typed, place = app.focused, app.screen
        assert isinstance(typed, Input)
        text = typed.value
        await pilot.press("end", "m", "4")
        assert (typed.value, app.screen) == (f"{text}m4", place)
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.focused, Input))
        await until(pilot, lambda: bottom(app) == before)


EVERY_SIZE = pytest.mark.parametrize("size", kept([(60, 16), (80, 24), (120, 40)], (60, 16)))
LONG = "\n".join(f"line {number} of what follows" for number in range(60))


@EVERY_SIZE
async def test_keys_of_a_dialog_are_always_visible(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    async with app.run_test(size=size) as pilot:
        console, _ = await on_monitor(app, pilot, monkeypatch)
        now = MotorStates(app, [console.session] * 5)
        long: dict[str, Make] = {
            "long Confirm": lambda *_: Confirm(
                "Write?", LONG, yes="y", no="n", loses=True, now=now
            ),
            "long Leave": lambda *_: Leave(LONG, now),
        }
        for name, make in {**DIALOGS, **long}.items():
            if name == "HelpScreen":
                continue  # it scrolls as a whole, and shows its key at the top
            await app.push_screen(make(app, console))
            await pilot.pause()
            if name == "long Confirm":
                await pilot.press("enter")  # the text that Enter does not answer needs another line
                await pilot.pause()
            dialog = app.screen
            hint = dialog.query_one("#hint")
            assert isinstance(hint.parent, Widget)
            box = hint.parent.content_region
            assert hint.size.height, name
            assert box.contains_region(hint.region), name
            assert box.bottom <= size[1] - 2, name  # below it are the message and the stop keys
            for part in dialog.query("#choices, #says"):  # its end can be read, too
                assert part.region.bottom <= hint.region.y, name
                assert part.size.height, name
            app.pop_screen()
            await pilot.pause()


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("", "Enter a file name"),
        ("x" * 300, "The file cannot be created"),
        ("~nobody-of-that-name/x.toml", "~nobody-of-that-name has no home folder"),
        ("a\x00b", "control characters"),
    ],
)
async def test_invalid_file_name_is_refused_in_the_dialog(name: str, why: str) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    async with app.run_test(size=(80, 24)) as pilot:
        app.push_screen(Ask("Save to", fault_of_new, text="x"))
        await until(pilot, lambda: isinstance(app.focused, Input))
        app.screen.query_one(Input).value = name
        await pilot.press("enter")
        await until(pilot, lambda: why in picture(app))
        assert app._exception is None


def faults_of(parse: Callable[[str], object]) -> Callable[[str], str]:
    """Result of a parser for a text."""

    def check(text: str) -> str:
        with pytest.raises(LinkSyntaxError) as refused:
            parse(text)
        return str(refused.value)

    return check


LONG_NUMBER = "9" * 5000
"""More digits than Python's int() accepts, as in a paste."""
CHECKS: dict[str, tuple[Callable[[str], object], tuple[str, ...]]] = {
    "rating": (fault_of_rating, ("NaN", "sNaN", "-Infinity", LONG_NUMBER)),
    "frames": (choice_of, (LONG_NUMBER, f"f{LONG_NUMBER}", "f", "2 f16")),
    "line": (
        fault_of_line,
        (f"sim:atv71@{LONG_NUMBER}", f"tcp:h:{LONG_NUMBER}", f"serial:/dev/null,{LONG_NUMBER}"),
    ),
    "display": (fault_of_look, (LONG_NUMBER, f"{LONG_NUMBER}Hz", "NaNHz")),
    "addresses": (faults_of(parse_addresses), (LONG_NUMBER, f"1-{LONG_NUMBER}", "1-")),
}


@pytest.mark.parametrize("name", CHECKS)
def test_invalid_input_is_refused_and_ends_nothing(name: str) -> None:
    check, texts = CHECKS[name]
    for text in texts:
        reported = check(text)
        assert reported or text == "f", text[:20]


@pytest.mark.sweep
async def test_key_without_a_meaning_in_a_dialog_says_where_it_works(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    async with app.run_test(size=(80, 24)) as pilot:
        console, _ = await on_monitor(app, pilot, monkeypatch)
        for name, make in DIALOGS.items():
            app.push_screen(make(app, console))
            await until(pilot, lambda: app.screen.is_modal and app.focused is not None)
            dialog = app.screen
            app.screen.set_focus(None)
            # in the results of a write it saves
            save = ("S", "Press Esc to close this first, then S: Save the settings")
            for key, text in (
                *([] if name == "Results" else [save]),
                ("ctrl+o", "Press Esc to close this first, then ^o: Open a file"),
                ("w", "w works on Parameters (3) and Scanner (4)."),
            ):
                await pilot.press(key)
                newest = app.events.newest
                assert newest is not None
                assert newest.text.startswith(text), (name, key, newest.text)
                assert app.screen is dialog, name
            app.pop_screen()
            await pilot.pause()
        # what is typed into a field is text
        app.push_screen(DIALOGS["Ask"](app, console))
        await until(pilot, lambda: isinstance(app.focused, Input))
        newest = app.events.newest
        await pilot.press("S", "left", "backspace")
        assert app.events.newest == newest


async def test_s_in_write_results_continues_with_saving(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    async with app.run_test(size=(80, 24)) as pilot:
        await on_monitor(app, pilot, monkeypatch)
        answers: list[object] = []
        codes = [f"SP{number:02}" for number in range(1, 12)]
        app.push_screen(Results(APPLIED, codes), answers.append)
        await until(pilot, lambda: "S Save to EEPROM (asks)" in picture(app))
        shown = " ".join(picture(app).replace("│", " ").split())
        assert "Not in EEPROM, lost at power-off: SP01, " in shown
        assert "SP08 and 3 more." in shown
        await pilot.press("S")
        await until(pilot, lambda: answers == [True])
