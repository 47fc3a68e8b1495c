"""Frames: the last bytes on the line, as they went out and came in."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult

from tui.bus.api import Frame
from tui.session.console import DriveConsole
from tui.widgets.drawing import rule, short
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, PLAIN
from tui.wire.frames import hex_text

from ..base import PanelScreen
from ..keys.table import FRAMES, bindings

FEWEST = 12
"""Columns of bytes that are shown, however long the note on the frame is."""


class FramesScreen(PanelScreen):
    """The frame log of the line; the newest at the bottom."""

    CSS_PATH = "frames.tcss"
    BINDINGS: ClassVar = bindings(FRAMES)
    TITLE = "Frames"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self._line = console.session.line
        self._held: tuple[Frame, ...] | None = None

    def body(self) -> ComposeResult:
        """One list and the keys."""
        yield Lines(id="frames")

    def draw(self, width: int) -> None:
        """Show the newest frames that fit."""
        super().draw(width)
        frames = self._held if self._held is not None else tuple(self._line.trace)
        room = max(1, self.size.height - 2)
        title = "Frames on the line" + (" (held)" if self._held is not None else "")
        lines = [rule(title, width, f"{len(frames)} kept")]
        now = self.app.clock.monotonic()
        lines += [frame_line(frame, now, width) for frame in frames[-room:]]
        self.put("frames", lines)

    def action_hold(self) -> None:
        """Hold the list still, or let it run."""
        self._held = tuple(self._line.trace) if self._held is None else None
        self.look()


def frame_line(frame: Frame, now: float, width: int) -> Text:
    """One frame: how long ago, direction, as many bytes as fit, and what was said of it."""
    text = Text(no_wrap=True)
    text.append(f" {now - frame.time:7.2f} s ago  ", FAINT)
    text.append(f"{frame.direction:<4}", FAINT)
    note = f"  {frame.note}" if frame.note else ""
    room = max(FEWEST, width - text.cell_len - len(note))
    text.append(short(hex_text(frame.data), room), PLAIN)
    text.append(note, ALARM)
    return text
