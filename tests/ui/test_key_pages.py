"""The pages of docs/screens have the keys of the table of actions, every one and no other."""

from __future__ import annotations

import re
from importlib import import_module
from inspect import signature
from pathlib import Path

import pytest
from textual.actions import parse
from textual.screen import Screen

from tui.app import DrivePanelApp
from tui.screens.keys.action import KEY_NAMES
from tui.screens.keys.pages import EVERY_SCREEN, TABLE, key_table, with_tables, write_pages
from tui.screens.keys.table import ACTIONS, EVERYWHERE, SCREENS, bindings

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs" / "screens").glob("*.md"))
MAKE = "python -m tui.screens.keys.pages docs/screens"
ROW = re.compile(r"^\| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)


def tables() -> dict[str, str]:
    """Every table of keys of the pages, by the screen that it is of."""
    found = [match_ for path in PAGES for match_ in TABLE.finditer(path.read_text("utf-8"))]
    assert len({found_match["of"] for found_match in found}) == len(found), "one table a screen"
    return {found_match["of"]: found_match[0] for found_match in found}


def named(key: str) -> str:
    """A key as the pages write it."""
    if "+" in key[:-1]:
        return "+".join(part.capitalize() for part in key.split("+"))
    return KEY_NAMES.get(key, key.capitalize() if len(key) > 1 else key)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_pages_have_the_current_keys(path: Path) -> None:
    text = path.read_text("utf-8")
    assert text == with_tables(text), MAKE


def test_every_screen_has_its_table() -> None:
    assert set(tables()) == {*EVERYWHERE, EVERY_SCREEN}


def test_pages_list_every_key_and_no_other() -> None:
    reported = {
        (of, key)
        for of, table in tables().items()
        for cell, _ in ROW.findall(table)
        for key in cell.split(" or ")
    }
    reported = {(of, key) for of, key in reported if key != "key"}
    wanted = {
        (of, named(key))
        for action in ACTIONS
        for of in ([EVERY_SCREEN] if action.app or action.first else action.screens)
        for key in action.keys.split(",")
        if key
    }
    keys = {key for _, key in wanted}
    assert {"Ctrl+P", "Shift+Tab", "PgUp", "Space", "?", "a", "A"} <= keys
    assert wanted - reported == set()
    assert reported - wanted == set()


def test_every_action_has_its_text_on_the_page() -> None:
    for action in ACTIONS:
        of = EVERY_SCREEN if action.app or action.first else action.screens[0]
        assert action.help in tables()[of]


def test_screens_are_listed_by_their_digits() -> None:
    index = (PAGES[0].parent / "README.md").read_text("utf-8")
    for screen in SCREENS:
        row = f"| {screen.digit or screen.key} | [{screen.title}]({screen.name}.md) |"
        assert (row in index) is bool(screen.about)
        assert not screen.about or (PAGES[0].parent / f"{screen.name}.md").is_file()


def test_outdated_page_is_rewritten(tmp_path: Path) -> None:
    page = tmp_path / "frames.md"
    page.write_text("A\n<!-- keys of frames -->\n| h | Old. |\n<!-- end of keys -->\nB\n", "utf-8")
    write_pages(tmp_path)
    written = page.read_text("utf-8")
    assert written.startswith("A\n<!-- keys of frames -->\n\n| key |")
    assert written.endswith("<!-- end of keys -->\nB\n")
    assert "| h | Pause or resume the list. |" in written
    assert "Old." not in written


def test_actions_without_a_key_follow_the_table() -> None:
    table = key_table("line")
    assert "- Close the line. Asks first if a drive reacts to that." in table
    assert "|  |" not in table


def screen_classes() -> dict[str, type[Screen[None]]]:
    """The class of each registered screen, by its name in the code."""
    modules = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for path in (ROOT / "tui" / "screens").rglob("*.py")
        if "BINDINGS: ClassVar = bindings(" in path.read_text("utf-8")
    ]
    found = {}
    for screen in EVERYWHERE:
        for module in map(import_module, modules):
            for made in vars(module).values():
                if isinstance(made, type) and vars(made).get("BINDINGS") == bindings(screen):
                    found[screen] = made
    return found


def test_each_action_calls_a_method_of_its_screens_with_arguments_that_it_takes() -> None:
    classes = screen_classes()
    assert set(classes) == set(EVERYWHERE)
    for action in ACTIONS:
        _, name, arguments = parse(action.id)
        for owner in [DrivePanelApp] if action.app else [classes[of] for of in action.screens]:
            method = getattr(owner, f"action_{name}", None)
            assert method is not None, (owner, action.id)
            signature(method).bind(owner, *arguments)  # raises TypeError


def test_keys_that_are_opposites_move_by_the_same_steps() -> None:
    """Up and down, next and previous: one action, with arguments of both signs."""
    by_screen: dict[tuple[str, str], set[tuple[object, ...]]] = {}
    for action in ACTIONS:
        _, name, arguments = parse(action.id)
        if arguments and not isinstance(arguments[0], str):
            for screen in action.screens:
                by_screen.setdefault((screen, name), set()).add(arguments)
    for steps in by_screen.values():
        numbers = {int(str(step)) for (step,) in steps}
        assert numbers == {-number for number in numbers}
