"""Messages: all messages, newest first, with their times."""

from __future__ import annotations

import time
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult

from tui.session.events import Event
from tui.widgets.drawing import rule, wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, FAULT, PLAIN, STRONG

from ..base import PanelScreen
from ..frame import with_drive
from ..keys.action import MESSAGES
from ..keys.table import bindings

EVENT_STYLES = {"failed": FAULT, "refused": ALARM, "error": FAULT, "stop": STRONG, "done": PLAIN}
EVENT_TIME_WIDTH = 10
MESSAGE_LINES = 6
"""Lines of one message at most."""


class MessagesScreen(PanelScreen):
    """A list that scrolls; nothing here reaches a drive."""

    CSS_PATH = "messages.tcss"
    BINDINGS: ClassVar = bindings(MESSAGES)
    TITLE = "Messages"
    LOOK = 0.5

    def __init__(self) -> None:
        super().__init__()
        self._offset = 0

    def body(self) -> ComposeResult:
        """Title, the messages, the keys."""
        yield Lines(id="title")
        yield Lines(id="list")

    def draw(self, width: int) -> None:
        """Show the messages from the scroll position on, the newest first."""
        super().draw(width)
        events = self.app.events.events
        self.put("title", [rule("Messages", width, f"{len(events)} messages" if events else "")])
        lines = [line for event in reversed(events) for line in event_lines(event, width)]
        if not lines:
            lines = [Text(" No messages yet.", FAINT)]
        room = max(1, self.size.height - 2)
        self._offset = max(0, min(self._offset, len(lines) - room))
        self.put("list", lines[self._offset : self._offset + room])

    def action_scroll(self, lines: int) -> None:
        """Older or newer messages."""
        self._offset = max(0, self._offset + lines)
        self.look()


def event_lines(event: Event, width: int) -> list[Text]:
    """A message with its time and its drive, on at most `MESSAGE_LINES` lines."""
    style = EVENT_STYLES.get(event.kind, FAINT)
    found = []
    for number, part in enumerate(
        wrapped(with_drive(event), width - EVENT_TIME_WIDTH - 1, MESSAGE_LINES)
    ):
        at = time.strftime("%H:%M:%S", time.localtime(event.wall)) if not number else ""
        line = Text(f" {at:<{EVENT_TIME_WIDTH - 1}}", FAINT, no_wrap=True)
        line.append(part, style)
        found.append(line)
    return found
