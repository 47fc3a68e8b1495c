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
        return "A name is needed."
    if not name.isprintable():
        return "A name has no control characters."
    try:
        return f"{name} already exists." if Path(name).expanduser().exists() else ""
    except OSError as error:  # too long, or below a folder that may not be looked into
        return f"No file can be made there: {error.strerror or error}."
    except RuntimeError:
        return f"There is no home folder of {name.partition('/')[0]}."


TextCheck = Callable[[str], str]
"""Check of a text: its error, or nothing."""


class Ask(Question[str | None]):
    """Asks for a text; gives it back once it is right, or None.

    `takes` says what Enter does with it. A `number` has no spaces in it: Space stops there, as
    outside of texts.
    """

    def __init__(
        self,
        question: str,
        check: TextCheck,
        *,
        text: str = "",
        about: str = "",
        takes: str = "accept",
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
        """A field, room for what is wrong, and what an answer looks like."""
        with Vertical(id="dialog"):
            yield Plain(self._question, id="question")
            yield from self.now_lines()
            yield self._field(self._text, id="answer")
            yield Plain("", id="fault")
            yield Plain(self._about, id="about")
            yield Plain(hint(("Enter", self._takes), ("Esc", "Cancel")), id="hint")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Give the text back if nothing is wrong with it."""
        fault = self._check(event.value)
        if fault:
            self.query_one("#fault", Plain).update(fault)
        else:
            self.answer(event.value.strip())
