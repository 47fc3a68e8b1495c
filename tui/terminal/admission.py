"""Which keys may do something: one that came alone; of a piece, text and moves of a cursor."""

from __future__ import annotations

import time
from typing import Protocol

from textual.app import App
from textual.events import Key, Paste

from tui.safety import KEY_TOO_LATE

from .fields import takes_text
from .stroke import Stroke, attach, stroke_of

CURSOR_KEYS = frozenset(
    {"up", "down", "left", "right", "pageup", "pagedown", "home", "end", "tab", "shift+tab"}
)
"""Keys that move a cursor, and that a piece may move it with."""

EDITS = frozenset({"backspace", "delete"})

TOLD_AFTER = 0.1
"""Seconds after which the keys of a piece are reported without waiting for more."""


PASTE_IGNORED = "Pasted text ignored: it goes into a text field only."


class Stamps(Protocol):
    """Needs of admission that not every app meets."""

    def stop_stamp(self) -> object:
        """Another object after every stop."""

    def ignored_keys_text(self, count: int, *, late: bool = False) -> None:
        """Report that keys came at once, or too late, and did nothing."""


class Admission:
    """Lets keys in, or counts them."""

    def __init__(self, app: App[None], stamps: Stamps) -> None:
        self._app = app
        self._stamps = stamps
        self._refused = 0
        self._late = False
        self._looking = False

    def admits(self, event: Key | Paste) -> bool:
        """Return True if the app may take a key or a paste now, when its turn has come."""
        if isinstance(event, Paste):
            is_text = takes_text(self._app.focused)
            if event.text and not is_text:
                self._app.notify(PASTE_IGNORED)
            return is_text
        stroke = stroke_of(event)
        if stroke is None:  # no terminal has sent it: a test, or the app itself
            attach(event, Stroke(time.monotonic(), self._stamps.stop_stamp()))
            return True
        if stroke.stamp != self._stamps.stop_stamp():
            return False  # a stop was the last word
        late = time.monotonic() - stroke.read_at > KEY_TOO_LATE
        if late:
            attach(event, stroke._replace(alone=False, held=False, steps=False))
        if (stroke.acts and not late) or self._harmless(event):
            return True
        self._count(late)
        return False

    def _harmless(self, event: Key) -> bool:
        """Return True if a key of a piece can only write text or move a cursor."""
        if event.key in CURSOR_KEYS:
            return True
        typed = event.is_printable or event.key in EDITS
        return typed and (takes_text(self._app.focused) or takes_text(self._app.screen))

    def _count(self, late: bool) -> None:
        self._refused += 1
        self._late = self._late or late
        if not self._looking:
            self._looking = True
            self._look(0)

    def _look(self, before: int) -> None:
        """Report once no more keys of the piece arrive."""
        if self._refused > before:
            now = self._refused
            self._app.set_timer(TOLD_AFTER, lambda: self._look(now))
            return
        count, late = self._refused, self._late
        self._refused, self._late, self._looking = 0, False, False
        self._stamps.ignored_keys_text(count, late=late)
