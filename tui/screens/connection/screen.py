"""Line: choose a line, find its drives, and monitor all of them.

If no drive answers at the settings of the line, others are scanned.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from textual import work
from textual.events import DescendantFocus
from textual.widgets import Input, OptionList
from textual.worker import WorkerError, get_current_worker

from tui.bus.errors import LineError, LinkSyntaxError, PortRefused
from tui.session.connect.addresses import addresses_text
from tui.session.paths import remember_line

from ..dialogs.why_target import WhyTarget
from ..keys.action import CONNECTION
from ..keys.table import bindings
from .advice import ALARM_KIND
from .choices import same_line
from .line_keys import LineKeys

if TYPE_CHECKING:
    from tui.bus.link import SerialLink
    from tui.drive.finding import LineSetting
    from tui.session.connect.scan_estimate import ScanEstimate
    from tui.session.console import DriveConsole


DRIVES_ANSWER = "Drives answer at {setting}."
DAMAGED_ANSWERS = "A device answers at {setting}, but its identification is damaged."


class OtherSettings(LineKeys):
    """Tries one setting after another until a drive answers; the line keeps that setting."""

    _settings_tried: frozenset[LineSetting] = frozenset()
    """Settings already tried; the next scan skips them until none is left."""

    @work(exclusive=True, group="line", exit_on_error=False)
    async def action_scan_settings(self) -> None:
        """Scan at every setting that a family can have, likely ones first.

        Ends at the first setting with an answer; the next call continues with the remaining ones.
        Asks first if a device has answered, because its polling stops.
        """
        if (link := self._port()) is None:
            return
        try:
            devices = self.form.addresses()
        except LinkSyntaxError as error:
            self.say(str(error), "Press c to change the addresses.", ALARM_KIND)
            return
        self.end_search()
        always = self._what_is_here() if self.found else self._who_is_unclear()
        question = "Try other baud rates and formats?"
        if not await self.app.may_let_go(question, yes="Scan", no="Cancel", always=always):
            return
        await self.name_families()
        if not await self.hears_another_master(link):
            settings = await asyncio.to_thread(self._worth_a_try, link)
            costs = await asyncio.to_thread(self._costs, link, settings, len(devices))
            await self._try(link, devices, settings, costs)

    def _who_is_unclear(self) -> str:
        """Warn of devices that answered without a valid identification; empty if there are none."""
        answered = self.search.answered if self.search is not None else frozenset()
        if not answered:
            return ""
        who = addresses_text(sorted(answered))
        return f"A device answered at {who}. Its communication loss reaction is not known."

    def _port(self) -> SerialLink | None:
        """Return the serial port if only this panel uses it; else show why no setting is tried."""
        from tui.bus.link import SerialLink

        opened = self.app.opened
        link = opened.line.link if opened is not None else None
        if opened is None:
            self.say("No line is open.", "Choose one and press Enter.", ALARM_KIND)
        elif not isinstance(link, SerialLink) or not opened.is_real:
            self.say(
                "This line has no baud or format of its own.", "Press s to scan it.", ALARM_KIND
            )
        elif others := opened.line.facts.others:
            who = ", ".join(other.text for other in others)
            next_step = "Close that program to try other settings."
            self.say(f"{who} also uses the line.", next_step, ALARM_KIND)
        else:
            return link
        return None

    def _worth_a_try(self, link: SerialLink) -> list[LineSetting]:
        """Return the untried settings, likely ones first; reads files.

        If none is left, start over with all but the current one.
        """
        from tui.bus.transport.ports import is_pseudo_terminal
        from tui.drive.finding import LineSetting
        from tui.session.connect.address_prober import settings_worth_a_try

        here = LineSetting(link.baud, link.format)
        known = settings_worth_a_try(here, parity=not is_pseudo_terminal(link.path))
        left = [setting for setting in known[1:] if setting not in self._settings_tried]
        if not left:
            self._settings_tried = frozenset()
        self._settings_tried |= {here}
        return left or known[1:]

    def _costs(
        self, link: SerialLink, settings: Sequence[LineSetting], addresses: int
    ) -> ScanEstimate:
        """Estimate the duration of a scan at these settings; reads files."""
        from tui.session.connect.scan_estimate import scan_estimate

        opened = self.app.opened
        wait = opened.line.timing.scan_timeout if opened is not None else 0.0
        return scan_estimate(link, wait, settings, addresses)

    def _tell_slow(self, settings: Sequence[LineSetting], costs: ScanEstimate) -> None:
        """Report how long the slow settings take, and which families can have them."""
        self.app.events.add("told", costs.before_slow(settings, "Esc"))

    async def _try(
        self,
        link: SerialLink,
        devices: Sequence[int],
        settings: Sequence[LineSetting],
        costs: ScanEstimate,
    ) -> None:
        """Scan at each setting until a device answers; skip settings that the port refuses."""
        self.stops_before = self.app.stops_of_all
        self.forget_drives()
        for number, setting in enumerate(settings, start=1):
            text = f"serial:{link.path},{setting.baud},{setting.format}"
            far = f"{setting}, {number} of {len(settings)} settings"
            later = settings[number:]
            if setting.slow and not any(item.slow for item in settings[: number - 1]):
                self._tell_slow((setting, *later), costs)
            self.later = costs.seconds(item for item in later if setting.slow or not item.slow)
            self.advise(f"Scanning at {far}.", "Press Esc to end it.")
            try:
                self.app.opening.begin(text, get_current_worker())
                try:
                    await self.app.connect(text, remember=False)
                finally:
                    self.app.opening.end()
                await self.scan(devices, once=True).wait()
            except WorkerError:
                self.say(f"The scan ended at {far}.", "")
                return
            except PortRefused as error:
                self.app.events.add("told", f"{setting} was skipped: {error}")
                continue
            except LineError as error:
                self.report_unscanned(text)
                self.fail(error)
                return
            if self.search is None or self.search.ended != "done":
                return  # the scan has reported why it ended
            self._settings_tried |= {setting}
            if self.found or self.search.answered:
                self._stay_at(text, setting)
                return
        self.say(
            f"No drive answered at any of {len(settings)} settings.",
            "Check that the drives are on, and both wires. Press c to change the addresses.",
            ALARM_KIND,
        )

    def _stay_at(self, text: str, setting: LineSetting) -> None:
        """Keep the line at the setting at which a device answered, and store it as recent."""
        from tui.session.connect.known_lines import remembered_text

        self.form.show_settings(setting.baud, setting.format)
        answer = DRIVES_ANSWER if self.found.keys() - self.unclear else DAMAGED_ANSWERS
        self.say(answer.format(setting=setting), "The line keeps these settings.")
        remember_line(remembered_text(text))
        self.action_refresh_lines()
        self.look()


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
