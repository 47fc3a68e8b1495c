"""Help: every key of the screen below, and what the signs mean."""

from __future__ import annotations

from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import VerticalScroll
from textual.screen import ModalScreen

from tui.widgets.palette import ALARM, ATTENTION, FAINT, FAULT, KEY, PLAIN, RUNNING, TITLE
from tui.widgets.plain import Plain

from ..frame import Framed
from .table import of_screen

SIGNS: tuple[tuple[str, str, str], ...] = (
    ("▶", "green", "the motor runs"),
    ("□", "white", "it stands; STANDBY: the next command from here runs it"),
    ("▼", "cyan", "a stop is on its way"),
    ("■", "red", "a drive is in fault; on Line: another one than that of the strip"),
    ("?", "amber", "state not known, or (behind a name) not confirmed by a manual"),
    ("-----", "grey", "no value: not read yet, or the drive does not have it"),
    ("12s", "amber", "an old value, with its age in place of its unit"),
    ("│", "white", "on a bar: the reference"),
    ("●", "white", "a bit that is 1"),
    ("● 2", "cyan", "behind Parameters or Scanner: so much is staged, not yet written"),
    ("■", "amber", "of a setting: not its factory value"),
    ("S", "amber", "of a setting: lost when the drive is off, until S keeps it in its EEPROM"),
    ("R", "amber", "of a setting: in force only after a reset of the drive"),
)
WITHOUT_KEY = "^p"
"""Where an action without a key of its own is found: in the list of all."""
HELP_STYLES = {
    "cyan": ATTENTION,
    "green": RUNNING,
    "red": FAULT,
    "amber": ALARM,
    "grey": FAINT,
    "white": PLAIN,
}


class HelpScreen(Framed, ModalScreen[None]):
    """The keys of one screen, made from the table of actions."""

    CSS_PATH = "help.tcss"
    BINDINGS: ClassVar = [
        Binding("escape,question_mark,f1,q", "dismiss(None)", "close", show=False)
    ]

    def __init__(self, screen: str) -> None:
        super().__init__()
        self._of = screen

    def compose(self) -> ComposeResult:
        """The frame, and the list."""
        yield from self.framed()
        yield from self.dialog()

    def dialog(self) -> ComposeResult:
        """One text that scrolls where the terminal is small."""
        with VerticalScroll(id="help"):
            yield Plain(help_text(self._of))


def help_text(screen: str) -> Table:
    """Keys and signs of a screen, each sentence in a column of its own."""
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_row(
        Text("", no_wrap=True),
        Text.assemble((f"Keys on {screen.capitalize()}", TITLE), ("   Esc closes", FAINT)),
    )
    for action in of_screen(screen):
        key = action.shown or WITHOUT_KEY
        table.add_row(Text(key, KEY, no_wrap=True), Text(action.help, PLAIN))
    table.add_row("", "")
    table.add_row("", Text("Signs", TITLE))
    for sign, colour, meaning in SIGNS:
        table.add_row(Text(sign, HELP_STYLES[colour], no_wrap=True), Text(meaning, PLAIN))
    return table
