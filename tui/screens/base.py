"""Common parts of the screens: regular refresh, lines in their places, the keys."""

from __future__ import annotations

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

from .frame import SELDOM, Framed
from .keys.table import elsewhere, keys_line, opening_line, typing_line


class PanelScreen(Framed):
    """A screen made of lines within the frame, the last of which names its keys.

    Textual calls the `on_...` methods of a class and then those of its bases.
    """

    DEFAULT_CSS = """
    PanelScreen { layout: vertical; overflow: hidden; }
    PanelScreen { background: $background; color: $foreground; }
    PanelScreen #frame-room { height: 2; }
    PanelScreen #keys { dock: bottom; height: 1; margin-top: 1; background: $surface; }
    """
    LOOK: ClassVar[float | None] = None
    """Seconds between two looks at what there is; None for a screen with a time of its own."""

    def compose(self) -> ComposeResult:
        """The frame, what the screen itself shows, and its keys."""
        yield from self.framed()
        yield Lines(id="frame-room")  # the place of strip and tabs
        yield from self.body()
        yield Lines(id="keys", fit=self.keys_now)

    def body(self) -> Iterable[Widget]:
        """Compose the part between the tabs and the message."""
        raise NotImplementedError

    def on_mount(self) -> None:
        """Look now and then."""
        if self.LOOK is not None:
            self.set_interval(SELDOM if self.app.low_bandwidth else self.LOOK, self.look)

    def on_resize(self, event: Resize) -> None:
        """More room, more lines."""
        self.call_after_refresh(self.look)

    def put(self, place: str, lines: Sequence[Text]) -> None:
        """Show lines in the place with that id; what does not fit ends with an ellipsis."""
        found = self.query_one(f"#{place}", Lines)
        found.show([_fitted(line, found.size.width) for line in lines])

    def put_all(self, place: str, lines: Sequence[Text]) -> None:
        """The same in a place that is given as many rows as there are lines."""
        found = self.query_one(f"#{place}", Lines)
        if found.size.height != len(lines):
            found.styles.height = len(lines)
        self.put(place, lines)

    def look(self) -> None:
        """Show what there is now; lines that stay the same are not drawn."""
        # when the panel ends the parts of a screen go one by one, and timers still tick
        if self.is_current and self.app.is_running and not self.is_too_small:
            self.draw(self.size.width)

    def draw(self, width: int) -> None:
        """Put every line, here that of the keys; the screen is on top and large enough."""
        self.put("keys", self.keys_now(width))

    def draw_stop_keys(self) -> None:
        """The line of keys names them, and which keys mean something beside them."""
        for found in self.query("#keys").results(Lines):  # none while the screen is made, or goes
            width = found.size.width
            if width and self.is_current and not self.is_too_small:
                found.show([_fitted(line, width) for line in self.keys_now(width)])

    def keys_now(self, width: int) -> list[Text]:
        """The line of keys as it is now."""
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
        """The screen as the table of actions calls it."""
        return (self.TITLE or "").lower()

    def on_key(self, event: Key) -> None:
        """A key that means nothing here says where it does, and does nothing."""
        if event.key in self.active_bindings or isinstance(self.focused, Input):
            return
        if message := elsewhere(self.name_of_screen, event.key, event.character):
            self.app.tell(message)

    def hint_keys(self, keys: str) -> None:
        """Show a sentence about keys after the newest message, on this screen only."""
        self.app.key_hint = (self.app.events.newest, self.name_of_screen, keys)

    def action_leave(self) -> None:
        """Back to the screen below."""
        self.app.pop_screen()


def _fitted(line: Text, width: int) -> Text:
    """The line itself, or its beginning where the place is narrower; 0 is not laid out yet."""
    if not 0 < width < line.cell_len:
        return line
    line = line.copy()
    line.truncate(width, overflow="ellipsis")
    return line
