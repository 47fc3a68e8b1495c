"""Keys that open another drive on the present screen, so that the stop key stops that one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .keys.action import CONNECTION, MESSAGES, MONITOR
from .places import Places

if TYPE_CHECKING:
    from tui.session.console import DriveConsole
    from tui.session.fleet import FoundDrive

OPEN_NOW = "Drive {drive} is open: Space stops it."
SHOWN_NOW = "Drive {drive} of the replay is shown."


def _named(drive: FoundDrive) -> str:
    """Return the address of a drive with its name, or with its model."""
    identity, session = drive.identity, drive.session
    name = identity.name or identity.reference or (session.profile.name if session else "")
    return f"{identity.device} {name}".rstrip()


class DriveKeys(Places):
    """The next or previous drive of the line, or the one at a typed address."""

    def action_step_drive(self, step: int) -> None:
        """Show the same screen for the next or previous drive found on the line."""
        consoles = self.fleet.consoles if self.fleet else []
        if self.chosen not in consoles:
            self.tell("No drive is open. Select a drive on Line and press Enter.")
            return
        if len(consoles) < 2:
            self.tell("Only one drive was found on the line.")
            return
        self._show_same_place(consoles[(consoles.index(self.chosen) + step) % len(consoles)])

    def _show_same_place(self, wanted: DriveConsole) -> None:
        """Show the present screen for another drive, which the stop key now stops."""
        place = self.place
        if place == CONNECTION:
            self._choose(wanted)
            self._ask_screen("draw_stop_keys")
            return
        self.show_monitor(wanted)
        if place not in (MONITOR, MESSAGES):
            self.show_place(place, wanted)

    def action_type_address(self) -> None:
        """Ask for the address of a drive on the line, and show the same screen for it."""
        from .dialogs.address import AddressField

        fleet = self.fleet
        if fleet is None or not fleet.found:
            self.tell("No drive was found. Press s on Line to scan.")
            return
        below = self.screen

        def typed(address: int | None) -> None:
            console = None if address is None else fleet.console(address)
            # a stop, or another line, may have changed the screen in the meantime
            if console is None or self.fleet is not fleet or self.screen is not below:
                return
            self._show_same_place(console)
            text = OPEN_NOW if self.replay is None else SHOWN_NOW
            self.tell(text.format(drive=_named(fleet.found[console.device])))

        named = {
            device: None if drive.console is None else _named(drive)
            for device, drive in fleet.found.items()
        }
        self.push_screen(AddressField(named), typed)
