"""Common parts of the screens: regular refresh, lines in their places, the key bar."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.events import Key, Resize
from textual.widget import Widget
from textual.widgets import Input

from tui.terminal.fields import takes_space, takes_text
from tui.widgets.drawing import key_line
from tui.widgets.lines import Lines

from .frame import FRAME_LOOK, Framed
from .keys.table import elsewhere, keys_line, opening_line, typing_line


class PanelScreen(Framed):
    """A screen made of lines within the frame; the last line is the key bar.

    Textual calls the `on_...` methods of a class and then those of its bases.
    """

    DEFAULT_CSS = """
    PanelScreen { layout: vertical; overflow: hidden; }
    PanelScreen { background: $background; color: $foreground; }
    PanelScreen #frame-room { height: 2; }
    PanelScreen #keys { dock: bottom; height: 1; margin-top: 1; background: $surface; }
    """
    LOOK: ClassVar[float | None] = None
    """Seconds between two refreshes; None if the screen refreshes at its own times."""
    _looked_at = -math.inf

    def compose(self) -> ComposeResult:
        """The frame, the body of the screen, and the key bar."""
        yield from self.framed()
        yield Lines(id="frame-room")  # room for status bar and tabs
        yield from self.body()
        yield Lines(id="keys", fit=self.keys_now)

    def body(self) -> Iterable[Widget]:
        """Compose the part between the tabs and the message."""
        raise NotImplementedError

    def look_in_time(self) -> None:
        """Refresh if it is due; on a low-bandwidth link the refresh of the frame does it."""
        if self.LOOK is None or self.app.low_bandwidth:
            return
        now = self.app.panel_clock.monotonic()
        if now > self._looked_at + self.LOOK - FRAME_LOOK / 2:
            self._looked_at = now
            self.look()

    def on_resize(self, event: Resize) -> None:
        """Refresh for the new size."""
        self.call_after_refresh(self.look)

    def put(self, place: str, lines: Sequence[Text]) -> None:
        """Show lines in the place with that id; a line that is too long ends with an ellipsis."""
        found = self.query_one(f"#{place}", Lines)
        found.show([_fitted(line, found.size.width) for line in lines])

    def put_all(self, place: str, lines: Sequence[Text]) -> None:
        """The same, and give the place as many rows as there are lines."""
        found = self.query_one(f"#{place}", Lines)
        if found.size.height != len(lines):
            found.styles.height = len(lines)
        self.put(place, lines)

    def look(self) -> None:
        """Show the present contents; unchanged lines are not drawn."""
        # when the panel ends, a screen's parts are removed one by one while timers still run
        if self.is_current and self.app.is_running and not self.is_too_small:
            self.draw(self.size.width)

    def draw(self, width: int) -> None:
        """Put every line, here the key bar; called while the screen is on top and large enough."""
        self.put("keys", self.keys_now(width))

    def draw_stop_keys(self) -> None:
        """Update the stop keys, and so the whole key bar."""
        for found in self.query("#keys").results(Lines):  # none during composition or removal
            width = found.size.width
            if width and self.is_current and not self.is_too_small:
                found.show([_fitted(line, width) for line in self.keys_now(width)])

    def keys_now(self, width: int) -> list[Text]:
        """The key bar of the screen, of a text field, or during the opening of a line."""
        target, field = self.app.stop_target_text, self.focused
        if self.app.opening.goes_on:
            keys = opening_line(width, target)
        elif takes_text(field):
            keys = typing_line(width, target, self.typing_keys(), spaces=takes_space(field))
        else:
            keys = keys_line(self.name_of_screen, width, target)
        return [key_line(keys)]

    def typing_keys(self) -> Sequence[tuple[str, str]]:
        """Return the effects of Enter, Esc and similar keys in the focused field."""
        return ()

    @property
    def name_of_screen(self) -> str:
        """The screen's name in the table of actions."""
        return (self.TITLE or "").lower()

    def on_key(self, event: Key) -> None:
        """Report where a key works that this screen does not use."""
        if event.key in self.active_bindings or isinstance(self.focused, Input):
            return
        if message := elsewhere(self.name_of_screen, event.key, event.character):
            self.app.tell(message)

    def hint_keys(self, keys: str) -> None:
        """Show a sentence about keys after the newest message, on this screen only."""
        self.app.key_hint = (self.app.events.newest, self.name_of_screen, keys)

    def action_leave(self) -> None:
        """Return to the screen below."""
        self.app.pop_screen()


def _fitted(line: Text, width: int) -> Text:
    """The line, or its beginning if the place is narrower; width 0 means not laid out yet."""
    if not 0 < width < line.cell_len:
        return line
    line = line.copy()
    line.truncate(width, overflow="ellipsis")
    return line
