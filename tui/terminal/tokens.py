"""Forms of terminal sequences, and the tokens that they become."""

from __future__ import annotations

import re
from typing import Final, NamedTuple


class KeyToken(NamedTuple):
    """A key: its name in Textual, what it types, when its first and its last character was read."""

    name: str
    character: str | None
    began: float
    at: float
    mark: object = None
    """Whatever was given with the read in which it began."""


class Paste(NamedTuple):
    """A text that was pasted, with the brackets that terminals put around it."""

    text: str
    at: float


class Report(NamedTuple):
    """Something that the terminal says of itself and Textual wants to hear."""

    text: str


Token = KeyToken | Paste | Report


LONGEST_KEY: Final = 32
"""Characters that no sequence of a key is longer than."""

LONGEST_REPLY: Final = 4096
"""Characters after which a reply without an end is none."""

ESC: Final = "\x1b"
PASTE_BEGINS: Final = "\x1b[200~"
PASTE_ENDS: Final = "\x1b[201~"

REPORT = re.compile(
    r"\x1b\[(\d+;\d+R"  # where the cursor stands
    r"|\?\d+;\d\$y"  # whether it knows a mode
    r"|48;[\d:]+;[\d:]+;[\d:]+;[\d:]+t)",  # its new size
    re.ASCII,
)
MOUSE = re.compile(r"\x1b\[(<\d+;-?\d+;-?\d+[Mm]|\d+;\d+;\d+M|M...)", re.ASCII | re.DOTALL)
RXVT = re.compile(r"\x1b\[([2-8]|1[1-9]|2[0-9]|3[0-4])", re.ASCII)
"""A key with Shift ends with $, which elsewhere comes before the end."""
EIGHT_BIT = {"\x9b": "[", "\x8f": "O", "\x90": "P", "\x9d": "]"}
EIGHT_BIT |= {chr(0xDC00 + ord(code)): same for code, same in EIGHT_BIT.items()}
"""ESC and what follows in one character, or in one byte that is not UTF-8."""
REPLY_BEGINS = {"]": "0123456789", "P": "0123456789;>!$+=?|", "_": "G"}
"""Replies of any length, and how they go on: Alt+] and Alt+P begin the same."""
REPLY_ENDS = "\x07\x9c\udc9c\x18\x1a"
ESCAPED = frozenset({"[", "O", *REPLY_BEGINS})
"""Characters after ESC that begin a sequence; any other is a key with Alt."""
