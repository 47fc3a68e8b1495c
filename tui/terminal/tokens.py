"""Forms of terminal sequences, and the tokens that the input is split into."""

from __future__ import annotations

import re
from typing import Final, NamedTuple


class KeyToken(NamedTuple):
    """A key: its name in Textual, its character, and the times of its first and last character."""

    name: str
    character: str | None
    began: float
    at: float
    mark: object = None
    """The mark of the read in which it began: the stop stamp."""


class Paste(NamedTuple):
    """A pasted text, recognized by the brackets that terminals send around it."""

    text: str
    at: float


class Report(NamedTuple):
    """A report of the terminal about itself, for Textual."""

    text: str


Token = KeyToken | Paste | Report


LONGEST_KEY: Final = 32
"""Characters of the longest sequence of a key."""

LONGEST_REPLY: Final = 4096
"""Characters after which a reply without an end is given up."""

ESC: Final = "\x1b"
PASTE_BEGINS: Final = "\x1b[200~"
PASTE_ENDS: Final = "\x1b[201~"

REPORT = re.compile(
    r"\x1b\[(\d+;\d+R"  # cursor position
    r"|\?\d+;\d\$y"  # support of a mode
    r"|48;[\d:]+;[\d:]+;[\d:]+;[\d:]+t)",  # new size
    re.ASCII,
)
MOUSE = re.compile(r"\x1b\[(<\d+;-?\d+;-?\d+[Mm]|\d+;\d+;\d+M|M...)", re.ASCII | re.DOTALL)
RXVT = re.compile(r"\x1b\[([2-8]|1[1-9]|2[0-9]|3[0-4])", re.ASCII)
"""rxvt ends a key with Shift with $, which in other sequences is not the last character."""
EIGHT_BIT = {"\x9b": "[", "\x8f": "O", "\x90": "P", "\x9d": "]"}
EIGHT_BIT |= {chr(0xDC00 + ord(code)): same for code, same in EIGHT_BIT.items()}
"""ESC and its next character as one character, or as one byte that is not valid UTF-8."""
REPLY_BEGINS = {"]": "0123456789", "P": "0123456789;>!$+=?|", "_": "G"}
"""First characters of replies, and the characters that may follow: Alt+] and Alt+P begin alike."""
REPLY_ENDS = "\x07\x9c\udc9c\x18\x1a"
ESCAPED = frozenset({"[", "O", *REPLY_BEGINS})
"""Characters after ESC that begin a sequence; any other is a key with Alt."""
