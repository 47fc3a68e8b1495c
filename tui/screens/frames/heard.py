"""Listening: traffic of a line on which nothing is sent, as frames and summed up."""

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
"""Rows of one sentence at most."""
OF_A_DRIVE, HANGING = 3, 5
"""Columns before a sentence about a drive, and before the rest of it."""
WARNINGS = ("NOT POLLED", "TWO ANSWERS", "A SECOND MASTER", "no answer", "damaged", "Broken")
"""Words of a sentence to be emphasized."""


def heard_lines(
    summary: ListeningSummary, width: int, height: int, top: int
) -> tuple[list[Text], int]:
    """A heading and as many lines as there is room for, from `top` on; and the `top` that fits."""
    lines = [line for text in summary_lines(summary) for line in _sentence(_here(text), width)]
    room = max(1, height - 1)
    top = max(0, min(top, len(lines) - room))
    shown = lines[top : top + room]
    drives = sum(bool(drive.tally.device) for drive in summary.drives)
    more = "" if len(lines) <= room else f"{top + 1} to {top + len(shown)} of {len(lines)}"
    heading = counted(drives, "Traffic of 1 drive", "Traffic of {count} drives")
    return [rule(heading, width, more), *shown], top


def _here(text: str) -> str:
    """In the words of the panel, which has a field instead of an option."""
    text = text.replace("name it with -p", "enter it as Profile on Line")
    return text.replace("set by -p", "entered on Line")


def _sentence(text: str, width: int) -> list[Text]:
    """A sentence on as many rows as it takes; those about a drive follow its name."""
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
    """The frames of other masters and their drives; then who commands which, and how well."""

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
        """Each drive: who commands it, how often it is asked, whether its timeout is fed."""
        lines, self._top = heard_lines(self._heard.summary(), width, height, self._top)
        return lines

    def _scroll_sum(self, lines: int) -> None:
        """More drives than the screen has room for."""
        self._top = max(0, self._top + lines)
        self.look()

    def draw(self, width: int) -> None:
        """Say once that the line is gone."""
        if self._heard.trouble and not self._trouble_shown:
            self._trouble_shown, self._heading = True, "Listening has ended"
            self.app.notify(f"{self._heard.trouble} Press Esc to leave.", severity="error")
        super().draw(width)

    def _go_out(self) -> None:
        """End listening; the port is given back before Line is there again."""
        self.run_worker(self._end(), exclusive=True, group="end")

    async def _end(self) -> None:
        await asyncio.to_thread(self._heard.close)
        self.app.say_first(
            "Listening has ended.", "Press Enter to open the line, H to listen again."
        )
        super()._go_out()

    async def on_unmount(self) -> None:
        """However one has left: nobody listens any more."""
        self.app.hearing = ""
        await asyncio.to_thread(self._heard.close)
