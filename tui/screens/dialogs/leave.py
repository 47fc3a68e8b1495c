"""The question when the panel quits while a motor runs on its command: stop it, or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from textual.binding import Binding

from .confirm import Consequences, SaveOffer

if TYPE_CHECKING:
    from .now import MotorStates

LeaveChoice = Literal["stop", "leave", "stay"]

LEAVE_KEYS = (
    ("s or Enter", "Stop and quit"),
    ("l", "Leave it running and quit"),
    ("Esc or q", "Stay"),
)


class Leave(Consequences[LeaveChoice]):
    """Asks what happens to the running motors; stopping is safe, so Enter means that, too."""

    NO: ClassVar[LeaveChoice] = "stay"
    GUARDED = "enter,l"
    BINDINGS: ClassVar = [
        Binding("s,enter", "choose('stop')", show=False),
        Binding("l", "choose('leave')", show=False),
    ]

    def __init__(
        self, follows: str, now: MotorStates | None = None, offer: SaveOffer | None = None
    ) -> None:
        super().__init__("A motor is running on your command", follows, LEAVE_KEYS, now, offer)

    def action_choose(self, choice: LeaveChoice) -> None:
        """Answer with the choice."""
        self.answer(choice)
