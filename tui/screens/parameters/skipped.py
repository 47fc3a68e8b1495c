"""What of a parameter set is not staged, and why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import VerticalScroll
from textual.screen import ModalScreen

from tui.drive.plain import plain
from tui.drive.settings.restore_plan import RestoreItem
from tui.widgets.palette import PLAIN, STRONG
from tui.widgets.plain import Plain

from ..dialogs.question import DIALOG_STYLES, hint
from ..frame import Framed


class Skipped(Framed, ModalScreen[None]):
    """A list to read through; scrolls."""

    CSS_PATH = DIALOG_STYLES
    BINDINGS: ClassVar = [Binding("escape,enter,q", "dismiss(None)", show=False)]

    def __init__(self, staged: int, label: str, left: Sequence[RestoreItem]) -> None:
        super().__init__()
        self._head = f"{staged} staged from {label}; {len(left)} left out"
        self._left = left

    def compose(self) -> ComposeResult:
        """The frame, and the list."""
        yield from self.framed()
        yield from self.dialog()

    def dialog(self) -> ComposeResult:
        """Each with its reason."""
        table = Table.grid(padding=(0, 2, 0, 0))
        for item in self._left:
            table.add_row(
                Text(plain(item.code), STRONG, no_wrap=True), Text(plain(item.text), PLAIN)
            )
        with VerticalScroll(id="dialog"):
            yield Plain(self._head, id="question")
            yield Plain(table)
            yield Plain(hint(("Up and Down", "scroll"), ("Esc", "closes")))
