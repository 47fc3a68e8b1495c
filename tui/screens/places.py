"""Going from screen to screen: the keys that mean the same on every one of them."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from .app_port import Panel
from .keys.action import (
    CONNECTION,
    MESSAGES,
    MONITOR,
    PARAMETERS,
    WIRING,
)
from .keys.screens import SCREENS

if TYPE_CHECKING:
    from textual.widget import AwaitMount

    from tui.session.console import DriveConsole

log = logging.getLogger(__name__)


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
        """Show Monitor on a drive, in place of whatever is above the list of lines."""
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
        """This drive is the open one; the cursor of Line is on no other when one comes back."""
        self.chosen = console
        if (point_at := getattr(self.screen_stack[0], "point_at", None)) is not None:
            point_at(console.device)

    def _to_base(self) -> None:
        """Back to the list of lines, whatever is above it."""
        while len(self.screen_stack) > 1:
            self.pop_screen()

    def action_goto(self, place: str) -> AwaitMount | None:
        """Show a screen, on the drive that is open; awaited, so that the next key is its key."""
        if place == self.place:
            return None
        if place == CONNECTION:
            self._to_base()
        elif self.chosen is None:
            self.tell("No drive is open yet: Enter on a drive of Line opens it.")
        else:
            return self.show_place(place, self.chosen)
        return None

    def show_place(self, place: str, console: DriveConsole) -> AwaitMount | None:
        """Show a screen of a drive, above its Monitor; callers that need it there await it."""
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
        if place == MONITOR or registered.create is None:
            return None
        shown: AwaitMount = self.push_screen(registered.create(console))
        return shown

    def action_step_drive(self, step: int) -> None:
        """The same screen of the next or previous drive found on the line."""
        consoles = self.fleet.consoles if self.fleet else []
        if self.chosen not in consoles:
            self.tell("No drive is open yet: Enter on a drive of Line opens it.")
            return
        if len(consoles) < 2:
            self.tell("This is the only drive found on the line.")
            return
        place = self.place
        wanted = consoles[(consoles.index(self.chosen) + step) % len(consoles)]
        if place == CONNECTION:
            self._choose(wanted)
            self._ask_screen("draw_stop_keys")
            return
        self.show_monitor(wanted)
        if place not in (MONITOR, MESSAGES):
            self.show_place(place, wanted)

    async def action_find(self) -> None:
        """Into the search for a parameter, from anywhere; what is typed next is searched for."""
        if shown := self.action_goto(PARAMETERS):
            await shown
        if self.chosen is not None:
            self._ask_screen("action_search")

    async def open_parameter(self, code: str) -> None:
        """Show a parameter of the open drive in the editor, under the cursor."""
        from textual.widgets import Input

        if shown := self.action_goto(PARAMETERS):
            await shown
        self.screen.query_one("#search", Input).value = code
        self.screen.set_focus(None)

    def action_messages(self) -> None:
        """Everything that was said."""
        from .messages.screen import MessagesScreen

        if not isinstance(self.screen, MessagesScreen):
            self.push_screen(MessagesScreen())

    def action_wiring(self) -> None:
        """The page of a family: of the drive under the cursor of Line, else of the open one."""
        if self.place == WIRING:
            return
        console = getattr(self.screen, "pointed", None) or self.chosen
        if console is None:
            self.tell(
                "No drive is here yet. Of any family:"
                " drivepanel profiles ID --wiring, outside the panel."
            )
            return
        from .wiring.screen import WiringScreen

        self.push_screen(WiringScreen(console))

    def action_why(self) -> None:
        """Why the drive that is meant does not answer."""
        from .why import ask_why

        ask_why(self)

    def action_bundle(self) -> None:
        """Collect all about a line in one file."""
        from .bundle import ask_bundle

        ask_bundle(self)

    async def action_hear(self) -> None:
        """Listen to a line on which another master asks."""
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
        self._ask_screen("action_save_file", "There is nothing to save on this screen.")

    def action_open_file(self) -> None:
        """Open a file on the screen that can show it."""
        self._ask_screen("action_load_file", "No file is opened on this screen.")

    async def action_eeprom(self) -> None:
        """Keep the settings of the open drive in its EEPROM."""
        if shown := self.action_goto(PARAMETERS):
            await shown
        if self.chosen is not None:
            self._ask_screen("action_save_eeprom")

    def _ask_screen(self, action: str, otherwise: str = "") -> None:
        """Let the screen on top do what the key means there."""
        work = getattr(self.screen, action, None)
        if work is not None:
            work()
        elif otherwise:
            self.tell(otherwise)
