"""Notes that programs leave for the next one on the line, for ten minutes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Annotated

import msgspec
from msgspec import Meta

from .bounds import DeviceId

NOTES_KEPT = 600.0
"""Seconds for which a note is kept."""
LONGEST_KIND = 200
"""Characters of the kind of a note."""
MOST_NOTE, MOST_NOTES = 1 << 14, 1 << 21
"""Bytes of one note, and of all that are kept; the oldest ones make room."""
NOTES_A_LOOK = 50
"""Notes that a new holder is given at a time: they are not as urgent as a stop."""
NOTE_COSTS = 200
"""Bytes of a note besides its data, approximately."""


class LineNote(msgspec.Struct, frozen=True, tag=True):
    """Information about a device, 0 for the line, for the next program.

    Without data it requests the notes of its device and kind.
    """

    device: DeviceId
    kind: Annotated[str, Meta(max_length=LONGEST_KIND)]
    data: Annotated[bytes, Meta(max_length=MOST_NOTE)] = b""


class Notes:
    """The notes of one line: in its holder those of all programs, elsewhere this program's own.

    Their content is known to their writers only. May be used from any thread.
    """

    def __init__(
        self, tell: Callable[[LineNote], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """The callback passes a message to the other programs, if there are any."""
        self._tell = tell
        self._clock = clock
        self.heard: Callable[[LineNote], object] = lambda _: None
        """Called with each new note; must not wait."""
        self._lock = threading.Lock()
        self._kept: dict[LineNote, float] = {}
        """When each note came, the oldest first."""
        self._size = 0

    def leave(self, note: LineNote) -> None:
        """Add a note of this program."""
        self.keep(note)
        self._tell(note)

    def ask(self, device: int, kind: str) -> None:
        """Request the notes of a device and kind; a NoteReceived follows for each."""
        self._tell(LineNote(device, kind))

    def keep(self, note: LineNote) -> None:
        """Keep a note; a duplicate is kept once."""
        now = self._clock()
        with self._lock:
            new = note not in self._kept
            if new:
                self._kept[note] = now
                self._size += _size(note)
            while self._size > MOST_NOTES or (
                self._kept and now - next(iter(self._kept.values())) > NOTES_KEPT
            ):
                old = next(iter(self._kept))
                del self._kept[old]
                self._size -= _size(old)
        if new:
            self.heard(note)

    def of(self, device: int, kind: str) -> tuple[LineNote, ...]:
        """The notes of a device and kind, the oldest first."""
        return tuple(note for note in self.all if (note.device, note.kind) == (device, kind))

    @property
    def all(self) -> tuple[LineNote, ...]:
        """All notes that are kept, the oldest first."""
        with self._lock:
            oldest = self._clock() - NOTES_KEPT
            return tuple(note for note, when in self._kept.items() if when >= oldest)


def _size(note: LineNote) -> int:
    return len(note.data) + NOTE_COSTS
