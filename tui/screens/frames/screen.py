"""Frames: traffic on the line of a drive, decoded, as bytes, and as counters."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import ClassVar

from rich.text import Text

from tui.bus.api import Frame, ModbusLine
from tui.bus.errors import LineError
from tui.bus.link import Link
from tui.drive.orders import OrderRefused
from tui.drive.plain import plain
from tui.drive.profile.profile import Profile
from tui.session.console import DriveConsole
from tui.session.work import Permit, Task

from ..app_port import Panel
from ..base import PanelScreen
from ..keys.action import FRAMES
from ..keys.table import bindings
from .frame_list import FrameListScreen

COUNTERS_EVERY, COUNTERS_SELDOM = 3.0, 10.0
"""Interval in seconds for reading the drive's own counters: normally, and on a slow link."""
RESETS_NOTHING_ELSE = (
    "Function 8, sub-function 0A: the manual says that it only sets the drive's frame counters to"
    " 0. The motor continues unchanged. Other programs restart their comparison."
)


class CounterKeys(PanelScreen):
    """Contents and keys of the counters page."""

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._looking = False
        self._guessed: dict[str, frozenset[str]] = {}
        """Codes that simulated drives make by a guess, by profile."""

    def on_mount(self) -> None:
        """Read the drive's own counters periodically while they are shown."""
        every = COUNTERS_SELDOM if self.app.low_bandwidth else COUNTERS_EVERY
        self.set_interval(every, self._begin_sum)

    @property
    def shows_counters(self) -> bool:
        """True while the counters page is shown."""
        raise NotImplementedError

    def sum_lines(self, width: int, height: int) -> list[Text]:
        from .counters_view import counters_lines

        session = self.session
        who = plain(f"drive {session.device}, {session.profile.name}")
        return counters_lines(self.console.counters.now(), who, width, height)

    def _begin_sum(self) -> None:
        # one read at a time: from a silent drive, a read can take longer than the interval
        if self.shows_counters and self.is_current and not self._looking:
            self._looking = True
            self.run_worker(self._read_counters(), group="counters")

    async def _read_counters(self) -> None:
        try:
            await self.console.counters.look()
        finally:
            self._looking = False
        self.look()

    def action_reset_counters(self) -> None:
        """Restart the counts of this panel; other programs keep theirs."""
        if self._require_shown():
            self.console.counters.reset_ours()
            self.app.tell("Counts restarted. The counts since the line was opened are kept.")
            self.look()

    def action_reset_drive_counters(self) -> None:
        """Set the drive's own counters to 0. Needs arming; asks first."""
        watch, device = self.console.counters, self.session.device
        if not self._require_shown():
            return
        if not watch.can_reset_drive:
            read_only = self.session.line.read_only
            why = "the line is read-only" if read_only else "the drive has no such command"
            self.app.tell(f"The drive's own counters cannot be reset: {why}.")
            return
        if not self.session.arming.armed:
            self.app.tell("Not armed. Press a on Monitor to arm this drive.")
            return
        from ..dialogs.confirm import Confirm
        from ..dialogs.now import MotorStates

        stamp = self.session.work.stops

        def reported(sure: bool | None) -> None:
            if not sure:
                return
            try:
                self.session.work.put(Task(self._reset_drive, owner=self.console), stamp)
            except OrderRefused as refused:  # disarmed or stopped since the question
                self.app.events.add("refused", f"Counters not reset: {refused}", device)

        requested = Confirm(
            f"Reset the counters of drive {device}?",
            RESETS_NOTHING_ELSE,
            yes="Reset",
            no="Cancel",
            loses=True,
            now=MotorStates(self.app, [self.session]),
        )
        self.app.push_screen(requested, reported)

    async def _reset_drive(self, _: Permit) -> str:
        try:
            await self.console.counters.reset_drive(self.console.journal)
        except LineError as error:
            raise OrderRefused(f"Counters not reset: {error}") from error
        return "The drive's counters were reset."

    def _require_shown(self) -> bool:
        if not self.shows_counters:
            self.app.tell("Press Tab to show the counters first.")
        return self.shows_counters


class OwnFrames:
    """Frames of an open line, decoded with the profiles of the drives found on it."""

    def __init__(self, line: ModbusLine, app: Panel) -> None:
        self._line, self._app = line, app

    @property
    def link(self) -> Link:
        return self._line.link

    @property
    def frames(self) -> tuple[Frame, ...]:
        return tuple(self._line.trace)

    def profile(self, device: int) -> Profile | None:
        """Return the profile of a found drive; None for other addresses."""
        console = self._console(device)
        return console.session.profile if console else None

    def raws(self, device: int) -> Mapping[str, int]:
        """Return the raw values read from a found drive by code; empty for other addresses."""
        console = self._console(device)
        return console.session.image.raws if console else {}

    def _console(self, device: int) -> DriveConsole | None:
        return self._app.fleet.console(device) if self._app.fleet else None


class FramesScreen(CounterKeys, FrameListScreen):
    """Frames on the line of a drive; the last page has the counters of that drive."""

    CSS_PATH = "frames.tcss"
    BINDINGS: ClassVar = bindings(FRAMES)
    TITLE = "Frames"

    def on_mount(self) -> None:
        """Use the line of the drive as the source of frames."""
        self._source = OwnFrames(self.session.line, self.app)

    def _guesses(self, device: int) -> Collection[str]:
        opened, profile = self.app.opened, self._source.profile(device)
        if opened is None or opened.simulation is None or profile is None:
            return ()
        if profile.id not in self._guessed:
            from tui.simulator.about import guessed_codes

            self._guessed[profile.id] = guessed_codes(profile)
        return self._guessed[profile.id]

    @property
    def shows_counters(self) -> bool:
        return self._shows_sum
