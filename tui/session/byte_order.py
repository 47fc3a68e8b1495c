"""Byte order of a drive's words, judged by every value that is read."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

from tui.bus.errors import BytesSwapped
from tui.drive.byte_order import only_swapped
from tui.drive.profile.profile import Profile

from .reading import Reading

LEAST_REGISTERS = 3
"""Least registers that must indicate swapped bytes; a single word may be out of its range."""
MAJORITY = 4
"""Factor by which the registers for one byte order must outnumber those for the other."""
VOTES_LAST = 90.0
"""Seconds after which a value no longer counts."""


class ByteOrder:
    """Detects whether the bytes of each word of one drive arrive swapped. Thread-safe."""

    def __init__(self, device: int) -> None:
        self._device = device
        self._lock = threading.Lock()
        self._seen: dict[str, tuple[bool, float]] = {}
        self._against: tuple[str, ...] = ()
        """Codes that indicated swapped bytes; empty while words arrive correctly."""
        self.on_swapped: Callable[[str], object] = str
        """Called with `text` when words begin to arrive swapped."""
        self._tested = self._was_away = False

    @property
    def error(self) -> BytesSwapped | None:
        """Error to raise for reads; None while words arrive correctly."""
        return BytesSwapped(self._device, self._against) if self._against else None

    @property
    def text(self) -> str:
        """Text of the error; empty while words arrive correctly."""
        return str(self.error or "")

    @property
    def is_doubtful(self) -> bool:
        """True if the settings that show the byte order must be read, or read again."""
        return not self._tested or self.is_suspect

    @property
    def is_suspect(self) -> bool:
        """True if a value indicates swapped bytes, or the line was lost since the last check."""
        return self._was_away or any(swapped for swapped, _ in self._seen.values())

    def note_tested(self) -> None:
        """Note that these settings were read, or that the drive has none of them."""
        self._tested, self._was_away = True, False

    def forget(self) -> None:
        """Require a new check: another drive or gateway may answer now."""
        self._was_away = self._tested
        self._tested = False

    def note(self, profile: Profile, found: Mapping[str, Reading], now: float) -> None:
        """Judge the byte order by values that were just read."""
        read = {
            c: (reading, reading.raw) for c, reading in found.items() if reading.raw is not None
        }
        votes = {
            c: only_swapped(profile, reading.parameter, raw) for c, (reading, raw) in read.items()
        }
        right = sum(vote is False for vote in votes.values())
        wrong = sum(vote is True for vote in votes.values())
        with self._lock:
            if right >= LEAST_REGISTERS and right >= MAJORITY * wrong:
                self._seen, self._against = {}, ()  # a clear majority overrides earlier values
            elif wrong >= LEAST_REGISTERS and wrong >= MAJORITY * right:
                self._seen = {}
            kept = {c: s for c, s in self._seen.items() if c not in read}
            new = {c: (vote, read[c][0].time) for c, vote in votes.items() if vote is not None}
            every = {**kept, **new}
            self._seen = {c: s for c, s in every.items() if now - s[1] <= VOTES_LAST}
            against = sorted(code for code, (swapped, _) in self._seen.items() if swapped)
            others = len(self._seen) - len(against)
            begins = not self._against and len(against) >= max(LEAST_REGISTERS, MAJORITY * others)
            if begins:
                self._against = tuple(against)
        if begins:
            self.on_swapped(self.text)
