"""Keys of Line that open and close a line."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from textual import work
from textual.worker import WorkerError, get_current_worker

from tui.bus.errors import LineError, LinkSyntaxError
from tui.drive.errors import DriveError
from tui.session.connect.addresses import addresses_text
from tui.session.connect.line_key import line_key
from tui.session.connect.named_lines import line_named
from tui.session.paths import address_text

from ..open_lines import PanelLine
from ..opening import leave_opening
from .choices import LineChoice, fault_of_line, line_forms, same_line
from .line_form import ADDRESSES
from .scanning import Scanning

OPEN_WITH_ONE = "{line} is open, with 1 drive found."
OPEN_WITH_MANY = "{line} is open, with {count} drives found."
OPEN_WITH_NONE = "{line} is open, with no drive found."
OPEN_AND_SCANNED = "{line} is open, with a scan in progress."


class LineKeys(Scanning):
    """Opens and closes lines; scans a line as soon as it is open."""

    refused: tuple[str, LineError] | None = None
    """Line that could not be opened at the last attempt, with the error; None if it opened."""

    def action_refresh_lines(self) -> None:
        """Find the serial ports and recent lines again."""
        self.lines.look_for_lines()
        self.lines.fill(self.app.line_text, self.app.open_texts, self.app.faulty_texts)

    def line_of(self, choice: LineChoice) -> str:
        """Return the LINE of a choice; a serial port gets the settings in the form."""
        if not choice.path:
            return choice.text
        return self.form.line_at(choice.path, choice.settings.timeout if choice.settings else None)

    def action_type_line(self) -> None:
        """Ask for a LINE or a name, and open it."""
        from ..dialogs.ask import Ask

        def typed(text: str | None) -> None:
            if text:
                named = line_named(text.strip())
                self.open_line(*(named.line, named.device) if named else (text, None))

        about = "\n".join(line_forms())
        dialog = Ask(
            "Line to open", fault_of_line, text=self.app.line_text, about=about, takes="Open"
        )
        self.app.push_screen(dialog, typed)

    def open_line(self, text: str, device: int | None = None) -> None:
        """Open a line and scan it; ask first if that closes an open line or ends a scan.

        With `device`, scan only that address. While another line is being opened, only report that.
        """
        opening = self.app.opening
        if opening.goes_on:  # a mouse click: keys are blocked while a line opens
            self.app.tell(f"{opening.text} is being opened. Press Esc to cancel.")
        else:
            self.stops_before = self.app.stops_of_all
            opening.begin(text, self._ask_to_open(text, device))

    @work(exclusive=True, group="ask", exit_on_error=False)
    async def _ask_to_open(self, text: str, device: int | None) -> None:
        try:
            await self._open_or_show(text, device)
        finally:
            self.app.opening.end(get_current_worker())

    async def _open_or_show(self, text: str, device: int | None) -> None:
        here = self.app.open_line_of(text)
        if here is not None and same_line(text, here.opened.text):
            self._show(here, device)
            return
        if here is not None:
            self.app.show_line(here)  # it must be closed, as its settings differ
            self.look()
        if here is None and self.found:
            self._open_next(text, device, beside=True)  # the line with drives stays open
            return
        asks = here is not None or self.scanning
        always = f"{self._what_is_here()} It is closed, and {text} is opened." if asks else ""
        question = "Close this line and open the other?"
        if await self.app.may_let_go(question, yes="Close", no="Cancel", always=always):
            # drives may have answered while the question was open
            self._open_next(text, device, beside=here is None and bool(self.found))
        else:
            self.report_unscanned(text)

    def _show(self, here: PanelLine, device: int | None) -> None:
        """Show an open line.

        If it is already shown, scan it again. Reopen it if it is lost or has no drives.
        """
        if here.opened is self.app.opened:
            if self._is_good():
                self._tell_open()
            else:
                self._open_next(here.opened.text, device, beside=False)
            return
        self.end_search()
        self.app.show_line(here)
        self.say(f"{here.opened.label} is shown.", "The other lines stay open.")
        self.lines.fill(self.app.line_text, self.app.open_texts, self.app.faulty_texts)
        self.look()

    def _open_next(self, text: str, device: int | None, *, beside: bool) -> None:
        """Open a line; without `beside`, it replaces the shown one."""
        self.app.opening.begin(text, self._open_now(text, device, beside=beside))

    @work(exclusive=True, group="line", exit_on_error=False)
    async def _open_now(self, text: str, device: int | None, *, beside: bool) -> None:
        scans = False
        try:
            if beside:
                self.end_search()
                self.warned.clear()
            else:
                self.forget_drives()
            scans = await self._opens(text) and self._search_for(device)
        finally:
            self._end_opening(text, scans=scans)

    def _end_opening(self, text: str, *, scans: bool) -> None:
        """Accept keys again; report a stop of all that no scan carries out."""
        self.app.opening.end(get_current_worker())
        if not scans:
            self.report_unscanned(text)

    def _search_for(self, device: int | None) -> bool:
        """Scan the opened line, or only one address; return False for invalid addresses."""
        if device is None:
            return self.scan_form()
        self.form.offer_addresses(str(device))
        self.scan([device])
        return True

    def tell_opening(self, text: str) -> None:
        """Show that a line is being opened, and the key that cancels this."""
        self.advise(f"Opening {text}", "Press Esc to cancel. Other keys are ignored.")
        self.draw_stop_keys()

    def _is_good(self) -> bool:
        """Return True if the line is connected, and has drives or a running scan."""
        return self._connected() and (bool(self.found) or self.scanning)

    def is_on_open_line(self) -> bool:
        """Return True if the cursor is on the shown line, with the same settings."""
        chosen, here = self.lines.chosen, self.app.line_text
        return chosen is not None and bool(here) and same_line(self.line_of(chosen), here)

    def _what_is_here(self) -> str:
        count = len(self.found)
        if count:
            text = OPEN_WITH_ONE if count == 1 else OPEN_WITH_MANY
        else:
            text = OPEN_AND_SCANNED if self.scanning else OPEN_WITH_NONE
        return text.format(line=self.app.line_label, count=count)

    def _tell_open(self) -> None:
        """Scan the shown line, or report that it is being scanned."""
        if self.scanning:
            self.app.tell("This line is open and being scanned. Press Esc to end the scan.")
        else:
            self.action_scan()

    def start(self, text: str, device: int | None) -> None:
        """Open a line; with `device`, show Monitor on that drive as soon as it answers."""
        self.app.opening.begin(text, self._start(text, device))

    @work(exclusive=True, group="line", exit_on_error=False)
    async def _start(self, text: str, device: int | None) -> None:
        scans = False
        self._point_at(text)
        try:
            if not await self._opens(text):
                return
            if device is None and self.app.replay is not None and len(self.found) == 1:
                device = next(iter(self.found))
            if device is None:
                scans = self.scan_form()
                return
            search, scans = self.scan([device]), True
            self.app.opening.end(get_current_worker())
            with suppress(WorkerError):  # ended by a key, or already reported
                await search.wait()
                if device in self.found:
                    await self.open_drive(device).wait()
        finally:
            self._end_opening(text, scans=scans)
            leave_opening(self.app)

    async def _opens(self, text: str) -> bool:
        """Open a line; if that fails, show the error and return False."""
        self.end_search()
        self.tell_opening(text)
        try:
            await self.app.connect(text)
        except LinkSyntaxError as error:
            self.lines.forget_named()  # invalid: it can never be opened
            self.fail(error)
            return False
        except (LineError, DriveError) as error:
            self.refused = (text, error) if isinstance(error, LineError) else None
            self.fail(error)
            self._point_at(text)
            return False
        self.refused = None
        self._led = False
        self.action_refresh_lines()
        chosen = self.lines.chosen
        if chosen is None or not chosen.path:  # the cursor stays on a port
            self.lines.offer(self.app.line_text)
        self.form.offer_addresses(await asyncio.to_thread(self._addresses_here))
        self.look()
        return True

    def _addresses_here(self) -> str:
        """Return the addresses of the last scan of this line; reads files.

        Without any, return the addresses of a simulated line, else the default.
        """
        opened = self.app.opened
        known = addresses_text(opened.devices) if opened else ""
        return address_text(line_key(self.app.line_text)) or known or ADDRESSES

    def _point_at(self, text: str) -> None:
        """Move the cursor to a line, unless it is already on that line in another spelling."""
        chosen = self.lines.chosen
        if chosen is None or not same_line(self.line_of(chosen), text):
            self.lines.offer(text)

    @work(exclusive=True, group="line", exit_on_error=False)
    async def action_disconnect(self) -> None:
        """Close the line; ask first if a drive reacts to lost polling."""
        if not await self.app.may_let_go("Close the line?", yes="Close", no="Cancel"):
            return
        self.forget_drives()
        await self.app.disconnect()
        others = self.app.line_label
        next_step = f"{others} is shown now." if others else "Choose a line and press Enter."
        self.say("The line is closed.", next_step)
        self.lines.fill(self.app.line_text, self.app.open_texts, self.app.faulty_texts)
        self.look()
        self.lines.focus()
