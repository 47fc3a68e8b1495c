"""Help: every key of the screen below, and the meaning of the signs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import ClassVar

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import VerticalScroll
from textual.screen import ModalScreen

from tui.widgets.drawing import wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, ATTENTION, FAINT, FAULT, KEY, PLAIN, RUNNING, TITLE

from ..frame import Framed
from .action import NOT_IN_REPLAY
from .table import STOP_ACTIONS, screen_actions

SIGNS: tuple[tuple[str, str, str], ...] = (
    ("▶", "green", "the motor runs"),
    ("□", "white", "the motor is at standstill; STANDBY: the next run command starts it"),
    ("▼", "cyan", "the motor is stopping"),
    ("■", "red", "a drive is in fault; on Line: another drive than in the status bar"),
    ("?", "amber", "state unknown, or (after a name) not confirmed by a manual"),
    ("-----", "grey", "no value: not read yet, or the drive does not have it"),
    ("12s", "amber", "an old value, with its age instead of its unit"),
    ("│", "white", "on a bar: the reference"),
    ("→", "white", "in the status bar: output frequency, then reference"),
    ("●", "white", "the text of this bit is true"),
    ("●", "cyan", "on the tabs Parameters and Scanner: values are staged"),
    ("▲", "amber", "on the tab Line: a problem of the line; on Parameters: not saved to EEPROM"),
    ("■", "amber", "a setting that differs from its factory setting, or from the compared set"),
    ("S", "amber", "a setting that is lost at power-off until S saves it in the EEPROM"),
    ("R", "amber", "a setting that takes effect after a reset of the drive"),
)
HELP_WIDTH, BESIDE_HELP = 76, 6
"""Columns of the dialog at most, and columns of its border, margin and scroll bar."""
SENTENCE_LINES = 6
STOP_IN_REPLAY = "Stop all drives of the live lines. The drives of a replay are not there."
WITHOUT_KEY = "^p"
"""The key shown for an action without a key of its own: that of the palette."""
HELP_STYLES = {
    "cyan": ATTENTION,
    "green": RUNNING,
    "red": FAULT,
    "amber": ALARM,
    "grey": FAINT,
    "white": PLAIN,
}


class HelpScreen(Framed, ModalScreen[None]):
    """The keys of one screen."""

    CSS_PATH = "help.tcss"
    only_close = ("escape", "question_mark", "f1", "q")
    """Keys that do nothing but close this text, so that they need not wait."""
    BINDINGS: ClassVar = [Binding(",".join(only_close), "dismiss(None)", "close", show=False)]

    def __init__(self, screen: str) -> None:
        super().__init__()
        self._of = screen

    def compose(self) -> ComposeResult:
        """The frame, and the list."""
        yield from self.framed()
        yield from self.dialog()

    def dialog(self) -> ComposeResult:
        """Lines that scroll if the terminal is small."""
        keys = Lines()
        width = min(HELP_WIDTH, self.app.size.width) - BESIDE_HELP
        keys.show(help_lines(self._of, width, replay=self.app.replay is not None))
        with VerticalScroll(id="help"):
            yield keys


def help_lines(screen: str, width: int, *, replay: bool = False) -> list[Text]:
    """Keys and signs of a screen, with their explanations in a second column.

    Those of a `replay` promise nothing for its drives.
    """
    keys = [
        (
            action.shown or WITHOUT_KEY,
            KEY,
            STOP_IN_REPLAY if replay and action in STOP_ACTIONS else action.help,
        )
        for action in screen_actions(screen)
        if not (replay and action.id.partition("(")[0] in NOT_IN_REPLAY)
    ]
    signs = [(sign, HELP_STYLES[color], meaning) for sign, color, meaning in SIGNS]
    column = max(len(key) for key, _, _ in (*keys, *signs)) + 2
    title = Text(" " * column).append(f"Keys on {screen.capitalize()}", TITLE)
    return [
        title.append("   Esc close", FAINT),
        *_rows(keys, column, width),
        Text(""),
        Text(" " * column).append("Signs", TITLE),
        *_rows(signs, column, width),
    ]


def _rows(rows: Iterable[tuple[str, Style, str]], column: int, width: int) -> Iterator[Text]:
    """Each with its explanation, wrapped."""
    for head, style, sentence in rows:
        for number, part in enumerate(wrapped(sentence, width - column, SENTENCE_LINES)):
            line = Text(no_wrap=True).append(f"{'' if number else head:<{column}}", style)
            yield line.append(part, PLAIN)
