"""Result of each edit to be written, and the question before the rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from rich.style import Style
from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from tui.drive.plain import plain
from tui.drive.values import NOT_AVAILABLE
from tui.session.settings.applied import Applied, EditOutcome, Result
from tui.widgets.palette import ALARM, ATTENTION, FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain

from ..dialogs.question import KeyQuestion, hint

if TYPE_CHECKING:
    from ..dialogs.now import MotorStates

OUTCOME_WORDS = {
    EditOutcome.DONE: "written",
    EditOutcome.SENT: "sent",
    EditOutcome.WAITS: "not yet written",
}
"""Results of an edit in a word; any other was not written."""


class Results(KeyQuestion[bool | None]):
    """A list to read through; scrolls. True if what was written is to be saved next."""

    BINDINGS: ClassVar = [
        Binding("enter", "no", show=False),
        Binding("S", "save", show=False),
    ]

    def __init__(self, applied: Applied, *, staged: bool = False) -> None:
        """`staged` says whether edits are left: u takes those back first."""
        super().__init__()
        self._applied, self._staged = applied, staged

    def dialog(self) -> ComposeResult:
        """Each with its result."""
        with Vertical(id="dialog"):
            yield Plain(results_head(self._applied), id="question")
            with VerticalScroll(id="says"):
                yield Plain(results_table(self._applied))
            keys = [("Enter or Esc", "close")]
            if self._applied.unsaved:
                keys.append(("S", "save to EEPROM, asks"))
            if self._applied.written and not self._staged:
                keys.append(("u", "afterwards stages the old values"))
            yield Plain(hint(*keys), id="hint")

    def action_save(self) -> None:
        """Close, and ask whether to save to EEPROM."""
        self.answer(True)


class RestQuestion(KeyQuestion[bool]):
    """True if the edits after one that failed are written anyway."""

    NO = False
    by_itself = True
    BINDINGS: ClassVar = [Binding("y", "yes", show=False)]

    def __init__(self, applied: Applied, now: MotorStates) -> None:
        super().__init__(now)
        self._applied = applied

    def dialog(self) -> ComposeResult:
        """Compose the failures, the edits held back with them, and those still possible."""
        count = len(self._applied.waits)
        item = count == 1
        with Vertical(id="dialog"):
            rest = "parameter" if item else f"{count} parameters"
            yield Plain(f"Write the other {rest} anyway?", id="question")
            yield from self.now_lines()
            with VerticalScroll(id="says"):
                yield Plain(results_table(self._applied))
            keys = (("y", "Write"), ("Esc or q", "Stop here"))
            yield Plain(hint(*keys), id="hint")

    def action_yes(self) -> None:
        """Go on with the rest."""
        self.answer(True)


def results_head(applied: Applied) -> str:
    """Return how many were written, and how many were not."""
    done, failed = len(applied.written), len(applied.results) - len(applied.written)
    head = f"Wrote {done}, all verified" if done else "Nothing written"
    return f"{head}. {failed} not written, still staged" if failed else head


def results_table(applied: Applied) -> Table:
    """A line an edit: code, result, old and new value; the reason below it."""
    table = Table.grid(padding=(0, 2, 0, 0))
    for result in applied.results:
        edit = result.edit
        values = f"{edit.old_text or NOT_AVAILABLE} → {edit.text}"
        word = OUTCOME_WORDS.get(result.outcome, "NOT WRITTEN")
        table.add_row(
            Text(edit.code, STRONG, no_wrap=True),
            Text(word, _style(result), no_wrap=True),
            Text(plain(values), PLAIN),
        )
        if not result.done and result.outcome is not EditOutcome.WAITS:
            table.add_row(Text(), Text(), Text(plain(result.text), FAINT))
    return table


def _style(result: Result) -> Style:
    if result.done:
        return PLAIN
    return ATTENTION if result.outcome is EditOutcome.WAITS else ALARM
