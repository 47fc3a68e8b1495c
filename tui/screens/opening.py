"""Monitor while its drive is not known yet: the progress of opening it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.widget import Widget

from tui.widgets.drawing import wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import FAINT, STRONG

from .base import PanelScreen
from .keys.action import OPENING
from .keys.table import bindings

if TYPE_CHECKING:
    from .app_port import Panel

DOING_LINES = 4


def leave_opening(app: Panel) -> None:
    """Return to Line, which reports why the drive named at the start is not shown."""
    while any(isinstance(screen, OpeningScreen) for screen in app.screen_stack):
        app.pop_screen()


class OpeningScreen(PanelScreen):
    """The first screen if a drive was named at the start; Monitor replaces it."""

    BINDINGS: ClassVar = bindings(OPENING)
    TITLE = "Monitor"
    DEFAULT_CSS = "OpeningScreen #doing { height: 1fr; }"
    LOOK = 0.25

    def __init__(self, line: str, device: int) -> None:
        super().__init__()
        self._line = line
        self._device = device

    def body(self) -> Iterable[Widget]:
        """One place, for the progress."""
        doing = Lines(id="doing")
        doing.show(self._lines(self.app.size.width))
        yield doing

    def draw(self, width: int) -> None:
        """Draw the progress."""
        super().draw(width)
        self.put("doing", self._lines(width))

    def _lines(self, width: int) -> list[Text]:
        opened = self.app.line_label
        now = f"Drive {self._device} on {opened or self._line}"
        next_step = (
            "Identifying the drive. Monitor opens next."
            if opened
            else "Opening the line. Press Esc to cancel. Other keys are ignored."
        )
        room = max(10, width - 4)
        lines = [Text(f"  {part}", STRONG) for part in wrapped(now, room, DOING_LINES)]
        lines += [Text(f"  {part}", FAINT) for part in wrapped(next_step, room, DOING_LINES)]
        return [Text(""), *lines]

    @property
    def name_of_screen(self) -> str:
        """Its own name: without a drive, the keys of Monitor do not work here."""
        return OPENING
