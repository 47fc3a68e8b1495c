"""A dialog that asks for one text, and does not let go of a wrong one."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input

from tui.widgets.fields import Field, NumberInput
from tui.widgets.plain import Plain

Check = Callable[[str], str]
"""What is wrong with a text, or nothing."""


class Ask(ModalScreen[str | None]):
    """Asks a question; gives the answer back once it is right, or None.

    A `number` has no spaces in it: Space stops there, as outside of texts.
    """

    CSS_PATH = "ask.tcss"
    BINDINGS: ClassVar = [Binding("escape", "dismiss(None)", "cancel", show=False)]

    def __init__(
        self,
        question: str,
        check: Check,
        *,
        text: str = "",
        about: str = "",
        number: bool = False,
    ) -> None:
        super().__init__()
        self._field = NumberInput if number else Field
        self._question = question
        self._check = check
        self._text = text
        self._about = about

    def compose(self) -> ComposeResult:
        """A field, room for what is wrong, and what an answer looks like."""
        with Vertical(id="dialog"):
            yield Plain(self._question, id="question")
            yield self._field(self._text, id="answer")
            yield Plain("", id="fault")
            yield Plain(self._about, id="about")
            yield Plain("Enter accept   Esc cancel", id="hint")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Give the answer back if nothing is wrong with it."""
        fault = self._check(event.value)
        if fault:
            self.query_one("#fault", Plain).update(fault)
        else:
            self.dismiss(event.value.strip())
