"""Keys of the Connection screen that open and close a line."""

from __future__ import annotations

from textual import work

from tui.bus.errors import LineError
from tui.drive.errors import DriveError

from .choices import LINE_FORMS, LineChoice, fault_of_line
from .scanning import Scanning


class LineKeys(Scanning):
    """A line that was opened is searched for drives at once."""

    def action_refresh_lines(self) -> None:
        """Look for serial ports and recent lines."""
        self.lines.look_for_lines()
        self.lines.fill()

    def line_of(self, choice: LineChoice) -> str:
        """The line of a choice, with the settings of the form where it is a port."""
        return self.form.line_at(choice.path) if choice.path else choice.text

    def action_type_line(self) -> None:
        """Type a line."""
        from .dialogs.ask import Ask

        def typed(text: str | None) -> None:
            if text:
                self.open_line(text)

        about = "\n".join(LINE_FORMS)
        dialog = Ask(
            "Line to open", fault_of_line, text=self.app.line_text, about=about, takes="opens it"
        )
        self.app.push_screen(dialog, typed)

    @work(exclusive=True, group="line", exit_on_error=False)
    async def open_line(self, text: str) -> None:
        """Open a line and ask for its drives."""
        question = "Close the line for another?"
        if not await self.app.may_let_go(question, yes="closes it", no="keeps it"):
            return
        self.forget_drives()
        self.say(f"Opening {text}", "")
        if await self._opens(text):
            self.action_scan()

    @work(exclusive=True, group="line", exit_on_error=False)
    async def start(self, text: str, device: int | None) -> None:
        """Open a line; with a device, watch that drive as soon as it is known."""
        if not await self._opens(text):
            return
        if device is None:
            self.action_scan()
            return
        await self.scan([device]).wait()
        if device in self.found:
            self.open_drive(device)

    async def _opens(self, text: str) -> bool:
        """Whether the line could be opened; if not, why is shown."""
        try:
            await self.app.connect(text)
        except (LineError, DriveError) as error:
            self.fail(error)
            chosen = self.lines.chosen
            if chosen is None or self.line_of(chosen) != text:
                self.lines.offer_again(text)
            return False
        self.action_refresh_lines()
        self.show_heads()
        return True

    @work(exclusive=True, group="line", exit_on_error=False)
    async def action_disconnect(self) -> None:
        """Close the line; where that trips a running drive, only after saying so."""
        if not await self.app.may_let_go("Close the line?", yes="closes it", no="keeps it"):
            return
        self.forget_drives()
        await self.app.disconnect()
        self.say("The line is closed.", "Choose a line and press Enter.")
        self.show_heads()
        self.lines.focus()
