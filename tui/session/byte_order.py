"""The byte order in which a drive's words arrive, judged by every value that is read of it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

from tui.bus.errors import BytesSwapped
from tui.drive.byte_order import only_swapped
from tui.drive.profile.profile import Profile

from .reading import Reading

LEAST_REGISTERS = 3
"""Registers that must speak for swapped bytes; one word may be out of its range."""
MAJORITY = 4
"""So many times more registers must speak for one order than for the other to change it."""
VOTES_LAST = 90.0
"""Seconds after which a value says nothing about the present order."""


class ByteOrder:
    """True if the bytes of each word of one drive arrive swapped; for any thread."""

    def __init__(self, device: int) -> None:
        self._device = device
        self._lock = threading.Lock()
        self._seen: dict[str, tuple[bool, float]] = {}
        self._against: tuple[str, ...] = ()
        """Codes that showed swapped bytes, while words arrive so."""
        self.on_swapped: Callable[[str], object] = str
        """Called with the text once words begin to arrive swapped."""
        self._tested = self._was_away = False

    @property
    def error(self) -> BytesSwapped | None:
        """Error; None while words arrive correctly."""
        return BytesSwapped(self._device, self._against) if self._against else None

    @property
    def text(self) -> str:
        """The same as text, empty while nothing is wrong."""
        return str(self.error or "")

    @property
    def is_doubtful(self) -> bool:
        """True if the settings that show the order are to be read: not yet, or not all agree."""
        return not self._tested or self.is_suspect

    @property
    def is_suspect(self) -> bool:
        """True if a value speaks for swapped bytes, or the line was lost since they were read."""
        return self._was_away or any(swapped for swapped, _ in self._seen.values())

    def note_tested(self) -> None:
        """Those settings were read, or the drive has none of them."""
        self._tested, self._was_away = True, False

    def forget(self) -> None:
        """Another drive may answer now, or by another gateway."""
        self._was_away = self._tested
        self._tested = False

    def note(self, profile: Profile, found: Mapping[str, Reading], now: float) -> None:
        """Judge by values that were just read."""
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
                self._seen, self._against = {}, ()  # whatever came before
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
