"""Common parts of questions: protection from accidental answers, and the motor's state.

Enter and `y` count only after the question has been visible for a moment. A key typed before was
intended for something else.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.events import Key, Resize, ScreenResume
from textual.screen import ModalScreen
from textual.widget import Widget

from tui.drive.plain import plain
from tui.safety import ANSWER_COUNTS_AFTER
from tui.widgets.palette import FAINT, KEY
from tui.widgets.plain import Plain

from ..frame import Framed

if TYPE_CHECKING:
    from tui.screens.app_port import Panel

    from .now import MotorStates

T = TypeVar("T")

DIALOG_STYLES = Path(__file__).with_name("dialogs.tcss")
"""Absolute, as Textual resolves it from the module of the subclass, which may be elsewhere."""

BORDER_ROWS, BESIDE_TEXT, LEAST_ROWS = 2, 4, 2
"""Rows of the border of a dialog; columns of its border and padding; rows
that a list keeps."""

TYPED_ON = "Key ignored: a question appeared as you typed. Wait a second, then answer."

TOO_EARLY = "Key ignored: it came before this could be read. Press it again."

NOW_EVERY = 0.5
"""Seconds between two refreshes of the motor's state."""


class Question(Framed, ModalScreen[T]):
    """A dialog with an answer; Esc means no, and so does a stop of the drive."""

    CSS_PATH = DIALOG_STYLES
    SETTLED: ClassVar[float] = 0.3
    """Seconds that a question must be visible before Enter and `y` are answers."""
    NO: ClassVar[Any] = None
    """The answer that changes nothing."""
    GUARDED: ClassVar[str] = "enter"
    """Keys that are ignored until then."""
    NO_KEYS: ClassVar[str] = ""
    """Keys that mean no, besides Esc."""
    by_itself = False
    """True if it opens without a key, while a person may be typing: until a pause, keys are
    ignored, as yes and as no."""
    BINDINGS: ClassVar = [Binding("escape", "no", show=False)]

    def __init_subclass__(cls, **how: Any) -> None:
        """Add the guard to each subclass: in Textual, its bindings replace those of the base."""
        guard = Binding(cls.GUARDED, "swallow", show=False, priority=True)
        own = [guard, *vars(cls).get("BINDINGS", ())]
        if cls.NO_KEYS:
            own.insert(0, Binding(cls.NO_KEYS, "swallow(True)", show=False, priority=True))
            own.append(Binding(cls.NO_KEYS, "no", show=False))
        cls.BINDINGS = own
        super().__init_subclass__(**how)

    def __init__(self, now: MotorStates | None = None) -> None:
        super().__init__()
        self._now = now
        self._drawn: float | None = None
        self._typed_at = -math.inf
        """When the last key arrived."""
        self._voided = self._answered = False

    def compose(self) -> ComposeResult:
        """The frame, which stays live over a question, and the dialog."""
        yield from self.framed()
        yield from self.dialog()

    def dialog(self) -> Iterable[Widget]:
        """Compose the question and its keys."""
        raise NotImplementedError

    def on_mount(self) -> None:
        """Start the guard time with the first picture, and the refresh of the motor's state."""
        self._fit_list()
        self.call_after_refresh(self._note_drawn)
        if self._now is not None:
            self.set_interval(NOW_EVERY, self._tell_now)

    def on_screen_resume(self, event: ScreenResume) -> None:
        """End a question that was canceled while another screen was on top."""
        if self._voided:
            self.call_later(self.void)

    def on_resize(self, event: Resize) -> None:
        """Fit the list to the new size."""
        if not self.is_too_small:
            self._fit_list()

    def _fit_list(self) -> None:
        """Give the list, or the scrolled part, the rows that the rest of the dialog leaves."""
        for part in self.query("#choices, #says"):
            if (box := part.parent) is None or not isinstance(box, Widget):
                continue
            wide = box.styles.width
            most = int(wide.value) if wide is not None and wide.is_cells else self.size.width
            width = min(most, self.size.width) - BESIDE_TEXT
            others = sum(self._rows(child, width) for child in box.children if child is not part)
            rows = self.dialog_rows - BORDER_ROWS - others
            least = LEAST_ROWS if part.id == "choices" else 1
            part.styles.max_height = max(least, rows - part.styles.margin.height)

    def _rows(self, part: Widget, width: int) -> int:
        """Rows of a part of the dialog, with its margins."""
        high = part.styles.height
        fixed = int(high.value) if high is not None and high.is_cells else None
        size = self.size
        rows = fixed if fixed is not None else part.get_content_height(size, size, width)
        return rows + part.styles.margin.height

    def tell_keys(self, keys: Text) -> None:
        """Replace the line of keys, which may need more rows now."""
        self.query_one("#hint", Plain).update(keys)
        self._fit_list()

    def now_lines(self) -> Iterable[Plain]:
        """Return the motors' states, if the question is about drives."""
        if self._now is not None:
            yield Plain(self._now(), id="now")

    def concerns(self, device: int) -> bool:
        """Return True if a stop of this drive cancels the question."""
        return self._now is not None and device in self._now.devices

    def void(self) -> None:
        """Cancel: end with the answer that changes nothing. Call it in the app's loop."""
        self._voided = True
        if self.is_active:
            self.answer(self.NO)

    @property
    def is_answered(self) -> bool:
        """True from the answering key on, even before the answer has been delivered."""
        return self._answered

    def answer(self, value: T) -> None:
        """Close with an answer, once; a canceled question always answers no."""
        if not self._answered:
            self._answered = True
            self.dismiss(self.NO if self._voided else value)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Enable the guard while keys come too early."""
        if action == "swallow":
            return self._is_early() and (self.by_itself or not parameters)
        return super().check_action(action, parameters)

    def on_key(self, event: Key) -> None:
        """Note when the last key arrived."""
        self._typed_at = self.app.panel_clock.monotonic()

    def action_swallow(self, as_no: bool = False) -> None:
        """Ignore a key that came too early, and report why.

        A no is ignored only if the question opened without a key."""
        self._typed_at = self.app.panel_clock.monotonic()
        self.app.tell(TYPED_ON if self.by_itself else TOO_EARLY)

    def action_no(self) -> None:
        """Answer no."""
        self.answer(self.NO)

    def _note_drawn(self) -> None:
        self._drawn = self.app.panel_clock.monotonic()

    def _is_early(self) -> bool:
        if self._drawn is None:
            return True
        now = self.app.panel_clock.monotonic()
        if self.by_itself:
            return now - max(self._drawn, self._typed_at) < ANSWER_COUNTS_AFTER
        return now - self._drawn < self.SETTLED

    def _tell_now(self) -> None:
        if self._now is not None and self.is_active:
            shown, now = self.query_one("#now", Plain), self._now()
            if str(shown.render()) != now.plain:
                shown.update(now, layout=False)


class KeyQuestion(Question[T]):
    """A question answered by keys: as no text is typed, `q` and `n` mean no, too."""

    GUARDED = "enter,y"
    NO_KEYS = "q,n"


HINT_WIDTH = 66
"""Cells of a line of keys in the widest dialog."""


def hint(*keys: tuple[str, str]) -> Text:
    """The lines of keys of a dialog: each key with its label, on one line."""
    text, used = Text(), 0
    for key, does in keys:
        cells = len(f"{key} {does}")
        is_full = used + 3 + cells > HINT_WIDTH
        text.append("" if not text else "\n" if is_full else "   ")
        used = cells if is_full or not used else used + 3 + cells
        text.append(key, KEY)
        text.append(f" {plain(does)}", FAINT)
    return text


def matches_text(count: int, shown: int | None = None) -> str:
    """Return the number of matches of a search; `shown` is how many the list can show."""
    if not count:
        return "No match. Delete some letters."
    if count == 1:
        return "1 match"
    if shown is not None and count > shown:
        return f"{count} matches, first {shown} shown"
    return f"{count} matches"


def void_questions(app: Panel, device: int) -> None:
    """Cancel every open question about a drive that was stopped. Call it in the app's loop."""
    for screen in reversed(app.screen_stack):
        if isinstance(screen, Question) and screen.concerns(device):
            screen.void()
