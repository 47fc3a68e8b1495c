"""Line: choose a line, find its drives, and monitor all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from textual.events import DescendantFocus
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
    """Target of a diagnosis: the line and drive under the cursor, else the first address."""

    def why_target_now(self) -> WhyTarget | None:
        """Return the drive to diagnose; None without a line or a valid address."""
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
        """Return the line to monitor, empty if there is none, and the profile typed for it."""
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
        """Return the error of the last attempt to open this line; None if it did not fail."""
        if self.refused is None or not same_line(self.refused[0], text):
            return None
        return self.refused[1]


class ConnectionScreen(DiagnosisTarget, OtherSettings):
    """Screen with the cursor and Enter actions of its two lists."""

    CSS_PATH = "connection.tcss"
    BINDINGS: ClassVar = bindings(CONNECTION)
    TITLE = "Line"
    AUTO_FOCUS = "#lines"

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Open the chosen line, or Monitor on the chosen drive."""
        if event.option_list is self.drives:
            self.open_drive(int(event.option.id or 0))
        elif choice := self.lines.choice(event.option.id):
            self.open_line(self.line_of(choice), choice.device)

    def on_option_list_option_highlighted(self, event: OptionList.OptionHighlighted) -> None:
        """Enable the serial settings for a chosen port."""
        if event.option_list is self.lines:
            self.form.offer_settings(self.lines.choice(event.option.id))

    def on_descendant_focus(self, event: DescendantFocus) -> None:
        """Show the lines and the form when the cursor goes there, and hide them when it leaves."""
        if self.is_current and self.found:
            self._give_room()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Scan the open line at the typed addresses; from another field, open the chosen line."""
        if event.input.id != "addresses" or self.app.fleet is None:
            self.action_open_chosen()
            return
        if self.action_scan():
            self.lines.focus()

    def typing_keys(self) -> Sequence[tuple[str, str]]:
        """Return the effects of Enter and Esc in a field; Enter scans if the line is open."""
        field = self.focused
        asks = field is not None and field.id == "addresses" and self.app.fleet is not None
        searches = asks or self.is_on_open_line()
        return (("Enter", "scan" if searches else "open"), ("Esc", "list"))

    def point_at(self, device: int) -> None:
        """Move the cursor to the open drive, so that Enter opens it again."""
        self.drives.point_at(device)

    @property
    def pointed(self) -> DriveConsole | None:
        """The drive under the cursor; None if it has no profile."""
        drive = self.found.get(self.drives.chosen or 0)
        return drive.console if drive else None

    def action_open_chosen(self) -> None:
        """Open the chosen entry of a list; from a field, open the chosen line or scan it."""
        focused = self.focused
        if isinstance(focused, OptionList):
            focused.action_select()
            return
        self.lines.focus()
        if self.is_on_open_line():
            self.action_scan()  # with the typed addresses and profile
        else:
            self.lines.action_select()
