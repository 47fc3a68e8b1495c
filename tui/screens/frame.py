"""Frame around every screen and over every dialog: status bar, tabs, the newest message.

It is live everywhere: a person who answers a question sees the state of the motor.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from itertools import takewhile
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from rich.style import Style
from rich.text import Text
from textual.events import Key, Resize, ScreenResume
from textual.screen import Screen
from textual.widget import Widget

from tui.drive.plain import plain
from tui.session.command.stop_report import NOT_STOPPED
from tui.terminal.fields import takes_space, takes_text
from tui.terminal.names import STOP_KEYS
from tui.widgets.drawing import key_line, wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, ATTENTION, FAINT, FAULT, FAULT_BLOCK, PLAIN, STRONG
from tui.widgets.replay_bar import replay_line, time_line
from tui.widgets.small import is_too_small, small_lines
from tui.widgets.strip import BarMessage, FrameView, Tab, message_line, strip_line, tabs_line

from .keys.table import SCREENS, TABBED, once_closed, stop_keys

if TYPE_CHECKING:
    from tui.session.events import Event

    from .app_port import Panel

TAB_OF_PAGE = {page.name: page.tab.lower() for page in SCREENS if page.tab}
TABS = tuple(Tab(tab.name, tab.digit, tab.title, tab.narrow) for tab in TABBED)
MESSAGE_KIND_STYLES: dict[str, Style] = {
    "fault": FAULT,
    "failed": FAULT,
    "error": FAULT,
    "refused": ALARM,
    "alarm": ALARM,
    "stop": STRONG,
    "working": ATTENTION,
    "done": PLAIN,
}
FRAME_LOOK = 0.25
"""Seconds between two updates of the frame, and of the screen within it."""
SELDOM = 2.0
"""Seconds between two updates on a slow link; state, stop and fault are shown immediately."""
WHOLE_KINDS = frozenset({"fault", "failed", "error", "refused", "alarm", "told", "done"})
"""Kinds of messages that are first shown in full, on several lines if necessary."""
WHOLE_FOR = 15.0
"""Seconds for which such a message may take more than one line."""
WHOLE_LINES = 6
NOT_STOPPED_HEAD = "NOT STOPPED"
"""Beginning of a message about a motor that did not stop; it is shown in full until the next."""
NOT_STOPPED_LINES = 6
"""Rows for motors that did not stop; more are counted in one sentence."""
NOT_STOPPED_MANY = "NOT STOPPED: {} drives. Stop them at the machine. Press m for the reasons."
DIALOG_SHARE, TOP_ROWS = 0.83, 2
"""Part of the terminal's height for a dialog, as `max-height`, and rows of the frame above it."""
DIALOG_KEYS = "dialog-keys"
"""Id of the stop keys of a dialog; they cover the key bar of the screen below."""


