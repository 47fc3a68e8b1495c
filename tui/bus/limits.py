"""What one device may be sent: functions, lengths, windows, sub-functions, broadcasts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

STANDARD_EXCEPTIONS: Mapping[int, str] = {
    1: "the function is not known to the device",
    2: "an address is not known to the device, or not allowed now",
    3: "a value or a length is not allowed",
    4: "the device could not do it in its present state",
    5: "the device needs longer",
    6: "the device is busy",
    7: "the device refuses",
    8: "a memory fault of the device",
    10: "the gateway has no way to the device",
    11: "the device behind the gateway did not answer",
}


@dataclass(frozen=True, slots=True)
class Window:
    """An area that may be read or written as a block although single words are the rule.

    From `min_words` to `max_words` words; with `fixed_start` only from `address` on, else
    anywhere inside the `max_words` words that begin there.
    """

    address: int
    min_words: int
    max_words: int
    fixed_start: bool

    def holds(self, address: int, count: int) -> bool:
        """Whether a block of `count` words at `address` keeps to the window."""
        if not self.min_words <= count <= self.max_words:
            return False
        if self.fixed_start:
            return address == self.address
        return self.address <= address and address + count <= self.address + self.max_words


@dataclass(frozen=True, slots=True)
class Limits:
    """What one device takes; lengths in words, `exceptions` the meaning of its codes."""

    functions: frozenset[int]
    max_read: int
    max_write: int
    max_read_23: int
    max_write_23: int
    single_words_only: bool = False
    read_windows: tuple[Window, ...] = ()
    write_windows: tuple[Window, ...] = ()
    subfunctions: frozenset[int] = frozenset()
    broadcast_functions: frozenset[int] = frozenset()
    exceptions: Mapping[int, str] = field(default_factory=lambda: STANDARD_EXCEPTIONS)


CAUTIOUS = Limits(
    functions=frozenset({3, 43}), max_read=1, max_write=0, max_read_23=0, max_write_23=0
)
"""For a device that nobody described: one word by function 3, and identification."""
