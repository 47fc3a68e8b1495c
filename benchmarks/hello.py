"""The smallest Textual program: one text on the screen; `w` changes it, `?` asks, `q` exits.

    python -m benchmarks.hello [TEXTS LINES]

With TEXTS texts side by side, each of LINES lines, `w` changes all of them.
"""

from __future__ import annotations

import sys
from typing import ClassVar

from textual.app import App, ComposeResult
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

HELP = "\n".join(f"Line {number} of a help as long as that of the panel." for number in range(40))
TEXTS = ("Hello, world", "Good day, all")


class Asked(ModalScreen[None]):
    """A text that scrolls, in a box over the screen."""

    CSS = """
    Asked { align: center middle; }
    Asked VerticalScroll { width: 76; height: auto; max-height: 83vh; border: round white; }
    """
    BINDINGS: ClassVar = [("question_mark", "dismiss(None)", "Close")]

    def compose(self) -> ComposeResult:
        """The text in its box."""
        with VerticalScroll():
            yield Static(HELP)


class Hello(App[None]):
    """One Static, or several beside each other."""

    CSS = "#_default { layout: horizontal; } #_default Static { width: 1fr; }"
    BINDINGS: ClassVar = [
        ("w", "turn", "Turn"),
        ("question_mark", "ask", "Ask"),
        ("q", "quit", "Quit"),
    ]

    def __init__(self, texts: int = 1, lines: int = 1) -> None:
        super().__init__()
        self._texts, self._lines, self._turns = texts, lines, 0

    def compose(self) -> ComposeResult:
        """The text."""
        for _ in range(self._texts):
            yield Static(self._text())

    def action_turn(self) -> None:
        """Show the other text."""
        self._turns += 1
        for text in self.query(Static):
            text.update(self._text())

    def _text(self) -> str:
        return "\n".join([TEXTS[self._turns % 2]] * self._lines)

    def action_ask(self) -> None:
        """Show the box."""
        self.push_screen(Asked())


if __name__ == "__main__":
    Hello(*map(int, sys.argv[1:])).run()
