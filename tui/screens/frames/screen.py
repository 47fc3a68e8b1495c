"""Frames: what went over the line, in codes and values, as bytes, and counted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from tui.bus.api import Frame, ModbusLine
from tui.bus.link import Link
from tui.drive.profile.profile import Profile
from tui.session.console import DriveConsole

from ..app_port import Panel
from ..keys.action import FRAMES
from ..keys.table import bindings
from .counter_keys import CounterKeys
from .frame_list import FrameListScreen


class OwnFrames:
    """The frames of a line of the panel, told by the drives that were found on it."""

    def __init__(self, line: ModbusLine, app: Panel) -> None:
        self._line, self._app = line, app

    @property
    def link(self) -> Link:
        """The line that they went over."""
        return self._line.link

    @property
    def frames(self) -> tuple[Frame, ...]:
        """Those that went over it last."""
        return tuple(self._line.trace)

    def profile(self, device: int) -> Profile | None:
        """That of a drive which was found."""
        console = self._console(device)
        return console.session.profile if console else None

    def raws(self, device: int) -> Mapping[str, int]:
        """Return the values read from a drive."""
        console = self._console(device)
        return console.session.image.raws if console else {}

    def _console(self, device: int) -> DriveConsole | None:
        return self._app.fleet.console(device) if self._app.fleet else None


class FramesScreen(CounterKeys, FrameListScreen):
    """The frame log of the line of a drive; then the counters of that drive."""

    CSS_PATH = "frames.tcss"
    BINDINGS: ClassVar = bindings(FRAMES)
    TITLE = "Frames"

    def on_mount(self) -> None:
        """The line is that of the drive."""
        self._source = OwnFrames(self.session.line, self.app)

    @property
    def shows_counters(self) -> bool:
        """True if the counters replace the frames."""
        return self._shows_sum
