"""Scan of the open line, which continues below other screens, and opening of a drive."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from textual import work
from textual.widgets import Input

from tui.bus.errors import LineError
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.session.connect.addresses import addresses_text
from tui.session.connect.line_key import is_replay, line_key
from tui.session.connect.named_lines import profile_named
from tui.session.paths import remember_addresses

from ..app_port import tell_not_stopped, tell_unreached
from .advice import ALARM_KIND
from .state import LineView

if TYPE_CHECKING:
    from tui.bus.link import Link
    from tui.session.connect.identify import DriveIdentity, ScanResult
    from tui.session.connect.search import Search
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet

NONE_AT_ADDRESS = "No drive answered at address {} (2 attempts)."
NONE_AT_ADDRESSES = "No drive answered at addresses {} (2 attempts)."
UNPROBED = (
    "NOT STOPPED: addresses {}. The scan ended before it reached them. Press s to scan, then F9."
)
UNSCANNED = (
    "NOT STOPPED: {} was not scanned, and no stop was sent there. Stop its motors at the machine,"
    " or scan it and press F9."
)
COMPARE_WITH_BACKUP = "Press Ctrl+D on this drive to compare. Nothing is written."
WATCHED_ONLY = "It is monitored with that profile and cannot be armed."
NO_SCAN_IN_REPLAY = "This is a replay: it has the drives of its record."
AFTER_NO_ANSWER = (
    "Press N to diagnose, c to change the addresses, or s to scan again. Ctrl+P lists a scan at"
    " other baud rates."
)


class Scanning(LineView):
    """Probes each address; a drive that answers gets its profile and is kept alive."""

    _led = False
    """True if this scan has moved the cursor to the drives."""
    unclear: frozenset[int] = frozenset()
    """Addresses whose last identification was damaged: no drive is known to answer there."""
    stops_before = 0
    """Stops of all before the key that led to the scan; the scan carries out later ones."""

    def action_scan(self) -> bool:
        """Scan the addresses in the form, after a key; return False if that is not possible."""
        self.stops_before = self.app.stops_of_all
        return self.scan_form()

    def scan_form(self) -> bool:
        """Scan the addresses in the form; drives already found stay.

        If no line is open or the addresses are invalid, show that and return False.
        """
        if self.app.fleet is None:
            self.say("No line is open.", "Choose one and press Enter.", ALARM_KIND)
            return False
        try:
            wanted = self.form.addresses()
        except LineError as error:
            self.say(str(error), "Press c to change the addresses, then Enter to scan.", ALARM_KIND)
            return False
        self._led = False
        self.scan(wanted, self.form.addresses_text)
        return True

    @work(exclusive=True, group="scan", exit_on_error=False)
    async def scan(self, devices: Sequence[int], typed: str = "", *, once: bool = False) -> None:
        """Probe each address; drives appear as they answer, also below another screen.

        `typed` is stored as the addresses of this line. With `once`, silent addresses are not
        retried, and the caller reports the result.
        """
        from tui.session.connect.other_masters import MasterDetector
        from tui.session.connect.search import Search

        fleet = self.app.fleet
        if fleet is None:
            return
        if self.app.replay is not None:
            if len(devices) > 1:
                self.say(NO_SCAN_IN_REPLAY, "Press Enter on a drive to see it.")
            self.look()
            self._lead_to_drives()
            return
        opened = self.app.opened
        patient = opened is not None and opened.simulation is not None
        look = MasterDetector(fleet.line).look
        now = fleet.clock.monotonic
        search = fleet.search = Search(devices, patient=patient, once=once, between=look, now=now)
        if self._is_to_stop() and not fleet.line.read_only:
            search.stops_found = True
            fleet.stop_others()
        try:
            await self._carry_out(fleet, search, typed, once=once)
        finally:
            self._report_unprobed(search)

    def _is_to_stop(self) -> bool:
        """True if a stop of all came after the key that led to this scan."""
        return self.app.stops_of_all != self.stops_before

    def report_unscanned(self, text: str) -> None:
        """Report a line that is not scanned, if a stop of all came while it was being opened."""
        if self._is_to_stop() and not is_replay(text):
            tell_not_stopped(self.app, UNSCANNED.format(text))

    def _report_unprobed(self, search: Search) -> None:
        """Report the addresses that a stop of all during an ended scan has not reached."""
        from tui.session.connect.addresses import addresses_text

        if search.stops_found and search.unprobed:
            tell_not_stopped(self.app, UNPROBED.format(addresses_text(search.unprobed)))

    async def _carry_out(self, fleet: Fleet, search: Search, typed: str, *, once: bool) -> None:
        """Carry out a scan to its end, and report its result."""
        from tui.session.connect.other_masters import OtherMaster

        devices = search.devices
        if not once:
            self.later = 0.0
            self.tell_search()
        self.look()
        if typed:
            await asyncio.to_thread(_remember, self.app.line_text, typed)
        if not once:
            strangers = len(devices) > 1 and not self.found
            await self.name_families(wanted=strangers)
            if strangers and await self._is_not_alone(search):
                return
        try:
            await search.run(fleet.line, self._take)
        except OtherMaster as error:
            self.say(
                str(error), "The scan has ended. Press H to listen, s to scan again.", ALARM_KIND
            )
            return
        except LineError as error:
            if self.app.fleet is fleet:
                self.fail(error)
            return
        if not once:
            self.sum_up(devices)
        self.look()

    async def _is_not_alone(self, search: Search) -> bool:
        """Listen before a scan for unknown drives; end the scan if another master is heard.

        Return True if the scan has ended.
        """
        if self.app.fleet is None:
            return False
        heard = True  # stays True if a key cancels listening
        try:
            heard = await self.hears_another_master(self.app.fleet.line.link)
        finally:
            search.ended = "stopped" if heard else ""
        if not heard:
            self.tell_search()
        self.look()
        return heard

    async def name_families(self, *, wanted: bool = True) -> None:
        """Show, before the first request, the families that react to lost polling.

        Shows none for known drives or for drives simulated in this process.
        """
        opened = self.app.opened
        if not wanted or opened is None or not opened.is_real:
            self.families = ""
            return
        self.families = await asyncio.to_thread(_families)
        self.look()

    async def hears_another_master(self, link: Link) -> bool:
        """Listen on a serial port before anything is sent; report another master and its requests.

        Return True if one was heard. Other links and shared lines are not monitored.
        """
        from tui.bus.link import SerialLink
        from tui.session.connect import other_masters

        opened = self.app.opened
        if opened is None or not opened.is_real or not other_masters.LISTEN:
            return False
        if not isinstance(link, SerialLink) or opened.line.facts.others:
            return False  # nothing to hear, or only other programs of Drive Panel
        self.advise("Listening for another master.", "Then the line is scanned.")
        text = (await other_masters.listen_first(opened.line, other_masters.LISTEN)).text
        if text:
            self.say(text, "Nothing was sent. Press H to listen, s to scan again.", ALARM_KIND)
        return bool(text)

    def tell_search(self) -> None:
        """Show that the scan runs; the first drive that answers replaces this text."""
        self.advise("Scanning for drives.", "They appear here. Press Esc to end the scan.")

    def sum_up(self, devices: Sequence[int]) -> None:
        """Report the result of a finished scan."""
        if not self.found and self.search is not None and self.search.answered:
            return  # `_take` has reported each answer
        if not self.found:
            text = NONE_AT_ADDRESS if len(devices) == 1 else NONE_AT_ADDRESSES
            self.say(text.format(addresses_text(devices)), AFTER_NO_ANSWER, ALARM_KIND)
            return
        there = len(self.search.answered) if self.search else len(self.found)
        self.say(f"Scan done: {there} of {len(devices)} addresses answered.", "")

    async def _take(self, result: ScanResult) -> None:
        """Add a drive that answered, with its profile; report a damaged identification."""
        fleet, search = self.app.fleet, self.search
        if result.error:
            self.unclear |= {result.device}
            text = f"{result.error} A device has this address."
            if result.identity is None and search is not None and search.is_stopping:
                text = f"{text} It was sent no stop. Stop it at the machine."
            self.say(text, "Press s to scan again.", ALARM_KIND)
        if result.identity is None:
            return
        if not result.error:
            self.unclear -= {result.device}
            await self._equip(result.identity)
        elif fleet is not None and fleet.console(result.device) is None:
            # assign no profile, not even the typed one; a known drive keeps its stop keys
            fleet.note(result.identity)
        # looked up now: F9 may have come since
        is_stopping = search is not None and search.is_stopping
        if is_stopping and fleet is not None and fleet.console(result.device) is None:
            tell_unreached(self.app, fleet.strangers)
        self.look()
        self._lead_to_drives()

    def _lead_to_drives(self) -> None:
        """Move the cursor from the lines to the drives, once per scan."""
        if not self._led and self.focused in (None, self.lines):
            self.drives.focus()
        self._led = True

    @property
    def scanning(self) -> bool:
        """True while a scan runs."""
        return self.search is not None and self.search.goes_on

    async def _equip(self, identity: DriveIdentity) -> None:
        """Add a drive with its profile: the typed one, else the identified, named or likeliest one.

        Without a profile, or if loading it fails, add only the identity.
        """
        from tui.session.drive import DriveSession

        typed = self.form.profile
        fleet = self.app.fleet
        if fleet is None:
            return
        named = None
        if not (typed or identity.profile):
            opened = self.app.opened
            named = opened.profiles.get(identity.device) if opened is not None else None
            named = named or await asyncio.to_thread(_named, self.app.line_text, identity.device)
        wanted = typed or identity.profile or named or next(iter(identity.candidates), None)
        if wanted is None:
            fleet.note(identity)
            return
        try:
            profile = await asyncio.to_thread(library.load, wanted)
            if identity.profile is not None:
                # loaded for a stop, which uses the identified profile
                await asyncio.to_thread(library.load, identity.profile)
        except DriveError as error:
            fleet.note(identity)
            self.fail(error)
            return
        session = DriveSession(fleet.line, identity.device, profile, identity, fleet.clock)
        before = fleet.console(session.device)
        guessed = not (typed or identity.profile or named)
        console = fleet.take(session, guessed=guessed)
        if console is not before and session.contradiction:
            self.app.events.add(
                ALARM_KIND, f"{session.contradiction} {WATCHED_ONLY}", session.device
            )
        if console is not before and not guessed and not session.contradiction:
            self.report_replacement(console.session)
        known = self.app.opened.known if self.app.opened else None
        if known is not None:
            reported = (identity, identity.device, "" if guessed else console.session.profile.id)
            # note() reads files, and no caller needs its result
            threading.Thread(
                target=known.note, args=reported, name="known line", daemon=True
            ).start()

    @work(group="replacement", exit_on_error=False)
    async def report_replacement(self, session: DriveSession) -> None:
        """Report a drive with factory settings if its newest backup has others; write nothing."""
        from tui.session.settings.predecessor import predecessor_notice

        with suppress(LineError, DriveError):  # it is only an offer
            if text := await predecessor_notice(session):
                self.app.events.add("told", f"{text} {COMPARE_WITH_BACKUP}", session.device)

    @work(exclusive=True, group="open", exit_on_error=False)
    async def open_drive(self, device: int) -> None:
        """Open Monitor on a drive; if it has no profile, ask for one."""
        drive = self.found.get(device)
        if drive is None:
            return
        if drive.console is None:
            await self._equip(drive.identity)
            drive = self.found.get(device)
        if drive is None or drive.console is None:
            known = ", ".join(listing.id for listing in library.listings())
            self.say(
                f"Device {device} does not identify itself.",
                f"Enter its profile as Profile: {known}.",
                ALARM_KIND,
            )
            self.form.ask_for_profile()
            return
        self.app.show_monitor(drive.console)

    def action_stop_scan(self) -> None:
        """Leave a field and keep its text; then end the scan, or return to the drives."""
        if isinstance(self.focused, Input):
            self.lines.focus()
            return
        if self.found and not self.scanning and self.focused is self.lines:
            self.drives.focus()
            return
        stopped = self.scanning
        self.end_search()
        if stopped:
            self.say("The scan has ended.", "Press s to scan again.")
            self.look()

    def end_search(self) -> None:
        """Cancel the scan; no further address is probed."""
        self.workers.cancel_group(self, "scan")

    def action_addresses(self) -> None:
        """Focus the addresses field."""
        self.form.ask_for_addresses()

    def forget_drives(self) -> None:
        """End the scan and remove all drives of the shown line, which ends their polling."""
        self.end_search()
        self.workers.cancel_group(self, "open")
        if self.app.fleet is not None:
            self.app.fleet.forget()
        self.warned.clear()
        self.look()


def _families() -> str:
    """Return a sentence on the families whose timeout starts at the first request; reads files."""
    from tui.drive.finding import watching_families, watching_text
    from tui.session.connect.address_prober import known_profiles

    text = watching_text(watching_families(known_profiles()))
    return f"{text} Drives found are polled while the line is open." if text else ""


def _named(line: str, device: int) -> str | None:
    """Return the profile that the settings file names for a drive, if any; reads files."""
    return profile_named(line_key(line), device)


def _remember(line: str, addresses: str) -> None:
    """Store the addresses of a line for the next time it is opened; writes a file."""
    remember_addresses(line_key(line), addresses)
