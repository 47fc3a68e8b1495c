"""A dialog that says what will happen and asks whether it shall."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.screen import ModalScreen

from tui.widgets.plain import Plain


class Confirm(ModalScreen[bool]):
    """Says what follows; True for the keys that go on, False for Esc."""

    CSS_PATH = "ask.tcss"
    BINDINGS: ClassVar = [
        Binding("escape,n", "dismiss(False)", "stay", show=False),
        Binding("enter,q,y", "dismiss(True)", "leave", show=False),
    ]

    def __init__(self, question: str, follows: str, keys: str) -> None:
        super().__init__()
        self._question = question
        self._follows = follows
        self._keys = keys

    def compose(self) -> ComposeResult:
        """What is asked, what follows, and the keys."""
        with Vertical(id="dialog"):
            yield Plain(self._question, id="question")
            yield Plain(self._follows, id="follows")
            yield Plain(self._keys, id="hint")
