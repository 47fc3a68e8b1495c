"""The panel: its screens, its global keys, its theme; wiring only."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from textual.driver import Driver
from textual.reactive import Reactive
from textual.screen import Screen
from textual.theme import Theme

from tui.screens.connection.screen import ConnectionScreen
from tui.screens.keys.table import bindings
from tui.screens.opening import OpeningScreen
from tui.screens.places import DriveKeys, ParameterPlaces
from tui.session.clock import Clock
from tui.session.connect.open_line import open_line
from tui.session.events import EventLog
from tui.session.paths import state_folder
from tui.terminal.abilities import EVERYTHING, Abilities
from tui.terminal.driver import with_own_keys
from tui.terminal.last_words import LastWords
from tui.widgets.drawing import short
from tui.widgets.palette import THEME

from .screens.frame import FRAME_LOOK
from .screens.key_dispatcher import KeyDispatcher
from .screens.last_stops import LastStops
from .screens.leaving import Leaving
from .screens.line_check import LineCheck
from .screens.line_owner import LineOwner, Opener
from .screens.open_lines import LineOpening
from .screens.replay_keys import ReplayKeys
from .screens.status_refresher import StatusRefresher

if TYPE_CHECKING:
    from tui.session.bundle.subject import DriveDocuments

LONGEST_CAUSE = 120
"""Characters that an error takes on the terminal; the log has all of it."""


class DrivePanelApp(
    LastWords,
    KeyDispatcher,
    ReplayKeys,
    StatusRefresher,
    LineOwner,
    LineCheck,
    ParameterPlaces,
    DriveKeys,
    Leaving,
):
    """The panel on one line at a time.

    `start` is a LINE to open at once, `device` a drive on it to watch at once. With
    `leave_running` motors are not stopped when the panel ends without being asked. With `mouse` the
    terminal reports its mouse. `abilities` is what the terminal can show. `on_shown` is
    called after the first picture. `drive_documents` gives the JSON of commands for a bundle.
    """

    TITLE = "Drive Panel"
    BINDINGS: ClassVar = bindings(None)
    theme: Reactive[str] = Reactive(THEME.name)  # from the start: another one styles all anew
    ENABLE_COMMAND_PALETTE = False  # Textual's own: its key stands in the table of actions

    def __init__(
        self,
        *,
        open_line: Opener = open_line,
        start: str | None = None,
        device: int | None = None,
        clock: Clock | None = None,
        read_only: bool = False,
        low_bandwidth: bool = False,
        leave_running: bool = False,
        mouse: bool = False,
        bell: bool = True,
        abilities: Abilities = EVERYTHING,
        on_shown: Callable[[], None] | None = None,
        drive_documents: Callable[[], DriveDocuments] | None = None,
    ) -> None:
        super().__init__()
        self.fit_terminal(abilities, slow=low_bandwidth)
        self.panel_clock = clock or Clock()
        self.read_only = read_only
        self.low_bandwidth = low_bandwidth
        self.mouse = mouse
        self.bell_rings = bell
        """True if a new fault rings."""
        self.period = 0.5
        self.events = EventLog()
        self.opening = LineOpening(start or "")
        self.connection = ConnectionScreen()
        self._open = open_line
        self._start = start
        self._device = device
        self._on_shown = on_shown
        if drive_documents is not None:
            self.drive_documents = drive_documents
        self.leave_running = self.settled = leave_running
        """True if it was decided what happens to motors that run by a command of this panel."""

    def get_theme(self, theme_name: str) -> Theme | None:
        """The panel's theme, or one of Textual's own."""
        return THEME if theme_name == THEME.name else super().get_theme(theme_name)

    def get_driver_class(self) -> type[Driver]:
        """The driver of this platform, with the stop keys before everything else."""
        return with_own_keys(super().get_driver_class())

    def look_around(self) -> None:
        """Check what every screen shows, and that the line is unchanged."""
        super().look_around()
        if self.is_running:
            self.check_line()

    def say_first(self, happened: str, next_step: str, kind: str = "") -> None:
        """Say something on Line, where a person begins."""
        self.connection.say(happened, next_step, kind)

    def follow(self, line: str, device: int) -> None:
        """Open the line again as a drive now wants it, and watch that drive."""
        while self.screen is not self.connection:
            self.pop_screen()
        self.connection.stops_before = self.stops_of_all
        self.connection.start(line, device)

    def get_default_screen(self) -> Screen[None]:
        """Line, at the bottom of all."""
        self.take_styles(self.connection)
        return self.connection

    def on_mount(self) -> None:
        """Open the line that was named."""
        first: Screen[None] = self.connection
        if self._start is not None and self._device is not None:
            first = OpeningScreen(self._start, self._device)
            self.push_screen(first)
        self.set_interval(FRAME_LOOK, self.look_around)
        if self._on_shown is not None:
            first.call_after_refresh(self._on_shown)
        if self._start is None:
            first.call_after_refresh(self.try_f12)
        else:
            first.call_after_refresh(self.connection.start, self._start, self._device)

    async def on_unmount(self) -> None:
        """Leave no line open."""
        self._gone = True
        await asyncio.to_thread(self.follow_last_work)
        await self.disconnect_all()
        if self._journal is not None:
            await asyncio.to_thread(self._journal.close)

    def order_last_work(self) -> LastStops:
        """Stop the motors that were started here, unless they are to run on."""
        return LastStops(()) if self.settled else self.order_stops()

    def last_words(self, error: BaseException) -> str:
        """One sentence; the log has the rest."""
        text = f"{type(error).__name__}: {error}".partition("\n")[0].rstrip(": ")
        place = state_folder() / "drivepanel.log"
        return (
            f"The panel had to stop after an internal error ({short(text, LONGEST_CAUSE)});"
            f" details are in {place}."
        )

    def leave_now(self) -> None:
        """End the screen; may be called in any thread."""
        super().leave_now()
        self.release_input()

    def action_help(self) -> None:
        """Every key of the screen on top."""
        from tui.screens.keys.help import HelpScreen

        if not isinstance(self.screen, HelpScreen):
            self.push_screen(HelpScreen(self.place))

    def action_command_palette(self) -> None:
        """Find an action of any screen by its words."""
        from .screens.choosing import open_palette

        open_palette(self)
