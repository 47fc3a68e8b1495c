"""The tables of keys in the pages of docs/screens, made from the table of actions.

python -m tui.screens.keys.pages docs/screens
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path

from tui.drive.small_file import read_small_text

from .action import KEY_NAMES, Action
from .table import APP_ACTIONS, SCREENS, STOP_ACTIONS

EVERY_SCREEN = "every screen"
"""Heading of the app's own actions in a page."""
INDEX = re.compile(r"(<!-- screens -->\n).*?(<!-- end of screens -->)", re.DOTALL)
TABLE = re.compile(r"(<!-- keys of (?P<of>[a-z -]+) -->\n).*?(<!-- end of keys -->)", re.DOTALL)


def with_tables(text: str) -> str:
    """Replace the tables of keys and screens in a page with the present ones."""
    text = INDEX.sub(lambda found: f"{found[1]}{screen_table()}{found[2]}", text)
    return TABLE.sub(lambda found: f"{found[1]}{key_table(found['of'])}{found[3]}", text)


def screen_table() -> str:
    """The screens that have a page, in Markdown, each with the key that opens it."""
    rows = [
        f"| {screen.digit or screen.key} | [{screen.title}]({screen.name}.md) | {screen.about} |"
        for screen in SCREENS
        if screen.about
    ]
    return "\n".join(["", "| key | screen | content |", "|---|---|---|", *rows, ""]) + "\n"


def key_table(of: str) -> str:
    """The keys of a screen, or of every screen, in Markdown; then the actions without a key."""
    actions = list(_actions(of))
    rows = [f"| {_keys(action)} | {action.help} |" for action in actions if action.keys]
    lines = ["", "| key | what it does |", "|---|---|", *rows, ""]
    if without := [f"- {action.help}" for action in actions if not action.keys]:
        lines += ["Without a key, in the list of actions (Ctrl+P):", "", *without, ""]
    return "\n".join(lines) + "\n"


def key_text(key: str) -> str:
    """The text of a key in a page: Ctrl+P, Shift+Tab, PgUp, a."""
    if "+" in key[:-1]:
        return "+".join(part.capitalize() for part in key.split("+"))
    return KEY_NAMES.get(key, key.capitalize() if len(key) > 1 else key)


def _keys(action: Action) -> str:
    return " or ".join(key_text(key) for key in action.keys.split(","))


def _actions(of: str) -> Sequence[Action]:
    """The actions of a screen alone, or those that every screen has."""
    if of == EVERY_SCREEN:
        return (*STOP_ACTIONS, *APP_ACTIONS)
    return next(screen.actions for screen in SCREENS if screen.name == of)


def write_pages(folder: Path) -> None:
    """Update every page of a folder."""
    for path in sorted(folder.glob("*.md")):
        path.write_text(with_tables(read_small_text(path)), "utf-8")


if __name__ == "__main__":
    write_pages(Path(sys.argv[1]))
