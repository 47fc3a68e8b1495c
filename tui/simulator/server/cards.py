"""Words of an Altivar 71's additional servers: programmable card, communication card.

Source: ATV71 Modbus manual, function 3, examples 2 and 3; each server has an address of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tui.drive.profile.schema import Function

from ..rules import Refusals
from .access import Refused, past_limit

MEMORY_WORDS = 2048
"""%MW0 to %MW2047 of the programmable card."""
IP_ADDRESS = range(60006, 60010)
"""IPC1 to IPC4 of the Ethernet card."""


class CardWords:
    """Known words of a card, some of them writable."""

    def __init__(self, known: Mapping[int, int], *, writable: bool, refusals: Refusals) -> None:
        self.words = dict(known)
        self._writable = writable
        self._refusals = refusals

    def read(self, address: int, count: int, function: Function) -> list[int]:
        """Return the words of a read; raises Refused if one does not exist."""
        self._check(address, count, function.max_read, function)
        return [self.words[a] for a in range(address, address + count)]

    def write(self, address: int, words: Sequence[int], function: Function) -> None:
        """Write words; raises Refused if one does not exist or is read-only."""
        self._check(address, len(words), function.max_write, function)
        if not self._writable:
            raise Refused(self._refusals.read_only)
        self.words.update(enumerate(words, start=address))

    def _check(self, address: int, count: int, limit: int | None, function: Function) -> None:
        if count < 1:
            raise Refused(self._refusals.wrong_shape)
        if limit is not None and count > limit:
            raise Refused(past_limit(function, self._refusals.wrong_shape))
        if not all(a in self.words for a in range(address, address + count)):
            raise Refused(self._refusals.unknown_address)


def card_words(parameter: str, refusals: Refusals) -> CardWords | None:
    """Return the words of the server whose address this parameter sets; None if unknown."""
    if parameter.casefold() == "amoa":
        return CardWords(dict.fromkeys(range(MEMORY_WORDS), 0), writable=True, refusals=refusals)
    if parameter.casefold() == "amoc":
        return CardWords(dict.fromkeys(IP_ADDRESS, 0), writable=False, refusals=refusals)
    return None


def card_word(name: str) -> tuple[str, int] | None:
    """Return server and address of a card's word by its name (`%MW20`, `IPC1`); None for others."""
    folded = name.strip().casefold()
    if folded.startswith("%mw") and folded[3:].isdecimal():
        return "amoa", int(folded[3:])
    if folded in ("ipc1", "ipc2", "ipc3", "ipc4"):
        return "amoc", IP_ADDRESS[int(folded[3]) - 1]
    return None