class Framed(Screen[Any]):
    """A screen, or a dialog over one, with the frame around it; the app redraws the frame."""

    app: Panel
    _frame_parts: Mapping[str, Lines] = MappingProxyType({})
    _small: Lines | None = None
    """Cover of the screen while the terminal is too small."""
    DEFAULT_CSS = """
    Framed { layers: default frame; }
    Framed #strip { dock: top; height: 1; background: $surface; layer: frame; }
    Framed #tabs { dock: top; height: 1; margin-top: 1; background: $background; layer: frame; }
    Framed #said { dock: bottom; height: 1; margin-bottom: 1; layer: frame; }
    Framed #said { background: $background; }
    Framed #dialog-keys { dock: bottom; height: 1; background: $surface; layer: frame; }
    Framed #small { dock: top; height: 100%; width: 100%; background: $background; layer: frame; }
    """

    def framed(self) -> Iterable[Widget]:
        """The parts of the frame with their present contents, for the first picture."""
        view, width = self.app.frame_now(), self.app.size.width
        parts = self._parts(view, width)
        self._frame_parts = {place: Lines(id=place) for place in parts}
        for place, part in self._frame_parts.items():
            part.show(parts[place])
            if place == "said":
                part.styles.height = len(parts[place])  # so that the first picture is complete
            yield part

    def _parts(self, view: FrameView, width: int) -> dict[str, list[Text]]:
        here = (self.TITLE or "").lower() or view.place
        here = TAB_OF_PAGE.get(here, here)
        lead = not self.takes_letters
        news = view.message is not None or not view.not_stopped
        replay = view.strip.replay
        parts = {
            "strip": [replay_line(replay, width) if replay else strip_line(view.strip, width)],
            "tabs": [
                time_line(replay, width)
                if replay
                else tabs_line(TABS, here, view.marks, width, lead=lead)
            ],
            "said": [
                *not_stopped_lines(view.not_stopped, width),
            ],
        }
        # the rows of the screen below stay as they are while a dialog is open
        rows = self._rows_below() if self.is_modal else 1
        if news:
            room = rows - len(parts["said"])
            parts["said"] += message_lines(view.message, width, lead=lead, rows=room)
        if self.is_modal:
            parts["said"] += [Text("")] * (rows - len(parts["said"]))
            stops = stop_keys(self.app.stop_target_text, typing=takes_space(self.focused))
            parts[DIALOG_KEYS] = [key_line(stops)]
        return parts

    @property
    def is_too_small(self) -> bool:
        """True if the terminal is too small for the screen."""
        return is_too_small(*self.app.size)

    @property
    def dialog_rows(self) -> int:
        """Rows of a dialog at most: the frame covers no part of it."""
        height = self.app.size.height
        below = max(1, self._rows_below()) + 1
        return min(int(height * DIALOG_SHARE), height - TOP_ROWS - below)

    def on_mount(self) -> None:
        """Keep a dialog between the tabs and the message."""
        self._fit_dialog()

    def _fit_dialog(self) -> None:
        if not self.is_modal:
            return
        is_centered = self.styles.align_vertical == "middle"
        for part in self.children:
            if part is not self._small and part.id not in self._frame_parts:
                part.styles.max_height = self.dialog_rows
                if is_centered:
                    part.styles.margin = (0, 0, max(0, self._rows_below() + 1 - TOP_ROWS), 0)

    def on_resize(self, event: Resize) -> None:
        """Show immediately if the terminal is too small now."""
        self._fit_dialog()
        if self.is_current and self.app.is_running:
            self.draw_frame(self.app.frame_now())

    @property
    def takes_letters(self) -> bool:
        """True if digits and letters do not act as keys of the panel: in a dialog or a field."""
        return self.is_modal or takes_text(self.focused)

    def watch_focused(self) -> None:
        """Show whether Space is text or a stop before the next key can come."""
        if self.is_running:
            self.call_later(self.draw_stop_keys)

    def draw_stop_keys(self) -> None:
        """Name the keys that stop now."""
        if self.app.is_running and self.is_current:
            self.draw_frame(self.app.frame_now())

    def on_screen_resume(self, event: ScreenResume) -> None:
        """Refresh the frame, which was frozen while another screen was on top."""
        self.draw_frame(self.app.frame_now())

    def on_key(self, event: Key) -> None:
        """Report where a key works that a dialog does not use."""
        typed = takes_text(self.focused) and event.is_printable
        known = event.key in STOP_KEYS or event.key in self.active_bindings
        if not self.is_modal or typed or known:
            return
        if text := once_closed(self.app.place, event.key, event.character):
            self.app.tell(text)

    def look(self) -> None:
        """Show the present contents within the frame; a dialog has none that change."""

    def look_in_time(self) -> None:
        """Show them if that is due, right after the frame: so both are in one output."""

    def draw_frame(self, view: FrameView) -> None:
        """Show the frame's present contents; unchanged parts are not drawn."""
        if not self.size.width:
            return
        self._draw_small(view)
        if self.is_too_small:
            return
        parts = self._parts(view, self.size.width)
        # kept in a mapping: a query costs more than drawing them
        for place, lines in parts.items():
            part = self._frame_parts.get(place)
            if part is None or not part.is_attached:
                continue  # the screen is being composed or removed
            if place == "said" and self.message_rows != len(lines):
                part.styles.height = len(lines)
            part.show(lines)

    def _rows_below(self) -> int:
        """Rows of the message areas that a dialog must cover."""
        screens = takewhile(lambda screen: screen is not self, self.app.screen_stack)
        return max((each.message_rows for each in screens if isinstance(each, Framed)), default=0)

    @property
    def message_rows(self) -> int:
        """Rows of the message area."""
        part = self._frame_parts.get("said")
        height = part.styles.height if part is not None else None
        return int(height.value) if height is not None else 1

    def _draw_small(self, view: FrameView) -> None:
        """Cover the screen if the terminal is too small for it."""
        if not self.is_too_small:
            if self._small is not None:
                self._small.remove()
                self._small = None
            return
        if self._small is None:
            if not any(part.is_attached for part in self._frame_parts.values()):
                return  # the frame, mounted later, would cover it
            self._small = Lines(id="small")
            self.mount(self._small)
        self._small.show(small_lines(view.strip, self.app.stop_target_text, *self.size))


def not_stopped_lines(texts: Sequence[str], width: int) -> list[Text]:
    """Motors that did not stop: each text in full, or one sentence if there are many."""
    room = max(10, width - 2)
    parts = [part for text in texts for part in wrapped(text, room, NOT_STOPPED_LINES)]
    if len(parts) > NOT_STOPPED_LINES:
        parts = wrapped(NOT_STOPPED_MANY.format(len(texts)), room, NOT_STOPPED_LINES)
    return [Text(f" {part:<{room}} ", FAULT_BLOCK, no_wrap=True) for part in parts]


def message_lines(
    message: BarMessage | None, width: int, *, lead: bool = True, rows: int = 1
) -> list[Text]:
    """The message; a new one takes several lines if necessary, up to `WHOLE_LINES`.

    An older one takes several if there are `rows` for it. With `lead`, the line names the key that
    shows more.
    """
    if message is None:
        return [Text("")]
    style = MESSAGE_KIND_STYLES.get(message.kind, FAINT)
    room = width - 12
    is_whole = message.kind in WHOLE_KINDS and (
        message.age < WHOLE_FOR or NOT_STOPPED_HEAD in message.text
    )
    if (is_whole or rows > 1) and len(plain(message.text)) > room - 12:
        parts = wrapped(message.text, max(10, room), WHOLE_LINES if is_whole else rows)
        lines = []
        for number, part in enumerate(parts):
            line = Text(f" {message.when if not number else '':<8} ", FAINT, no_wrap=True)
            line.append(part, style)
            lines.append(line)
        return lines
    hint = "m messages" if width >= 60 and lead else ""
    if lead and message.there and message.kind == "fault" and width >= 72:
        hint = "[ ] other drives"
    return [message_line(message.when, message.text, style, hint, width)]


def with_drive(event: Event) -> str:
    """The text of an event, with its drive."""
    if event.device is None:
        return event.text
    if event.text.startswith(NOT_STOPPED):
        return f"{NOT_STOPPED_HEAD}, drive {event.device}: {event.text.removeprefix(NOT_STOPPED)}"
    return f"Drive {event.device}: {event.text}"


def at(wall: float) -> str:
    """The time of day of a message."""
    return time.strftime("%H:%M:%S", time.localtime(wall))
