"""The panel: its screens, its global keys, its theme; wiring only."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import ClassVar

from textual.driver import Driver
from textual.reactive import Reactive
from textual.screen import Screen
from textual.theme import Theme

from tui.drive.plain import plain
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.keys.table import bindings
from tui.session.clock import Clock
from tui.session.connect.open_line import open_line
from tui.session.events import EventLog
from tui.session.paths import state_folder
from tui.terminal.abilities import EVERYTHING, Abilities
from tui.terminal.driver import with_own_keys
from tui.terminal.last_words import LastWords
from tui.widgets.palette import THEME

from .screens.hands import Hands
from .screens.leaving import Leaving
from .screens.line_check import LineCheck
from .screens.line_owner import LineOwner, Opener
from .screens.lookout import FRAME_LOOK, Lookout
from .screens.places import Places

log = logging.getLogger(__name__)


class DrivePanelApp(LastWords, Hands, Lookout, LineOwner, LineCheck, Places, Leaving):
    """The panel on one line at a time.

    `start` is a LINE to open at once, `device` a drive on it to watch at once. With
    `leave_running` motors are not stopped when the panel ends without being asked. With `mouse` the
    terminal reports its mouse. `abilities` is what the terminal can show. `on_shown` is
    called after the first picture.
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
    ) -> None:
        super().__init__()
        self.fit_terminal(abilities, slow=low_bandwidth)
        self.clock = clock or Clock()
        self.read_only = read_only
        self.low_bandwidth = low_bandwidth
        self.mouse = mouse
        self.bell_rings = bell
        """Whether a new fault rings."""
        self.period = 0.5
        self.events = EventLog()
        self.connection = ConnectionScreen()
        self._open = open_line
        self._start = start
        self._device = device
        self._on_shown = on_shown
        self.leave_running = self.settled = leave_running
        """Whether it was decided what becomes of motors that run by an order from here."""

    def get_theme(self, theme_name: str) -> Theme | None:
        """The panel's theme, or one of Textual's own."""
        return THEME if theme_name == THEME.name else super().get_theme(theme_name)

    def get_driver_class(self) -> type[Driver]:
        """The driver of this platform, with the stop keys before everything else."""
        return with_own_keys(super().get_driver_class())

    def look_around(self) -> None:
        """What must be seen on every screen, and whether the line is still the same."""
        super().look_around()
        if self.is_running:
            self.mind_line()

    def say_first(self, happened: str, next_step: str, kind: str = "") -> None:
        """Say something on Line, where a person begins."""
        self.connection.say(happened, next_step, kind)

    def follow(self, line: str, device: int) -> None:
        """Open the line anew as a drive now wants it, and watch that drive."""
        while self.screen is not self.connection:
            self.pop_screen()
        self.connection.start(line, device)

    def get_default_screen(self) -> Screen[None]:
        """Line, at the bottom of all."""
        self.take_styles(self.connection)
        return self.connection

    def on_mount(self) -> None:
        """Open the line that was named."""
        first: Screen[None] = self.connection
        if self._start is not None and self._device is not None:
            from tui.screens.opening import OpeningScreen

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
        if not self.settled:
            # the panel ends without having been asked: an error of its own, or a signal
            await asyncio.to_thread(self.stop_motors)
        await self.disconnect_all()
        if self._journal is not None:
            await asyncio.to_thread(self._journal.close)

    def last_words(self, error: Exception) -> str:
        """An error of the panel itself: all of it to the log, one line to the person."""
        log.error("the panel had to stop", exc_info=error)
        place = state_folder() / "drivepanel.log"
        return (
            f"The panel had to stop: an error of its own ({plain(str(error), lines=True)})."
            f" More is in {place}."
        )

    def action_help(self) -> None:
        """Every key of the screen on top."""
        from tui.screens.keys.help import HelpScreen

        if not isinstance(self.screen, HelpScreen):
            self.push_screen(HelpScreen(self.place))

    def action_command_palette(self) -> None:
        """Find an action of any screen by its words."""
        from .screens.choosing import open_palette

        open_palette(self)
