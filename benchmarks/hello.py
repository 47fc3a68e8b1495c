"""The least that Textual can be: one text on the screen; `w` changes it, `q` leaves.

python -m benchmarks.hello
"""

from __future__ import annotations

from typing import ClassVar

from textual.app import App, ComposeResult
from textual.widgets import Static

TEXTS = ("Hello, world", "Good day, all")


class Hello(App[None]):
    """One Static."""

    BINDINGS: ClassVar = [("w", "turn", "Turn"), ("q", "quit", "Quit")]

    _turns = 0

    def compose(self) -> ComposeResult:
        """The text."""
        yield Static(TEXTS[0])

    def action_turn(self) -> None:
        """Show the other text."""
        self._turns += 1
        self.query_one(Static).update(TEXTS[self._turns % 2])


if __name__ == "__main__":
    Hello().run()
