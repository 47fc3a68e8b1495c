"""Values of a parameter set that are not staged, and why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from tui.drive.plain import plain
from tui.drive.settings.restore_plan import RestoreItem
from tui.widgets.palette import PLAIN, STRONG
from tui.widgets.plain import Plain

from ..dialogs.question import KeyQuestion, hint

SKIPPED_KEYS = hint(("Enter or Esc", "close"), ("Up, Down", "scroll"))


class Skipped(KeyQuestion[None]):
    """A list to read through; scrolls."""

    BINDINGS: ClassVar = [Binding("enter", "no", show=False)]

    def __init__(self, staged: int, label: str, left: Sequence[RestoreItem]) -> None:
        super().__init__()
        self._head = f"{staged} staged from {label}; {len(left)} left out"
        self._left = left

    def dialog(self) -> ComposeResult:
        """Each with its reason."""
        table = Table.grid(padding=(0, 2, 0, 0))
        for item in self._left:
            table.add_row(
                Text(plain(item.code), STRONG, no_wrap=True), Text(plain(item.text), PLAIN)
            )
        with Vertical(id="dialog"):
            yield Plain(self._head, id="question")
            with VerticalScroll(id="says"):
                yield Plain(table)
            yield Plain(SKIPPED_KEYS, id="hint")
