"""Keys that work on every screen: they go from screen to screen, or open what a screen needs."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from .app_port import Panel
from .keys.action import CONNECTION, MESSAGES, MONITOR, PARAMETERS, WIRING
from .keys.table import SCREENS

if TYPE_CHECKING:
    from textual.widget import AwaitMount

    from tui.session.console import DriveConsole
    from tui.session.fleet import FoundDrive

log = logging.getLogger(__name__)

OPEN_NOW = "Drive {drive} is open: Space stops it."
SHOWN_NOW = "Drive {drive} of the replay is shown."


def _named(drive: FoundDrive) -> str:
    """Return the address of a drive with its name, or with its model."""
    identity, session = drive.identity, drive.session
    name = identity.name or identity.reference or (session.profile.name if session else "")
    return f"{identity.device} {name}".rstrip()


class Places(Panel):
    """Keys of the screens, and those that open the drive or the screen they need."""

    chosen: DriveConsole | None = None

    @property
    def place(self) -> str:
        """The name of the screen below any dialog."""
        for screen in reversed(self.screen_stack):
            if not screen.is_modal and screen.TITLE:
                return str(screen.TITLE).lower()
        return CONNECTION

    def show_monitor(self, console: DriveConsole) -> None:
        """Show Monitor on a drive, instead of everything above Line."""
        from .monitor.screen import MonitorScreen

        log.info("watching device %s, %s", console.device, console.session.profile.id)
        self._choose(console)
        while len(self.screen_stack) > 2:
            self.pop_screen()
        if len(self.screen_stack) == 2:  # no picture of Line in between
            self.switch_screen(MonitorScreen(console))
        else:
            self.push_screen(MonitorScreen(console))

    def _choose(self, console: DriveConsole) -> None:
        """Make a drive the open one; the cursor of Line goes to it, too."""
        self.chosen = console
        if (point_at := getattr(self.screen_stack[0], "point_at", None)) is not None:
            point_at(console.device)

    def _to_base(self) -> None:
        """Return to Line, and close everything above it."""
        while len(self.screen_stack) > 1:
            self.pop_screen()

    def action_goto(self, place: str) -> AwaitMount | None:
        """Show a screen on the open drive; await it, so that the screen gets the next key."""
        if place == self.place:
            return None
        if place == CONNECTION:
            self._to_base()
        elif self.chosen is None:
            self.tell("No drive is open. Select a drive on Line and press Enter.")
        else:
            return self.show_place(place, self.chosen)
        return None

    def show_place(self, place: str, console: DriveConsole) -> AwaitMount | None:
        """Show a screen of a drive, above its Monitor; await it to use the screen."""
        from .monitor.screen import MonitorScreen

        registered = next(screen for screen in SCREENS if screen.name == place)
        if why := registered.refusal(console):
            self.tell(why)
            return None
        below = self.screen_stack[1] if len(self.screen_stack) > 1 else None
        if not isinstance(below, MonitorScreen) or below.console is not console:
            self.show_monitor(console)
        while len(self.screen_stack) > 2:
            self.pop_screen()
        if not registered.screen:
            return None
        shown: AwaitMount = self.push_screen(registered.create(console))
        return shown

    def action_messages(self) -> None:
        """Show all messages."""
        from .messages.screen import MessagesScreen

        if not isinstance(self.screen, MessagesScreen):
            self.push_screen(MessagesScreen())

    def action_wiring(self) -> None:
        """Show Wiring for the drive under the cursor of Line, else for the open one."""
        if self.place == WIRING:
            return
        console = getattr(self.screen, "pointed", None) or self.chosen
        if console is None:
            self.tell("No drive is open. For any family, run: drivepanel profiles ID --wiring")
            return
        from .wiring.screen import WiringScreen

        self.push_screen(WiringScreen(console))

    def action_why(self) -> None:
        """Diagnose why the selected drive does not answer."""
        from .why import ask_why

        ask_why(self)

    def action_bundle(self) -> None:
        """Collect everything about a line in one file."""
        from .bundle import ask_bundle

        ask_bundle(self)

    async def action_hear(self) -> None:
        """Listen to a line that another master polls."""
        from .hear import LISTENS_ALREADY, NO_LINE, chosen_line, hear

        text, profile = chosen_line(self)
        if self.hearing or not text:
            self.tell(LISTENS_ALREADY if self.hearing else NO_LINE)
            return
        work = hear(self, text, profile)
        self.opening.begin(
            text, self.run_worker(work, exclusive=True, group="hear", exit_on_error=False)
        )

    def action_save_shown(self) -> None:
        """Save what the screen shows to a file."""
        self._ask_screen("action_save_file", "This screen has nothing to save.")

    def action_open_file(self) -> None:
        """Open a file on the screen that can show it."""
        self._ask_screen("action_load_file", "This screen opens no files.")

    def _ask_screen(self, action: str, otherwise: str = "") -> None:
        """Call this method of the screen on top; report `otherwise` if it has none."""
        work = getattr(self.screen, action, None)
        if work is not None:
            work()
        elif otherwise:
            self.tell(otherwise)


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


class ParameterPlaces(Places):
    """Keys that show Parameters on the open drive, and then act there."""

    async def action_find(self) -> None:
        """Go to the parameter search; what is typed next is searched for."""
        await self._ask_parameters("action_search")

    async def open_parameter(self, code: str, proposed: int | None = None) -> None:
        """Show a parameter of the open drive in the editor, under the cursor.

        With a `proposed` raw value, its dialog opens with this value, which is not staged.
        """
        from textual.widgets import Input

        from .parameters.stage_keys import StageKeys

        if shown := self.action_goto(PARAMETERS):
            await shown
        self.screen.query_one("#search", Input).value = code
        self.screen.set_focus(None)
        if proposed is not None and isinstance(self.screen, StageKeys):
            # in the new screen: the one on which Enter was pressed gets no answer once it is closed
            self.screen.call_later(self.screen.edit, code, proposed)

    async def action_eeprom(self) -> None:
        """Save the settings of the open drive to its EEPROM."""
        await self._ask_parameters("action_save_eeprom")

    async def action_back_up(self) -> None:
        """Save the settings of the open drive under a new name."""
        await self._ask_parameters("action_back_up_now")

    async def action_differ(self) -> None:
        """Compare the open drive with its newest backup."""
        await self._ask_parameters("action_compare_newest")

    async def action_report(self) -> None:
        """Write a report on the open drive to a file."""
        await self._ask_parameters("action_report")

    async def _ask_parameters(self, action: str) -> None:
        """Go to Parameters, and call this method of it."""
        if shown := self.action_goto(PARAMETERS):
            await shown
        if self.chosen is not None:
            self._ask_screen(action)
