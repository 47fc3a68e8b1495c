"""Listening: what others say on a line on which nothing is sent, as frames and summed up."""

from __future__ import annotations

import asyncio
from typing import ClassVar

from rich.text import Text

from tui.session.listening.background import HeardLine

from ..keys.action import LISTENING
from ..keys.table import bindings
from .frame_list import FrameListScreen
from .heard_view import heard_lines


class HeardScreen(FrameListScreen):
    """The frames of other masters and their drives; then who commands which, and how well."""

    CSS_PATH = "frames.tcss"
    BINDINGS: ClassVar = bindings(LISTENING)
    TITLE = "Listening"

    def __init__(self, heard: HeardLine) -> None:
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
            self.app.notify(f"{self._heard.trouble} Esc leaves.", severity="error")
        super().draw(width)

    def _go_out(self) -> None:
        """End listening; the port is given back before Line is there again."""
        self.run_worker(self._end(), exclusive=True, group="end")

    async def _end(self) -> None:
        await asyncio.to_thread(self._heard.close)
        self.app.say_first("Listening has ended.", "Enter opens the line; H listens again.")
        super()._go_out()

    async def on_unmount(self) -> None:
        """However one has left: nobody listens any more."""
        self.app.hearing = ""
        await asyncio.to_thread(self._heard.close)
