"""Line: choose a line, find the drives on it, see what all of them do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from textual.widgets import Input, OptionList

from ..keys.action import CONNECTION
from ..keys.table import bindings
from .diagnosis_target import DiagnosisTarget
from .other_settings import OtherSettings

if TYPE_CHECKING:
    from tui.session.console import DriveConsole


class ConnectionScreen(DiagnosisTarget, OtherSettings):
    """Actions of the cursor and Enter in the two lists."""

    CSS_PATH = "connection.tcss"
    BINDINGS: ClassVar = bindings(CONNECTION)
    TITLE = "Line"
    AUTO_FOCUS = "#lines"

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Enter on a line opens it, Enter on a drive watches it."""
        if event.option_list is self.drives:
            self.open_drive(int(event.option.id or 0))
        elif choice := self.lines.choice(event.option.id):
            self.open_line(self.line_of(choice), choice.device)

    def on_option_list_option_highlighted(self, event: OptionList.OptionHighlighted) -> None:
        """Say all that the chosen drive says of itself; only a port has settings."""
        if event.option_list is self.lines:
            choice = self.lines.choice(event.option.id)
            self.form.offer_settings(bool(choice and choice.path))
        else:
            self.show_about()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Enter in a field: other addresses are for the line that is open."""
        if event.input.id != "addresses" or self.app.fleet is None:
            self.action_open_chosen()
            return
        if self.action_scan():
            self.lines.focus()

    def typing_keys(self) -> Sequence[tuple[str, str]]:
        """Enter in a field does what it does in the list; other addresses are searched."""
        field = self.focused
        asks = field is not None and field.id == "addresses" and self.app.fleet is not None
        searches = asks or self.is_on_open_line()
        return (("Enter", "scan" if searches else "open"), ("Esc", "to the list"))

    def point_at(self, device: int) -> None:
        """The cursor on the drive that is open: Enter opens that one again."""
        self.drives.point_at(device)

    @property
    def pointed(self) -> DriveConsole | None:
        """The drive under the cursor, where it is known what it is."""
        drive = self.found.get(self.drives.chosen or 0)
        return drive.console if drive else None

    def action_open_chosen(self) -> None:
        """Open the chosen entry of a list; a field passes Enter to the list of lines."""
        focused = self.focused
        if isinstance(focused, OptionList):
            focused.action_select()
            return
        self.lines.focus()
        if self.is_on_open_line():
            self.action_scan()  # by what was typed
        else:
            self.lines.action_select()
