"""Line: choose a line, find the drives on it, see what all of them do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from textual.widgets import Input, OptionList

from tui.bus.errors import LineError

from ..dialogs.why_target import WhyTarget
from ..keys.action import CONNECTION
from ..keys.table import bindings
from .choices import same_line
from .line_keys import LineKeys
from .other_settings import OtherSettings

if TYPE_CHECKING:
    from tui.session.console import DriveConsole


class DiagnosisTarget(LineKeys):
    """The line under the cursor, the drive under the cursor, else the first address to search."""

    def why_target_now(self) -> WhyTarget | None:
        """None where no line is chosen, or no address can be made out."""
        text = self._line_target()
        if not text:
            return None
        here = self.app.open_line_of(text)
        found = here.fleet.found if here is not None else {}
        shown = here is not None and here.opened is self.app.opened
        device = self.drives.chosen if shown and found else next(iter(found), None)
        device = device or self._first_address()
        if device is None:
            return None
        drive = found.get(device)
        console = drive.console if drive is not None else None
        return WhyTarget(
            text,
            device,
            here.opened if here is not None else None,
            console.session.profile.id if console is not None else self.form.profile,
            tuple(number for number in found if number != device),
            self._trouble_of(text),
        )

    def line_to_hear(self) -> tuple[str, str]:
        """The line that is meant, empty for none, and the profile that was typed for it."""
        return self._line_target(), self.form.profile

    def _line_target(self) -> str:
        choice, text = self.lines.chosen, self.app.line_text
        if choice is not None and (self.focused is self.lines or not text):
            return self.line_of(choice)
        return text

    def _first_address(self) -> int | None:
        try:
            return next(iter(self.form.addresses()), None)
        except LineError:
            return None

    def _trouble_of(self, text: str) -> LineError | None:
        """Why this line could not be opened when that was tried last."""
        if self.refused is None or not same_line(self.refused[0], text):
            return None
        return self.refused[1]


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
        return (("Enter", "scan" if searches else "open"), ("Esc", "list"))

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
