"""Keys that are harmless in a burst act immediately; all other keys wait until classified."""

from __future__ import annotations

import logging

from tui.terminal.fields import takes_text
from tui.terminal.type_ahead import CURSOR_KEYS, EDITS, TypeAhead

from .app_port import Panel
from .keys.table import key_meanings

log = logging.getLogger(__name__)

TOGETHER_KEYS = "Ignored {count} keys that arrived together."
TOO_LATE_KEYS = "Ignored {count} keys that arrived too late."
NOT_ALONE_KEY = "Ignored a key that did not arrive alone."
TOO_LATE_KEY = "Ignored a key that arrived too late."


class HarmlessKeys(Panel):
    """Part of the panel that classifies the next key by its effect on the present screen."""

    def __init__(self) -> None:
        super().__init__()
        self._typed = TypeAhead(self, self)

    def acts_at_once(self, key: str, character: str | None, *, begins: bool, after: float) -> bool:
        """Return True if a key is harmless in a burst. Runs in the thread that reads the keys.

        Only the first key of a burst may show another screen. The effect of a key is not known
        before the key read at the time `after` has taken full effect. An error counts as harmful.
        """
        try:
            if self._typed.done_to < after or self.opening.goes_on:
                return False
            moves = key in CURSOR_KEYS or takes_text(self.focused)
            return (begins or moves) and self.only_shows(key, character)
        except Exception:
            log.exception("a key waits until it is classified")
            return False

    def only_shows(self, key: str, character: str | None) -> bool:
        """Return True if a key can only move a cursor, type text or show something now."""
        writes = key in EDITS or (character is not None and character.isprintable())
        screen = self.screen
        if takes_text(self.focused):
            return writes or key in CURSOR_KEYS
        if takes_text(screen):  # the run line: arrows step its reference, and letters close it
            return key in EDITS or (character is not None and character.isdecimal())
        if screen.is_modal:
            return key in CURSOR_KEYS or key in getattr(screen, "only_close", ())
        meanings = key_meanings(getattr(screen, "name_of_screen", ""))
        known = [meanings[name] for name in (key, character or key) if name in meanings]
        return all(known) if known else key in CURSOR_KEYS

    def report_ignored_keys(self, count: int, *, late: bool = False) -> None:
        """Report keys that were ignored because they arrived together, or too `late`."""
        if count > 1:
            text = TOO_LATE_KEYS if late else TOGETHER_KEYS
        else:
            text = TOO_LATE_KEY if late else NOT_ALONE_KEY
        self.notify(text.format(count=count), severity="warning")
