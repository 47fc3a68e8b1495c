"""A dialog that asks for one text, such as a file name, and does not accept a wrong one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input

from tui.widgets.fields import Field, NumberInput
from tui.widgets.plain import Plain

from .question import Question, hint

if TYPE_CHECKING:
    from .now import MotorStates


def fault_of_new(name: str) -> str:
    """Return the error in a name for a new file, or nothing."""
    if not name.strip():
        return "Enter a file name."
    if not name.isprintable():
        return "A file name cannot contain control characters."
    try:
        return f"{name} already exists." if Path(name).expanduser().exists() else ""
    except OSError as error:  # too long, or below a folder that may not be looked into
        return f"The file cannot be created: {error.strerror or error}."
    except RuntimeError:
        return f"{name.partition('/')[0]} has no home folder."


TextCheck = Callable[[str], str]
"""Returns the error in a text, or an empty text."""


class Ask(Question[str | None]):
    """Asks for a text; answers with a valid text, or None.

    `takes` is the label of Enter. In a `number`, Space stops the motor, as outside text fields.
    """

    def __init__(
        self,
        question: str,
        check: TextCheck,
        *,
        text: str = "",
        about: str = "",
        takes: str = "OK",
        number: bool = False,
        now: MotorStates | None = None,
    ) -> None:
        super().__init__(now)
        self._field = NumberInput if number else Field
        self._question = question
        self._check = check
        self._text = text
        self._about = about
        self._takes = takes

    def dialog(self) -> ComposeResult:
        """The question, a field, room for an error, and a description of the answer."""
        with Vertical(id="dialog"):
            yield Plain(self._question, id="question")
            yield from self.now_lines()
            yield self._field(self._text, id="answer")
            yield Plain("", id="fault")
            yield Plain(self._about, id="about")
            yield Plain(hint(("Enter", self._takes), ("Esc", "Cancel")), id="hint")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Answer with the text if it is valid."""
        fault = self._check(event.value)
        if fault:
            self.query_one("#fault", Plain).update(fault)
        else:
            self.answer(event.value.strip())
