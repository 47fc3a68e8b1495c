"""Common parts of questions: no answer by accident, and the motor's state.

Enter and `y` count only once the question has stood on the screen for a moment: a key that was
typed before it was there was meant for something else.
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
"""Absolute, as Textual looks beside the class that inherits it, which may be of another room."""

DIALOG_SHARE, BORDER_ROWS, BESIDE_TEXT, LEAST_ROWS = 0.83, 2, 4, 2
"""Of the screen's rows those of a dialog at most; of its border; columns of border and padding;
rows that a list keeps."""

TYPED_ON = "A question came meanwhile: after a second without a key it takes an answer."

TOO_EARLY = "Key ignored: it came before this could be read. Press it again."

NOW_EVERY = 0.5
"""Seconds between two looks at what the motor does."""


class Question(Framed, ModalScreen[T]):
    """A dialog that gives an answer back; Esc is no, as is a stop of the drive meanwhile."""

    CSS_PATH = DIALOG_STYLES
    SETTLED: ClassVar[float] = 0.3
    """Seconds that a question has stood before Enter and `y` are answers."""
    NO: ClassVar[Any] = None
    """The answer that changes nothing."""
    GUARDED: ClassVar[str] = "enter"
    """Keys that are swallowed until the question has stood for that time."""
    NO_KEYS: ClassVar[str] = ""
    """Keys that are no, besides Esc."""
    by_itself = False
    """True if it comes while a person may be typing something else: continued typing answers
    nothing, neither yes nor no."""
    BINDINGS: ClassVar = [Binding("escape", "no", show=False)]

    def __init_subclass__(cls, **how: Any) -> None:
        """Guard the keys of each question: Textual lets a class replace those of its base."""
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
        """When the last key came."""
        self._voided = self._answered = False

    def compose(self) -> ComposeResult:
        """The frame, which is live over a question too, and what is asked."""
        yield from self.framed()
        yield from self.dialog()

    def dialog(self) -> Iterable[Widget]:
        """Compose the question and its keys."""
        raise NotImplementedError

    def on_mount(self) -> None:
        """From its first picture on it is asked."""
        self._fit_list()
        self.call_after_refresh(self._stands)
        if self._now is not None:
            self.set_interval(NOW_EVERY, self._tell_now)

    def on_screen_resume(self, event: ScreenResume) -> None:
        """A question that was voided below another screen ends now."""
        if self._voided:
            self.call_later(self.void)

    def on_resize(self, event: Resize) -> None:
        """More room, or less."""
        if not self.is_too_small:
            self._fit_list()

    def _fit_list(self) -> None:
        """Give a list, or what can be scrolled, the rows that the rest of the dialog leaves."""
        for part in self.query("#choices, #says"):
            if (box := part.parent) is None or not isinstance(box, Widget):
                continue
            wide = box.styles.width
            most = int(wide.value) if wide is not None and wide.is_cells else self.size.width
            width = min(most, self.size.width) - BESIDE_TEXT
            others = sum(self._rows(child, width) for child in box.children if child is not part)
            rows = int(self.size.height * DIALOG_SHARE) - BORDER_ROWS - others
            part.styles.max_height = max(LEAST_ROWS, rows - part.styles.margin.height)

    def _rows(self, part: Widget, width: int) -> int:
        """Rows of a part of the dialog, with what is above and below it."""
        high = part.styles.height
        fixed = int(high.value) if high is not None and high.is_cells else None
        size = self.size
        rows = fixed if fixed is not None else part.get_content_height(size, size, width)
        return rows + part.styles.margin.height

    def tell_keys(self, keys: Text) -> None:
        """Show the keys again; they may take more rows than before."""
        self.query_one("#hint", Plain).update(keys)
        self._fit_list()

    def now_lines(self) -> Iterable[Plain]:
        """Return the motors' states, if the question is about drives."""
        if self._now is not None:
            yield Plain(self._now(), id="now")

    def concerns(self, device: int) -> bool:
        """Return True if a stop of this drive voids the question."""
        return self._now is not None and device in self._now.devices

    def void(self) -> None:
        """End with the answer that changes nothing; belongs to the loop of the screen."""
        self._voided = True
        if self.is_active:
            self.answer(self.NO)

    @property
    def is_answered(self) -> bool:
        """True from the key that answers on, before the answer has reached the one who asked."""
        return self._answered

    def answer(self, value: T) -> None:
        """Give the answer back, once; a voided question has but one."""
        if not self._answered:
            self._answered = True
            self.dismiss(self.NO if self._voided else value)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """A key that comes too early is swallowed; later the binding does not count."""
        if action == "swallow":
            return self._is_early() and (self.by_itself or not parameters)
        return super().check_action(action, parameters)

    def on_key(self, event: Key) -> None:
        """Note when the last key came."""
        self._typed_at = self.app.clock.monotonic()

    def action_swallow(self, as_no: bool = False) -> None:
        """Ignore a key and report why. A no waits only if no key asked the question."""
        self._typed_at = self.app.clock.monotonic()
        self.app.tell(TYPED_ON if self.by_itself else TOO_EARLY)

    def action_no(self) -> None:
        """Change nothing."""
        self.answer(self.NO)

    def _stands(self) -> None:
        self._drawn = self.app.clock.monotonic()

    def _is_early(self) -> bool:
        if self._drawn is None:
            return True
        now = self.app.clock.monotonic()
        if self.by_itself:
            return now - max(self._drawn, self._typed_at) < ANSWER_COUNTS_AFTER
        return now - self._drawn < self.SETTLED

    def _tell_now(self) -> None:
        if self._now is not None and self.is_active:
            shown, now = self.query_one("#now", Plain), self._now()
            if str(shown.render()) != now.plain:
                shown.update(now, layout=False)


class KeyQuestion(Question[T]):
    """A question answered by keys alone: no text is typed, so `q` and `n` mean no too."""

    GUARDED = "enter,y"
    NO_KEYS = "q,n"


def hint(*keys: tuple[str, str]) -> Text:
    """The line of keys of a dialog: each key and what it does."""
    text = Text()
    for key, does in keys:
        text.append("   " if text else "")
        text.append(key, KEY)
        text.append(f" {plain(does)}", FAINT)
    return text


def void_questions(app: Panel, device: int) -> None:
    """End every open question about a drive that was stopped; belongs to the screen's loop."""
    for screen in reversed(app.screen_stack):
        if isinstance(screen, Question) and screen.concerns(device):
            screen.void()
