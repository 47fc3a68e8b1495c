"""The search for drives on the open line, and the way from one of them to Monitor."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING

from textual import work

from tui.bus.errors import LineError
from tui.drive.errors import DriveError

from .state import ALARM_KIND, ConnectionView

if TYPE_CHECKING:
    from tui.session.connect.identify import DriveIdentity, ScanResult


class Scanning(ConnectionView):
    """Asks each address; a drive that answers gets its profile and is looked after."""

    _led = False
    """Whether the cursor was led to the drives of the open line."""

    def action_scan(self) -> None:
        """Look for drives at the addresses given."""
        opened = self.app.opened
        if opened is None:
            self.say("No line is open.", "Choose one and press Enter.", ALARM_KIND)
            return
        try:
            wanted = list(opened.devices) or self.form.addresses()
        except LineError as error:
            self.fail(error)
            return
        self._led = False
        self.scan(wanted)

    @work(exclusive=True, group="scan", exit_on_error=False)
    async def scan(self, devices: Sequence[int]) -> None:
        """Ask each address; drives appear as they answer."""
        from tui.session.connect.identify import scan

        opened = self.app.opened
        if opened is None:
            return
        results: list[ScanResult] = []
        for number, device in enumerate(devices, start=1):
            self.say(f"Asking address {device}, {number} of {len(devices)}", "Esc stops.")
            try:
                await scan(opened.line, [device], results.append)
            except LineError as error:
                self.fail(error)
                return
            while results:
                await self._take(results.pop())
        self._sum_up(devices)

    def _sum_up(self, devices: Sequence[int]) -> None:
        if not self.found:
            span = f"{devices[0]} to {devices[-1]}" if len(devices) > 1 else f"{devices[0]}"
            self.say(
                f"No drive answered at address {span}.",
                "Check baud, format and wiring; try other addresses (Ask), then s.",
                ALARM_KIND,
            )
            return
        self.say(
            f"{len(self.found)} of {len(devices)} addresses answered.",
            "Choose a drive and press Enter to watch it.",
        )

    async def _take(self, result: ScanResult) -> None:
        """Keep a drive that answered, with its profile and state."""
        if result.identity is None:
            self.say(result.error, "The address is taken; scan again with s.", ALARM_KIND)
            return
        await self._equip(result.identity)
        self.show_drives()
        self.show_heads()
        self._lead_to_drives()

    def _lead_to_drives(self) -> None:
        """The cursor goes from the lines to the first drive that is found on the open one, once."""
        if not self._led and self.focused in (None, self.lines):
            self.drives.focus()
        self._led = True

    @property
    def scanning(self) -> bool:
        """Whether drives are looked for now."""
        return any(w.group == "scan" and w.is_running for w in self.workers)

    async def _equip(self, identity: DriveIdentity) -> None:
        """Keep a drive that answered with its profile: the typed one, else the one that fits."""
        from tui.drive.profile import library
        from tui.session.drive import DriveSession

        typed = self.form.profile
        wanted = typed or identity.profile or next(iter(identity.candidates), None)
        fleet = self.app.fleet
        if fleet is None:
            return
        if wanted is None:
            fleet.note(identity)
            return
        try:
            profile = await asyncio.to_thread(library.load, wanted)
        except DriveError as error:
            fleet.note(identity)
            self.fail(error)
            return
        session = DriveSession(fleet.line, identity.device, profile, identity, fleet.clock)
        fleet.take(session, guessed=not typed and identity.profile is None)

    @work(exclusive=True, group="open", exit_on_error=False)
    async def open_drive(self, device: int) -> None:
        """Open Monitor on a drive."""
        drive = self.found.get(device)
        if drive is None:
            return
        if drive.console is None:
            await self._equip(drive.identity)
            drive = self.found.get(device)
        if drive is None or drive.console is None:
            from tui.drive.profile import library

            known = ", ".join(listing.id for listing in library.listings())
            self.say(
                f"Device {device} does not say which drive it is.",
                f"Type its profile beside Profile: {known}.",
                ALARM_KIND,
            )
            self.form.ask_for_profile()
            return
        self.action_stop_scan()
        self.app.show_monitor(drive.console)

    def action_stop_scan(self) -> None:
        """Stop looking for drives."""
        stopped = self.scanning
        self.workers.cancel_group(self, "scan")
        if stopped:
            self.say("Stopped looking for drives.", "s looks again.")

    def forget_drives(self) -> None:
        """Let go of what was found, and stop looking."""
        self.workers.cancel_group(self, "scan")
        self.workers.cancel_group(self, "open")
        if self.app.fleet is not None:
            self.app.fleet.forget()
        self.warned.clear()
        self.show_drives()
