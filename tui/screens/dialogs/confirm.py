"""Dialogs that state what follows: one asks for a yes or a no."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from tui.widgets.palette import ALARM
from tui.widgets.plain import Plain

from .question import KeyQuestion, hint

if TYPE_CHECKING:
    from .now import MotorStates

T = TypeVar("T")


class SaveOffer(NamedTuple):
    """The offer of a question to save to EEPROM what would be lost."""

    text: str
    """Label of the key S."""
    work: Callable[[], object]
    """Called after the question has been answered with no."""


class Consequences(KeyQuestion[T]):
    """States what follows; the text scrolls if the terminal is too small for it.

    With an `offer`, S answers no and saves first.
    """

    BINDINGS: ClassVar = [Binding("S", "save", show=False)]

    def __init__(
        self,
        question: str,
        follows: str,
        keys: tuple[tuple[str, str], ...],
        now: MotorStates | None = None,
        offer: SaveOffer | None = None,
    ) -> None:
        super().__init__(now)
        self._question, self._follows, self._offer = question, follows, offer
        *yes, no = keys
        self._keys = hint(*yes, *([("S", offer.text)] if offer is not None else []), no)

    def dialog(self) -> ComposeResult:
        """The question, the motor's state, the consequences, and the keys."""
        with Vertical(id="dialog"):
            yield Plain(self._question, id="question")
            yield from self.now_lines()
            with VerticalScroll(id="says"):
                yield Plain(self._follows, id="follows")
            yield Plain(self._keys, id="hint")

    def on_mount(self) -> None:
        """Name the scroll keys if the text is too long for the terminal."""
        self.call_after_refresh(self._tell_scrolling)

    def _tell_scrolling(self) -> None:
        says = self.query("#says")  # none if a stop has ended the question
        if says and says.first().max_scroll_y:
            self._keys.append("   ").append_text(hint(("Up, Down", "Scroll")))
            self.tell_keys(self._keys)

    def tell_follows(self, follows: str) -> None:
        """Replace the consequences, once more is known."""
        if self.is_attached and self.query("#follows"):
            self.query_one("#follows", Plain).update(follows)
            self._fit_list()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Disable saving without an offer."""
        if action == "save":
            return self._offer is not None
        return super().check_action(action, parameters)

    def action_save(self) -> None:
        """Answer no, and save first."""
        if self._offer is not None:
            self.answer(self.NO)
            self.app.call_later(self._offer.work)


class Confirm(Consequences[bool]):
    """Answers True for `y`, and False for Esc, `q` and `n`.

    `yes` and `no` are the labels of the keys. If it `loses` nothing, because nothing is written,
    moved or deleted, Enter means yes, too. A question that opens `by_itself` accepts an answer
    only after a pause in typing.
    """

    NO = False
    BINDINGS: ClassVar = [
        Binding("y", "yes", show=False),
        Binding("enter", "enter", show=False),
    ]

    def __init__(
        self,
        question: str,
        follows: str,
        *,
        yes: str,
        no: str,
        loses: bool,
        now: MotorStates | None = None,
        by_itself: bool = False,
        offer: SaveOffer | None = None,
    ) -> None:
        keys = ("y" if loses else "y or Enter", yes), ("Esc or q", no)
        super().__init__(question, follows, keys, now, offer)
        self.by_itself = by_itself
        self._loses = loses

    def action_yes(self) -> None:
        """Answer yes."""
        self.answer(True)

    def action_enter(self) -> None:
        """Answer yes if nothing can be lost; else show which keys answer."""
        if not self._loses:
            self.answer(True)
            return
        reported = Text().append("Press y or Esc.   ", ALARM)
        self.tell_keys(reported.append_text(self._keys))
