"""Keys that work on every screen: they go from screen to screen, or open what a screen needs."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from .app_port import Panel
from .keys.action import (
    CONNECTION,
    MONITOR,
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
        if place == MONITOR or registered.create is None:
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
