"""Leaving while a motor runs by an order from here: stop it, or leave it running knowingly."""

from __future__ import annotations

from typing import ClassVar, Literal

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.screen import ModalScreen

from tui.widgets.plain import Plain

Choice = Literal["stop", "leave", "stay"]


class Leave(ModalScreen[Choice]):
    """Asks what becomes of the motors."""

    CSS_PATH = "ask.tcss"
    BINDINGS: ClassVar = [
        Binding("s,enter", "dismiss('stop')", "stop and leave", show=False),
        Binding("l", "dismiss('leave')", "leave running", show=False),
        Binding("escape,n", "dismiss('stay')", "stay", show=False),
    ]

    def __init__(self, follows: str) -> None:
        super().__init__()
        self._follows = follows

    def compose(self) -> ComposeResult:
        """What runs, what happens when it is left, and the keys."""
        with Vertical(id="dialog"):
            yield Plain("A motor runs by your order", id="question")
            yield Plain(self._follows, id="follows")
            yield Plain("s or Enter: stop and leave   l: leave it running   Esc: stay", id="hint")
