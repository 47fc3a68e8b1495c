"""A dialog to type a line."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Label

from tui.bus.errors import LinkSyntaxError
from tui.session.lines import check_line

FORMS = (
    "serial:/dev/ttyUSB0,19200,8E1",
    "tcp:192.168.0.10:502",
    "rtu-tcp:192.168.0.10:4001",
    "sim:atv71@2,atv21",
)


class LineDialog(ModalScreen[str | None]):
    """Asks for a LINE; gives it back, or None."""

    CSS_PATH = "line_dialog.tcss"
    BINDINGS: ClassVar = [Binding("escape", "dismiss(None)", "cancel", show=False)]

    def __init__(self, text: str = "") -> None:
        super().__init__()
        self._text = text

    def compose(self) -> ComposeResult:
        """A field with the forms that are understood."""
        with Vertical(id="dialog"):
            yield Label("Line to open", id="title")
            yield Input(self._text, id="line", compact=True, placeholder=FORMS[0])
            yield Label("", id="fault")
            yield Label("\n".join(FORMS), id="forms")
            yield Label("Enter open   Esc cancel", id="hint")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Give the line back if it can be understood."""
        try:
            check_line(event.value)
        except LinkSyntaxError as error:
            self.query_one("#fault", Label).update(str(error))
            return
        self.dismiss(event.value.strip())
