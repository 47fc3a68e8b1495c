"""Signs of ASCII, and of Latin-1 where the terminal has them, for those that are drawn otherwise.

Each is in one cell, as the sign that it replaces: nothing moves.
"""

from __future__ import annotations

import unicodedata
from functools import lru_cache
from typing import Final

from rich.cells import cell_len
from rich.segment import Segment
from textual.color import Color
from textual.filter import LineFilter

NO_SIGN: Final = "?"
PLAIN_SIGNS: Final = {
    **dict.fromkeys("─╴╶╸╺╌┄", "-"),
    **dict.fromkeys("│┃╷╵║┆▏▎▍▌▐▕", "|"),
    **dict.fromkeys("┌┐└┘├┤┬┴┼╭╮╯╰", "+"),
    **dict.fromkeys("━═▔▀▄▅", "="),
    **dict.fromkeys("▁▂▃", "_"),
    **dict.fromkeys("▆▇█▓▒░", "#"),
    **dict.fromkeys("→▶▸►", ">"),
    **dict.fromkeys("←◀◂", "<"),
    **dict.fromkeys("↑▲", "^"),
    **dict.fromkeys("↓▼▾", "v"),
    **dict.fromkeys("·•", "."),
    **dict.fromkeys("●◉", "*"),
    **dict.fromkeys("□○◦", "-"),
    **dict.fromkeys("–—−", "-"),
    **dict.fromkeys("‘’", "'"),
    **dict.fromkeys("“”„", '"'),
    **dict.fromkeys("×", "x"),
    "±": "+",
    "■": "!",
    "…": "~",
    "µ": "u",
    "Ω": "O",
    "°": "o",
}
"""Drawn characters and their plain substitutes."""


class PlainSigns(LineFilter):
    """Replaces what cannot be written in an encoding, one for one."""

    def __init__(self, encoding: str) -> None:
        super().__init__()
        self._encoding = encoding

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """The same line with plain signs."""
        return [
            segment
            if segment.control or segment.text.isascii()
            else Segment(in_encoding(segment.text, self._encoding), segment.style)
            for segment in segments
        ]


@lru_cache(maxsize=2048)
def in_encoding(text: str, encoding: str) -> str:
    """A text with a plain sign for each character that an encoding lacks; as wide as it was."""
    return "".join(_sign(character, encoding) for character in text)


def _sign(character: str, encoding: str) -> str:
    try:
        character.encode(encoding)
    except UnicodeEncodeError:
        pass
    else:
        return character
    width = cell_len(character)
    letter = unicodedata.normalize("NFKD", character)[:1]
    sign = PLAIN_SIGNS.get(character) or (letter if letter.isascii() else NO_SIGN)
    return sign.ljust(width, NO_SIGN)[:width]
