"""The least that Textual can be: one text on the screen; `w` changes it, `?` asks, `q` leaves.

python -m benchmarks.hello
"""

from __future__ import annotations

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
    """One Static."""

    BINDINGS: ClassVar = [
        ("w", "turn", "Turn"),
        ("question_mark", "ask", "Ask"),
        ("q", "quit", "Quit"),
    ]

    _turns = 0

    def compose(self) -> ComposeResult:
        """The text."""
        yield Static(TEXTS[0])

    def action_turn(self) -> None:
        """Show the other text."""
        self._turns += 1
        self.query_one(Static).update(TEXTS[self._turns % 2])

    def action_ask(self) -> None:
        """Show the box."""
        self.push_screen(Asked())


if __name__ == "__main__":
    Hello().run()
