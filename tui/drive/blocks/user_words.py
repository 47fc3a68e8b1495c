"""The four user words: words that a person monitors in addition to the monitoring set.

Each is an address with a format. A word that is not assigned, not known to the drive or
protected shows `-----`, never a number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from ..profile.profile import Profile, parse_address
from ..values import NOT_AVAILABLE
from .assignment import MappingError
from .picking import NONE

COUNT = 4
WordFormat = Literal["hex", "signed", "unsigned", "bits"]
FORMATS: tuple[WordFormat, ...] = get_args(WordFormat)


@dataclass(frozen=True, slots=True)
class UserWord:
    """One word: its wire address, 0 if none is assigned, and its format."""

    address: int = 0
    format: WordFormat = "hex"

    def text(self, word: int | None) -> str:
        """Return the word in its format; dashes if there is none."""
        if not self.address or word is None:
            return NOT_AVAILABLE
        word &= 0xFFFF
        if self.format == "hex":
            return f"{word:04X} hex"
        if self.format == "bits":
            return " ".join(f"{word >> shift & 0xF:04b}" for shift in (12, 8, 4, 0))
        return str(word - 0x10000 if self.format == "signed" and word > 0x7FFF else word)


UserWords = tuple[UserWord, ...]


def word_named(profile: Profile, text: str, format: WordFormat = "hex") -> UserWord:
    """Return the word for a typed code, number of the manual, address, or `none`.

    An address that the profile does not have is allowed: the drive decides. Raises MappingError for
    an address above 65535 or a parameter that can only be written, UnknownParameter for an unknown
    name.
    """
    wanted = text.strip()
    if wanted.casefold() in NONE:
        return UserWord(0, format)
    address = parse_address(wanted)
    if address is not None and profile.at(address) is None and profile.get(wanted) is None:
        return UserWord(address, format)
    parameter = profile.find(wanted)
    if parameter.access == "w":
        raise MappingError(f"{parameter.code} can only be written; it has no value to show.")
    if not parameter.is_register:
        raise MappingError(
            f"{parameter.code} is not a holding register. Only those are shown here."
        )
    return UserWord(parameter.address, format)


def format_named(text: str) -> WordFormat:
    """Return the format with this name; raises MappingError."""
    for format in FORMATS:
        if format == text.strip().casefold():
            return format
    raise MappingError(f"{text!r} is not a format. Use {', '.join(FORMATS)}.")


def is_no_value(profile: Profile, words: Sequence[int]) -> bool:
    """Return True if the drive replied that there is no such word, or that it is protected."""
    return profile.data.reading.unknown_word in words
