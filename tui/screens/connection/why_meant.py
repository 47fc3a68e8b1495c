"""Which drive on which line the cursor of Line means, where one does not answer."""

from __future__ import annotations

from tui.bus.errors import LineError

from ..dialogs.why_target import WhyTarget
from .choices import same_line
from .line_keys import LineKeys


class WhyMeant(LineKeys):
    """The line under the cursor, the drive under the cursor, else the first address to search."""

    def why_meant(self) -> WhyTarget | None:
        """None where no line is chosen, or no address can be made out."""
        choice = self.lines.chosen
        text = self.app.line_text
        if choice is not None and (self.focused is self.lines or not text):
            text = self.line_of(choice)
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
            tuple(one for one in found if one != device),
            self._trouble_of(text),
        )

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
