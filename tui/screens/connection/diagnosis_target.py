"""Which drive on which line the cursor of Line means, where one does not answer."""

from __future__ import annotations

from tui.bus.errors import LineError

from ..dialogs.why_target import WhyTarget
from .choices import same_line
from .line_keys import LineKeys


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
