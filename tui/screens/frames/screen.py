"""Frames: what went over the line, in codes and values, and as bytes."""

from __future__ import annotations

import time
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult

from tui.bus.api import Frame
from tui.bus.link import TcpLink, label
from tui.drive.profile.profile import Profile
from tui.session.console import DriveConsole
from tui.session.paths import state_folder
from tui.widgets.drawing import cut, cut_at_word, rule, short
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG
from tui.wire.frames import hex_text

from ..base import PanelScreen
from ..dialogs.files import fault_of_new
from ..keys.table import FRAMES, bindings
from .decoded import decoded

FEWEST = 12
"""Columns of bytes that are shown, however long the note on the frame is."""


BYTES_WIDTH = 44
"""Columns of the bytes where they stand beside the words."""
BESIDE_BYTES = 110
"""Columns from which on words and bytes stand side by side."""


FEW = 6
"""Frames that are shown on a slow link while they come."""


class FramesScreen(PanelScreen):
    """The frame log of the line in words; the newest at the bottom."""

    CSS_PATH = "frames.tcss"
    BINDINGS: ClassVar = bindings(FRAMES)
    TITLE = "Frames"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self._line = console.session.line
        self._held: tuple[Frame, ...] | None = None
        self._bytes = False

    def body(self) -> ComposeResult:
        """One list."""
        yield Lines(id="frames")

    def draw(self, width: int) -> None:
        """Show the newest frames that fit."""
        super().draw(width)
        frames = self._held if self._held is not None else tuple(self._line.trace)
        room, columns, few = max(1, self.size.height - 5), width, ""
        if self.app.low_bandwidth and self._held is None:
            # all of them anew each time is more than a slow link carries
            room, columns, few = min(room, FEW), min(width, BESIDE_BYTES - 1), "h shows all, "
        # one more than fits: a reply at the top is told by its request
        told = decoded(
            frames[-room - 1 :], self._profile, self._raws, tcp=isinstance(self._line.link, TcpLink)
        )[-room:]
        held = " (held)" if self._held is not None else ""
        lines = [rule(f"Frames on the line{held}", width, f"{few}{len(frames)} kept")]
        now = self.app.clock.monotonic()
        for frame, words in zip(frames[-room:], told, strict=True):
            if self._bytes:
                words = ""
            lines.append(frame_line(frame, now, columns, words))
        self.put("frames", lines)

    def _profile(self, device: int) -> Profile | None:
        console = self.app.fleet.console(device) if self.app.fleet else None
        return console.session.profile if console else None

    def _raws(self, device: int) -> Mapping[str, int]:
        console = self.app.fleet.console(device) if self.app.fleet else None
        return console.session.image.raws if console else {}

    def action_hold(self) -> None:
        """Hold the list still, or let it run."""
        self._held = tuple(self._line.trace) if self._held is None else None
        self.look()

    def action_save_file(self) -> None:
        """Write the frames that are kept, or held, to a file whose name the person may change."""
        from ..dialogs.ask import Ask
        from .saving import SAVED_AS

        frames = self._held if self._held is not None else tuple(self._line.trace)
        if not frames:
            self.app.tell("Nothing to save: no frame is kept yet.")
            return
        name = f"frames-{time.strftime('%Y%m%d-%H%M%S')}.pcapng"
        proposed = str(state_folder() / name)

        def told(name: str | None) -> None:
            if name:
                self._write(Path(name).expanduser(), frames)

        asked = Ask(
            "Save the frames as",
            fault_of_new,
            text=proposed,
            about=SAVED_AS,
            takes="writes the file",
        )
        self.app.push_screen(asked, told)

    def _write(self, path: Path, frames: tuple[Frame, ...]) -> None:
        from .saving import save_frames

        tcp = isinstance(self._line.link, TcpLink)
        words = decoded(frames, self._profile, self._raws, tcp=tcp)
        since_1970 = time.time() - self.app.clock.monotonic()
        try:
            count = save_frames(
                path,
                frames,
                words,
                label(self._line.link),
                tcp=tcp,
                wall_of=lambda moment: moment + since_1970,
                time_text=_time_text,
            )
        except OSError as error:
            self.app.notify(f"Not saved: {error.strerror or error}: {path}", severity="error")
        else:
            self.app.tell(f"Saved: {count} frames in {path}")

    def action_other_page(self) -> None:
        """The bytes as they are, or words."""
        self._bytes = not self._bytes
        self.look()


def _time_text(wall: float) -> str:
    """A time of the day with its date, to the millisecond."""
    moment = datetime.fromtimestamp(wall).astimezone()
    return moment.isoformat(sep=" ", timespec="milliseconds")


def frame_line(frame: Frame, now: float, width: int, words: str = "") -> Text:
    """One frame: how long ago, direction, what it says or its bytes, and what was said of it.

    Bytes that form no frame, and all where there are no `words`, are shown as they are.
    """
    text = Text(no_wrap=True)
    text.append(f" {now - frame.time:6.2f} s ", FAINT)
    text.append("→ " if frame.direction == "out" else "  ← ", STRONG)
    note = f"  {frame.note}" if frame.note else ""
    room = max(FEWEST, width - text.cell_len - len(note))
    if not words:
        text.append(short(hex_text(frame.data), room), PLAIN)
    elif width >= BESIDE_BYTES:
        left = max(FEWEST, room - BYTES_WIDTH)
        text.append(cut(words, left), PLAIN)
        text.append(f" {short(hex_text(frame.data), BYTES_WIDTH - 1)}", FAINT)
    else:
        text.append(cut_at_word(words, room), PLAIN)
    text.append(note, ALARM)
    return text
