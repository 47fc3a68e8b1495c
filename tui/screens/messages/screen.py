"""Messages: all messages, newest first, with their times; and what changed since a time."""

from __future__ import annotations

import asyncio
import time
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

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

if TYPE_CHECKING:
    from tui.session.changes import ChangeList

EVENT_STYLES = {"failed": FAULT, "refused": ALARM, "error": FAULT, "stop": STRONG, "done": PLAIN}
EVENT_TIME_WIDTH = 10
MESSAGE_LINES = 6
"""Lines of one message at most."""
USUAL_SINCE = "22:00"
"""The time that is proposed: the begin of the night, as a day begins with what happened in it."""


class MessagesScreen(PanelScreen):
    """A list that scrolls; nothing here reaches a drive."""

    CSS_PATH = "messages.tcss"
    BINDINGS: ClassVar = bindings(MESSAGES)
    TITLE = "Messages"
    LOOK = 0.5

    def __init__(self) -> None:
        super().__init__()
        self._offset = 0
        self._typed = USUAL_SINCE
        self._since: datetime | None = None
        """None while the messages are shown."""
        self._changes: ChangeList | str = ""
        """Changes since then, or a text instead."""

    def body(self) -> ComposeResult:
        """Title, the messages or changes, the keys."""
        yield Lines(id="title")
        yield Lines(id="list")

    def draw(self, width: int) -> None:
        """Show the messages or changes from the scroll position on, the newest first."""
        super().draw(width)
        heading, lines = self._shown(width)
        self.put("title", [heading])
        room = max(1, self.size.height - 2)
        self._offset = max(0, min(self._offset, len(lines) - room))
        self.put("list", lines[self._offset : self._offset + room])

    def _shown(self, width: int) -> tuple[Text, list[Text]]:
        """The heading and all lines."""
        if self._since is not None:
            return self._shown_changes(self._since, width)
        events = self.app.events.events
        lines = [line for event in reversed(events) for line in event_lines(event, width)]
        if not lines:
            lines = [Text(" No messages yet.", FAINT)]
        return rule("Messages", width, f"{len(events)} messages" if events else ""), lines

    def _shown_changes(self, since: datetime, width: int) -> tuple[Text, list[Text]]:
        from .changes import change_count_text, change_list_lines

        title, found = f"Changes since {since:%a %Y-%m-%d %H:%M}", self._changes
        if isinstance(found, str):
            return rule(title, width), [Text(f" {found}", FAINT)]
        today = datetime.fromtimestamp(self.app.clock.wall()).date()
        return rule(title, width, change_count_text(found)), change_list_lines(found, width, today)

    def action_since(self) -> None:
        """Ask for a time, and show what changed since then."""
        from tui.session.changes import TIME_EXAMPLES, parse_since

        from ..dialogs.ask import Ask

        def parsed(text: str) -> datetime | None:
            now = datetime.fromtimestamp(self.app.clock.wall()).astimezone()
            return parse_since(text, now)

        def wrong(text: str) -> str:
            return "" if parsed(text) is not None else f"'{text}' is not a time."

        def typed(text: str | None) -> None:
            if text is not None and (since := parsed(text)) is not None:
                self._typed, self._since, self._offset = text, since, 0
                self._changes = "Reading the journal and the records ..."
                self.run_worker(self._read(since), exclusive=True, group="changes")
            self.look()

        about = f"A time of day is the last one. Examples: {TIME_EXAMPLES}."
        requested = Ask("Show what changed since", wrong, text=self._typed, about=about)
        self.app.push_screen(requested, typed)

    async def _read(self, since: datetime) -> None:
        """Read what changed in a thread: a full record takes seconds."""
        from tui.session.changes import read_changes
        from tui.session.record.ring import record_folder

        opened = [line.opened for line in self.app.panel_lines]
        private = {item.text: Path(item.private.name) for item in opened if item.private}
        read = partial(read_changes, record_folder(), since=since, private=private)
        try:
            found: ChangeList | str = await asyncio.to_thread(read)
        except OSError as error:
            found = f"The journal cannot be read: {error.strerror or error}."
        if self._since == since:
            self._changes = found
            self.look()

    def action_leave(self) -> None:
        """Return to the messages, or to the screen below."""
        if self._since is None:
            super().action_leave()
            return
        self._since, self._offset = None, 0
        self.look()

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
