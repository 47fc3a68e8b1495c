"""Saving of a drive's settings, and its return to factory settings."""

from __future__ import annotations

from .base import RawWord, Table, When


class MemoryOrder(Table, frozen=True, kw_only=True):
    """A word that saves or recalls settings."""

    parameter: str
    raw: RawWord
    """The value, or the bits that are set while the others stay."""
    bit: bool = False
    """True where `raw` are bits of a word whose others stay."""
    does: str
    """Exact effect, for the person who confirms it."""
    at_rest_mask: RawWord = 0
    """Bits of the extended status word that must be 0 before."""
    keeps_value: bool = False
    """True if the word keeps the written value: it does not show when it is done."""
    done: When | None = None
    """Sign that it is done, if the word itself does not show it."""
    groups: str = ""
    """A word that chooses the groups of settings; nothing happens while it is 0."""
    source: str = ""


class MemoryOrders(Table, frozen=True, kw_only=True):
    """The orders to a drive's memory; what is not known is left out."""

    save: MemoryOrder | None = None
    factory: MemoryOrder | None = None
    busy_mask: RawWord = 0
    """Bits of the extended status word that are 1 while the EEPROM is written."""
