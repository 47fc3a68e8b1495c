"""Keys that can do no harm in a burst: they act at once, all others wait to be known as alone."""

from __future__ import annotations

import logging

from tui.terminal.fields import takes_text
from tui.terminal.type_ahead import CURSOR_KEYS, EDITS, TypeAhead

from .app_port import Panel
from .keys.table import key_meanings

log = logging.getLogger(__name__)

TOGETHER_KEYS = "{count} keys came together and were ignored."
TOO_LATE_KEYS = "{count} keys came too late and were ignored."
NOT_ALONE_KEY = "A key was ignored: it did not come alone."
TOO_LATE_KEY = "A key was ignored: it came too late."


class HarmlessKeys(Panel):
    """Knows what the next key can do on the present screen."""

    def __init__(self) -> None:
        super().__init__()
        self._typed = TypeAhead(self, self)

    def acts_at_once(self, key: str, character: str | None, *, begins: bool, after: float) -> bool:
        """Return True if a key can do no harm in a burst; in the thread that reads the keys.

        Only the first key of a burst may show another screen. While the key read at the time
        `after` has not had its whole effect, it is not known what the next one does.
        """
        try:
            if self._typed.done_to < after or self.opening.goes_on:
                return False
            moves = key in CURSOR_KEYS or takes_text(self.focused)
            return (begins or moves) and self.only_shows(key, character)
        except Exception:
            log.exception("a key waits until it is known whether it came alone")
            return False

    def only_shows(self, key: str, character: str | None) -> bool:
        """Return True if a key can only move a cursor, write text or show something now."""
        writes = key in EDITS or (character is not None and character.isprintable())
        screen = self.screen
        if takes_text(self.focused):
            return writes or key in CURSOR_KEYS
        if takes_text(screen):  # the run line, where arrows step a reference and letters close it
            return key in EDITS or (character is not None and character.isdecimal())
        if screen.is_modal:
            return key in CURSOR_KEYS
        meanings = key_meanings(getattr(screen, "name_of_screen", ""))
        known = [meanings[name] for name in (key, character or key) if name in meanings]
        return all(known) if known else key in CURSOR_KEYS

    def ignored_keys_text(self, count: int, *, late: bool = False) -> None:
        """Report that keys came at once, or too late, and did nothing."""
        if count > 1:
            text = TOO_LATE_KEYS if late else TOGETHER_KEYS
        else:
            text = TOO_LATE_KEY if late else NOT_ALONE_KEY
        self.notify(text.format(count=count), severity="warning")
