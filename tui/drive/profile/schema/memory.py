"""Commands that save a drive's settings or restore factory settings."""

from __future__ import annotations

from .base import RawWord, Table, When


class MemoryOrder(Table, frozen=True, kw_only=True):
    """A word that saves settings or restores factory settings."""

    parameter: str
    raw: RawWord
    """The value, or the bits that are set while the others are kept."""
    bit: bool = False
    """True if `raw` contains bits and the word's other bits are kept."""
    does: str
    """Exact effect, shown for confirmation."""
    at_rest_mask: RawWord = 0
    """Bits of the extended status word that must be 0 beforehand."""
    keeps_value: bool = False
    """True if the word keeps the written value and does not show completion."""
    done: When | None = None
    """Condition that shows completion, if the word itself does not."""
    groups: str = ""
    """A word that selects the groups of settings; nothing happens while it is 0."""
    source: str = ""


class MemoryOrders(Table, frozen=True, kw_only=True):
    """Commands to a drive's memory; unknown ones are omitted."""

    save: MemoryOrder | None = None
    factory: MemoryOrder | None = None
    busy_mask: RawWord = 0
    """Bits of the extended status word that are 1 while the EEPROM is written."""
