"""The panel: its screens, its global keys, its theme; wiring only."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, ClassVar

from textual.driver import Driver
from textual.events import Event, Key, Paste

from tui.bus.errors import LineClosed
from tui.drive.plain import plain
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.keys.table import bindings
from tui.session.clock import Clock
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.events import EventLog
from tui.session.paths import remember_line, state_folder
from tui.terminal.admission import Admission
from tui.terminal.driver import with_own_keys
from tui.terminal.fields import takes_space
from tui.terminal.last_words import LastWords
from tui.terminal.lean import LeanApp
from tui.terminal.loop import soon_in_loop
from tui.terminal.names import STOP_KEYS
from tui.terminal.stroke import stroke_of
from tui.terminal.type_ahead import TypeAhead
from tui.widgets.palette import THEME

from .screens.frame import Framed
from .screens.frame_source import FrameSource
from .screens.leaving import Leaving
from .screens.places import Places

if TYPE_CHECKING:
    from tui.drive.profile.schema import OrderId
    from tui.session.command.stop_report import StopReport
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.journal import Journal
    from tui.terminal.stroke import Stroke

log = logging.getLogger(__name__)

CHOSEN_CONNECTS_WITHIN = 4.0
"""Seconds in which a line chosen by a person must connect."""

FRAME_LOOK = 0.25
"""Seconds between two looks at what stands around every screen."""

STOP, STOP_ALL, STOP_OUTSIDE_TEXT = "f12", "f9", "space"

Opener = Callable[..., OpenLine]


class DrivePanelApp(LeanApp, LastWords, Places, Leaving):
    """The panel on one line at a time.

    `start` is a LINE to open at once, `device` a drive on it to watch at once. With
    `leave_running` motors are not stopped when the panel ends without being asked. With `mouse` the
    terminal reports its mouse. `on_shown` is called after the first picture.
    """

    TITLE = "Drive Panel"
    BINDINGS: ClassVar = bindings(None)
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
        on_shown: Callable[[], None] | None = None,
    ) -> None:
        super().__init__()
        self.register_theme(THEME)
        self.theme = THEME.name
        self.clock = clock or Clock()
        self.read_only = read_only
        self.low_bandwidth = low_bandwidth
        self.mouse = mouse
        self.bell_rings = bell
        """Whether a new fault rings."""
        self.period = 0.5
        self.opened: OpenLine | None = None
        self.fleet: Fleet | None = None
        self.events = EventLog()
        self.connection = ConnectionScreen()
        self._open = open_line
        self._start = start
        self._device = device
        self._on_shown = on_shown
        self._gone = False
        self.settled = leave_running
        """Whether it was decided what becomes of motors that run by an order from here."""
        self._stops = 0
        self._trying_f12 = False
        self._typed = TypeAhead(self, Admission(self, self).admits)
        self._cried: list[StopReport] = []
        """Stops that failed, and of which that was said."""
        self._frame = FrameSource(self)
        self._journal: Journal | None = None
        self._journal_trouble = ""

    @property
    def journal(self) -> Journal:
        """The record of what is written to drives."""
        if self._journal is None:
            from tui.session.journal import Journal

            self._journal = Journal()
        return self._journal

    def get_driver_class(self) -> type[Driver]:
        """The driver of this platform, with the stop keys before everything else."""
        return with_own_keys(super().get_driver_class())

    def take_stop_key(self, key: str, left_at: float | None = None) -> bool:
        """Stop, if the key means that now; may be called in any thread.

        `left_at` is when a key was read that may leave a text, like Escape: a Space behind it is no
        text, though that key may not have had its effect yet.
        """
        left = left_at is not None and left_at > self._typed.done_to
        if key not in STOP_KEYS:
            return False
        if key == STOP_OUTSIDE_TEXT and takes_space(self.focused) and not left:
            return False
        self._stop(everything=key == STOP_ALL)
        if key == STOP and self._trying_f12:
            self._f12_arrived()
        return True

    def sequence_swallowed(self, data: bytes) -> None:
        """A key came that no known terminal sends; in the thread that reads the keys."""
        if self._trying_f12:
            from tui.screens.keys.first_keys import unknown_text

            self._from_keys(self.connection.say, unknown_text(data), "", "alarm")

    def _try_f12(self) -> None:
        """On the first start on a terminal, while no line is open: does F12 arrive?"""
        from tui.screens.keys.first_keys import OFFER, was_tried

        self._trying_f12 = not self.is_headless and self._start is None and not was_tried()
        if self._trying_f12:
            self.connection.say(OFFER, "Or choose a line and press Enter, or n to type one.")

    def _f12_arrived(self) -> None:
        """F12 came while it was tried; in the thread that reads the keys."""
        from tui.screens.keys.first_keys import ARRIVED, remember

        self._trying_f12 = False
        remember()
        self._from_keys(self.connection.say, ARRIVED, "Choose a line and press Enter.")

    def _from_keys(self, tell: Callable[..., None], *words: str) -> None:
        """Do something in the screen's loop, from the thread that reads the keys."""
        soon_in_loop(self, tell, *words)

    def stop_stamp(self) -> object:
        """Another object after every stop; may be called in any thread."""
        return self._stops

    @property
    def stroke(self) -> Stroke | None:
        """What is known of the key that has its effect now; None while there is none."""
        return self._typed.stroke

    def keys_not_taken(self, count: int, *, late: bool = False) -> None:
        """Tell that keys came at once, or too late, and did nothing."""
        came = "came too late" if late else "came at once" if count > 1 else "did not come alone"
        keys = f"{count} keys {came} and were" if count > 1 else f"1 key {came} and was"
        self.notify(f"{keys} not taken.", severity="warning")

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """A space belongs to the text that is being typed."""
        if action == "stop_by_space":
            return not takes_space(self.focused)
        return super().check_action(action, parameters)

    def action_stop_by_space(self) -> None:
        """Stop the drive that is shown, while no text is being typed."""
        self._stop(everything=False)

    def action_stop(self) -> None:
        """Stop the drive that is shown."""
        self._stop(everything=False)

    def action_stop_all(self) -> None:
        """Stop every drive of the line."""
        self._stop(everything=True)

    def _stop(self, *, everything: bool) -> None:
        self._stops += 1
        fleet = self.fleet
        if fleet is None:
            return
        self._stop_sessions(fleet, fleet.sessions if everything else self._meant(fleet))

    def _stop_sessions(
        self, fleet: Fleet, sessions: list[DriveSession], order: OrderId = "stop"
    ) -> None:
        """Stop drives, and end the questions about them; may be called in any thread."""
        if not sessions:
            return
        with suppress(LineClosed):
            fleet.stop(sessions, order)
        devices = [session.device for session in sessions]
        soon_in_loop(self, self._void_questions, devices)

    def _void_questions(self, devices: list[int]) -> None:
        from .screens.dialogs.question import void_questions

        for device in devices:
            void_questions(self, device)

    def follow(self, line: str, device: int) -> None:
        """Open the line anew as a drive now wants it, and watch that drive."""
        while self.screen is not self.connection:
            self.pop_screen()
        self.connection.start(line, device)

    def stop_drive(self, console: DriveConsole, order: OrderId) -> None:
        """Stop one drive, in its own way."""
        self._stops += 1
        if self.fleet is not None:
            self._stop_sessions(self.fleet, [console.session], order)

    async def on_event(self, event: Event) -> None:
        """A key keeps an armed drive armed; the next one waits for it."""
        if isinstance(event, Key | Paste) and not event.is_forwarded:
            if not self._typed.admit(event):
                return
            if isinstance(event, Key):
                for session in self.fleet.sessions if self.fleet else ():
                    session.arming.touch()
        elif isinstance(event, Key) and self._is_void(event):
            return
        await super().on_event(event)

    def _is_void(self, key: Key) -> bool:
        """Whether a stop came while a key went through the screen, before it has its effect."""
        stroke = stroke_of(key)
        return stroke is not None and stroke.stamp != self.stop_stamp()

    def _meant(self, fleet: Fleet) -> list[DriveSession]:
        """Whom the stop key stops: the drive that was opened, else every drive of the line."""
        chosen = self.chosen
        if chosen is not None and chosen in fleet.consoles:
            return [chosen.session]
        return fleet.sessions

    @property
    def stops_whom(self) -> str:
        """The words of the stop key in the line of keys."""
        fleet, chosen = self.fleet, self.chosen
        if fleet is not None and chosen is not None and chosen in fleet.consoles:
            return f"STOP {chosen.device}"
        return "STOP ALL"

    def on_mount(self) -> None:
        """Show Connection, and open the line that was named."""
        self.push_screen(self.connection)
        self.set_interval(FRAME_LOOK, self._look_around)
        if self._on_shown is not None:
            self.connection.call_after_refresh(self._on_shown)
        self.call_after_refresh(self._try_f12)
        if self._start is not None:
            self.call_after_refresh(self.connection.start, self._start, self._device)

    def _look_around(self) -> None:
        """What must be seen on every screen: the frame, a new fault, a stop that failed."""
        if self.fleet is not None:
            if self.fleet.alarms.take(self.fleet.line_watch.states) and self.bell_rings:
                self.bell()
            self._cry_for_stops(self.fleet)
        trouble = self._journal.trouble if self._journal is not None else ""
        if trouble and trouble != self._journal_trouble:
            self.notify(trouble, severity="error")
        self._journal_trouble = trouble
        self.draw_frame()

    def draw_frame(self) -> None:
        """Put the frame of the screen on top as it is now."""
        if isinstance(self.screen, Framed):
            self.screen.draw_frame(self._frame.view())

    def _cry_for_stops(self, fleet: Fleet) -> None:
        """Say over everything, once, that a motor does not stop."""
        for report in fleet.stopper.reports.values():
            if report.phase.value == "failed" and report not in self._cried:
                self.cry(f"Device {report.device}: {report.text}")
        self._cried = [r for r in fleet.stopper.reports.values() if r.phase.value == "failed"]

    async def on_unmount(self) -> None:
        """Leave no line open."""
        self._gone = True
        if not self.settled:
            # the panel ends without having been asked: an error of its own, or a signal
            await asyncio.to_thread(self.stop_motors)
        await self.disconnect()
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

    async def connect(self, text: str) -> None:
        """Open a line in place of the one that is open; raises the line's errors."""
        await self.disconnect()
        opening = asyncio.ensure_future(asyncio.to_thread(self._open_here, text))
        try:
            self.opened = await asyncio.shield(opening)
        except asyncio.CancelledError:
            opening.add_done_callback(_close_unwanted)
            raise
        from tui.session.fleet import Fleet
        from tui.session.starts.keeper import StartKeeper

        # the motors of a simulated line end with it
        starts = StartKeeper("panel", clock=self.clock) if self.opened.simulation is None else None
        self.fleet = Fleet(self.opened.line, self.journal, starts, self.events, self.clock)
        log.info("opened %s", self.opened.label)
        await asyncio.to_thread(remember_line, self.opened.text)

    def _open_here(self, text: str) -> OpenLine:
        """Open a line in a thread; closed again where the panel was left meanwhile."""
        opened = self._open(text, read_only=self.read_only, wait=CHOSEN_CONNECTS_WITHIN)
        # here, where nobody waits for a key: what the loop asks for next
        import tui.screens.monitor.screen
        import tui.session.fleet  # noqa: F401

        if self._gone:
            opened.close()
            raise LineClosed
        return opened

    async def disconnect(self) -> None:
        """Close the open line, if there is one."""
        opened, self.opened = self.opened, None
        fleet, self.fleet, self.chosen = self.fleet, None, None
        if opened is not None:
            await asyncio.to_thread(opened.close)
            if fleet is not None and fleet.starts is not None:
                await asyncio.to_thread(fleet.starts.close)
            log.info("closed %s", opened.label)

    def action_help(self) -> None:
        """Every key of the screen on top."""
        from tui.screens.keys.help import HelpScreen

        if not isinstance(self.screen, HelpScreen):
            self.push_screen(HelpScreen(self.place))

    def action_command_palette(self) -> None:
        """Find an action of any screen by its words."""
        from .screens.choosing import open_palette

        open_palette(self)


def _close_unwanted(opening: asyncio.Future[OpenLine]) -> None:
    """Close a line that was opened after another one had been chosen."""
    if not opening.cancelled() and opening.exception() is None:
        threading.Thread(target=opening.result().close, name="close line", daemon=True).start()
