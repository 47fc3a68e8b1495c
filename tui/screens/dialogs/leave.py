"""Leaving while a motor runs by a command from here: stop it, or leave it running knowingly."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from tui.widgets.plain import Plain

from .question import KeyQuestion, hint

if TYPE_CHECKING:
    from .now import MotorStates

LeaveChoice = Literal["stop", "leave", "stay"]


class Leave(KeyQuestion[LeaveChoice]):
    """Confirms what happens to the motors; to stop them is safe, so Enter does that too."""

    NO: ClassVar[LeaveChoice] = "stay"
    GUARDED = "enter,l"
    BINDINGS: ClassVar = [
        Binding("s,enter", "choose('stop')", show=False),
        Binding("l", "choose('leave')", show=False),
    ]

    def __init__(self, follows: str, now: MotorStates | None = None) -> None:
        super().__init__(now)
        self._follows = follows

    def dialog(self) -> ComposeResult:
        """Compose the running motors, the consequences of leaving, and the keys."""
        with Vertical(id="dialog"):
            yield Plain("A motor runs by your command", id="question")
            yield from self.now_lines()
            with VerticalScroll(id="says"):
                yield Plain(self._follows, id="follows")
            yield Plain(
                hint(
                    ("s or Enter", "Stop and leave"),
                    ("l", "Leave running"),
                    ("Esc or q", "Stay"),
                ),
                id="hint",
            )

    def action_choose(self, choice: LeaveChoice) -> None:
        """Give the choice back."""
        self.answer(choice)
