"""Traffic of a monitored line as frames and as a summary; nothing is sent."""

from __future__ import annotations

import asyncio
from typing import ClassVar

from rich.text import Text

from tui.drive.sentences import counted
from tui.session.listening.background import BackgroundListener
from tui.session.listening.summary import ListeningSummary, summary_lines
from tui.widgets.drawing import rule, wrapped
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG

from ..keys.action import LISTENING
from ..keys.table import bindings
from .frame_list import FrameListScreen

MOST_ROWS = 6
"""Maximum rows of one sentence."""
OF_A_DRIVE, HANGING = 3, 5
"""Indent in columns of a sentence about a drive, and of the further rows of any sentence."""
WARNINGS = (
    "NOT POLLED",
    "NO ANSWERED REQUEST",
    "TWO ANSWERS",
    "A SECOND MASTER",
    "no answer",
    "damaged",
    "Broken",
)
"""Phrases that put their sentence in the alarm color."""


def heard_lines(
    summary: ListeningSummary, width: int, height: int, top: int
) -> tuple[list[Text], int]:
    """Return the heading with the rows from `top` that fit, and `top` limited to a valid row."""
    lines = [line for text in summary_lines(summary) for line in _sentence(_here(text), width)]
    room = max(1, height - 1)
    top = max(0, min(top, len(lines) - room))
    shown = lines[top : top + room]
    drives = sum(bool(drive.tally.device) for drive in summary.drives)
    more = "" if len(lines) <= room else f"{top + 1} to {top + len(shown)} of {len(lines)}"
    heading = "Traffic"
    if drives:
        heading = counted(drives, "Traffic of 1 drive", "Traffic of {count} drives")
    return [rule(heading, width, more), *shown], top


def _here(text: str) -> str:
    """Adapt a text to the panel, which has the Profile field instead of the option -p."""
    text = text.replace("name it with -p", "enter it as Profile on Line")
    return text.replace("set by -p", "entered on Line")


def _sentence(text: str, width: int) -> list[Text]:
    """Wrap a sentence; one about a drive is indented, since it follows the drive's name."""
    about_drive = text.startswith(" ")
    first = OF_A_DRIVE if about_drive else 1
    name = not about_drive and text.startswith(("Device", "Broadcast"))
    style = STRONG if name else FAINT if about_drive else PLAIN
    if any(warning in text for warning in WARNINGS):
        style = ALARM
    rows = wrapped(text.strip(), max(10, width - HANGING), MOST_ROWS)
    return [
        Text(" " * (HANGING if number else first) + row, style) for number, row in enumerate(rows)
    ]


class ListeningScreen(FrameListScreen):
    """Frames of other masters and their drives; the last page summarizes each drive."""

    CSS_PATH = "frames.tcss"
    BINDINGS: ClassVar = bindings(LISTENING)
    TITLE = "Listening"

    def __init__(self, heard: BackgroundListener) -> None:
        super().__init__()
        self._heard = self._source = heard
        self._heading = "Listening, nothing is sent"
        self._top = 0
        self._trouble_shown = False

    def sum_lines(self, width: int, height: int) -> list[Text]:
        """Return the summary: each drive's master, poll rate, and timeout coverage."""
        lines, self._top = heard_lines(self._heard.summary(), width, height, self._top)
        return lines

    def _scroll_sum(self, lines: int) -> None:
        """Scroll the summary; `sum_lines` limits the position."""
        self._top = max(0, self._top + lines)
        self.look()

    def draw(self, width: int) -> None:
        """Report once that listening has ended with an error."""
        if self._heard.trouble and not self._trouble_shown:
            self._trouble_shown, self._heading = True, "Listening has ended"
            self.app.notify(f"{self._heard.trouble} Press Esc to leave.", severity="error")
        super().draw(width)

    def _go_out(self) -> None:
        """End listening; the port is released before Line is shown."""
        self.run_worker(self._end(), exclusive=True, group="end")

    async def _end(self) -> None:
        await asyncio.to_thread(self._heard.close)
        self.app.say_first(
            "Listening has ended.", "Press Enter to open the line, H to listen again."
        )
        super()._go_out()

    async def on_unmount(self) -> None:
        """Release the port, however the screen was closed."""
        self.app.hearing = ""
        await asyncio.to_thread(self._heard.close)
