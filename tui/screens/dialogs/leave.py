"""The question when the panel quits while a motor runs on its command: stop it, or not."""

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
    """Asks what happens to the running motors; stopping is safe, so Enter means that, too."""

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
        """The running motors, the consequences of quitting, and the keys."""
        with Vertical(id="dialog"):
            yield Plain("A motor is running on your command", id="question")
            yield from self.now_lines()
            with VerticalScroll(id="says"):
                yield Plain(self._follows, id="follows")
            yield Plain(
                hint(
                    ("s or Enter", "Stop and quit"),
                    ("l", "Leave it running and quit"),
                    ("Esc or q", "Stay"),
                ),
                id="hint",
            )

    def action_choose(self, choice: LeaveChoice) -> None:
        """Answer with the choice."""
        self.answer(choice)
