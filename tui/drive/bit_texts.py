"""Texts of the bits of a word, true at 1 and at 0; pure.

A bit may state a fact at 0 too, and its name may be the opposite of what 1 means.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from .profile.schema import Bit
from .sentences import capitalized, uncapitalized

SHORT_NAMES: Mapping[str, str] = {
    "ready to switch on": "ready",
    "operation enabled": "enabled",
    "power section supplied": "power",
    "target reached": "at reference",
    "switch on disabled": "switch on disabled",
    "no quick stop": "",
    "remote": "",
    "direction of the output": "reverse",
    "limit of the reference": "outside its limits",
    # bits that are 0
    "power section supplied: no supply": "no power",
    "remote: local": "local",
    "drive ready: not ready": "not ready",
    "unlock the drive: locked": "locked",
    "run: stop": "stop",
    "direction: forward": "",
    "direction of the output: forward": "",
    "direction of the reference: forward": "",
    "direction before the ramp: forward": "",
    "limit of the reference: within lsp..hsp": "",
    "reference limit: within lsp..hsp": "",
    "writes not allowed: allowed": "",
    "transient state: steady": "",
    "motor thermal threshold: below": "",
    "motor 1": "",
    "pid controller: enabled": "",
    "ramp 1 (acc, dec)": "",
    "coast stop: output allowed": "",
    "standby: starting up": "",
    "standby with run command: starting up": "",
    "control: remote": "",
    "high resolution: 0.1 hz": "",
    "consistency check: on": "",
}
"""Short forms of bit texts, by the text in lower case; empty for the normal state."""
ANY_LENGTH = 1000
"""Characters: more than any text has."""
SHORTEST_NAME = 6
"""Characters of a bit's name that still identify it."""
PLAIN_ANSWERS = frozenset(
    {"", "yes", "no", "on", "off", "none", "normal", "0", "1", "in force", "in progress"}
)
"""Texts of bits that mean only yes or no: alone they would not name their subject."""
DENIALS = frozenset({"no", "off", "none", "normal", "0"})
"""Texts of bits that negate the name of the bit."""
GENERIC = frozenset({"active", "reached", "supplied", "disabled", "warning", "fault"})
"""Texts of bits that add nothing to the name of a bit that is 1."""


def bit_texts(bits: Iterable[Bit], word: int) -> list[str]:
    """Return the true texts of a word's bits.

    A bit that is 0 has one only if it states a fact that is not the normal state.
    """
    return [bit_text(bit, on) for bit, on in true_bits(bits, word) if on or short_bit(bit, on=on)]


def true_bits(bits: Iterable[Bit], word: int) -> Iterator[tuple[Bit, bool]]:
    """Yield the bits whose text is true in this word, each with True if it is 1."""
    for bit in bits:
        on = bool(word >> bit.bit & 1)
        if is_valid(bit, word) and is_true(bit, on):
            yield bit, on


def short_bit(bit: Bit, *, on: bool) -> str:
    """Return a bit's text in a word or two; empty for the normal state."""
    message = bit.name if on and bit.on.casefold() in GENERIC else bit_text(bit, on, 60)
    for words in (message.casefold(), *([bit.name.casefold()] if on else [])):
        if words in SHORT_NAMES:
            return SHORT_NAMES[words]
    return uncapitalized(message)


def is_valid(bit: Bit, word: int) -> bool:
    """Return True if the bit is valid in the state that its word shows."""
    return bit.counts is None or word & bit.counts.mask == bit.counts.value


def is_true(bit: Bit, on: bool) -> bool:
    """Return True if the drawn text is true now; a bit that is 0 may state a fact too."""
    if (bit.on if on else bit.off).casefold() not in PLAIN_ANSWERS:
        return True
    return on or _denied_at_1(bit)


def _denied_at_1(bit: Bit) -> bool:
    """Return True if the name alone would be wrong at 1 and right at 0."""
    on, off = bit.on.casefold(), bit.off.casefold()
    return on in DENIALS or (off in PLAIN_ANSWERS - DENIALS and off != "")


def bit_text(bit: Bit, on: bool, room: int = ANY_LENGTH) -> str:
    """Return the name of a bit, its text, or both if they fit in `room` characters.

    A text that means only yes or no is omitted.
    """
    message = bit.on if on else bit.off
    plain = message.casefold() in PLAIN_ANSWERS
    if not _denied_at_1(bit) and (plain or (on and message.casefold() in bit.name.casefold())):
        return bit.name
    alone = capitalized(message)
    if bit.name.casefold() in message.casefold():
        return alone
    both = f"{bit.name}: {message}"
    if len(both) <= room:
        return both
    left = room - len(message) - 3
    if " " in message or left < SHORTEST_NAME:
        return alone
    return f"{bit.name[:left].rstrip()}…: {message}"
