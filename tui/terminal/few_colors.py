"""Styles and signs for terminals with few colors or characters.

Without colors, a colored background is shown in reverse, and bold text stays bold. Words and signs
show the state in any case.
"""

from __future__ import annotations

import unicodedata
from functools import lru_cache
from typing import Final

from rich.cells import cell_len
from rich.color import Color as RichColor
from rich.color import ColorSystem, ColorType
from rich.segment import Segment
from rich.style import Style
from textual.color import Color
from textual.filter import LineFilter

RAISED_FROM = 0.21
"""Brightness of a background, from 0 to 1, from which it counts as highlighted."""

SUNK_TO = 0.09
"""Brightness up to which a background is darker than the screen's: an input field."""

BRIGHT_FROM = 0.5
"""Brightness from which a text color becomes one of the brighter eight."""

BLACK, BLUE, WHITE = 0, 4, 15

LEAST_DIFFERENCE = 60
"""Difference between the strongest and the weakest part of a color, of 255, below which it is
gray."""

GRAYS: tuple[tuple[float, int], ...] = ((0.25, 0), (0.42, 8), (0.75, 7), (1.01, 15))
"""Brightness limits, and the color of the sixteen below each: ground, rules, text, emphasis."""


class NoColors(LineFilter):
    """Attributes instead of colors."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """The same line without a color."""
        return [
            Segment(text, without_colors(style) if style else None, control)
            for text, style, control in segments
        ]


class SixteenColors(LineFilter):
    """The sixteen colors that every color terminal has."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """The same line in sixteen colors."""
        return [
            Segment(text, in_sixteen(style) if style else None, control)
            for text, style, control in segments
        ]


@lru_cache(maxsize=1024)
def without_colors(style: Style) -> Style:
    """The style in bold, underline and reverse instead of colors."""
    behind = style.bgcolor
    colored = behind is not None and _brightness(behind) >= RAISED_FROM
    return Style(
        bold=style.bold or None,
        underline=(style.underline or _is_sunk(behind)) or None,
        reverse=(bool(style.reverse) != colored) or None,
        meta=style.meta or None,
    )


@lru_cache(maxsize=1024)
def in_sixteen(style: Style) -> Style:
    """The style in the nearest of sixteen colors; text never has the color of its background."""
    front, behind = _words(style.color), _ground(style.bgcolor)
    if front is not None and behind is not None and front.number == behind.number:
        front = RichColor.from_ansi(WHITE if behind.number in (BLACK, BLUE) else BLACK)
    sunk = True if _is_sunk(style.bgcolor) else None
    return style + Style(color=front, bgcolor=behind, underline=sunk)


def _words(color: RichColor | None) -> RichColor | None:
    """The color of text."""
    if color is None or _is_standard(color):
        return color
    bright = _brightness(color)
    if _is_gray(color):
        return RichColor.from_ansi(next(number for most, number in GRAYS if bright <= most))
    number = color.downgrade(ColorSystem.STANDARD).number or 0
    return RichColor.from_ansi(number + 8 if number < 8 and bright >= BRIGHT_FROM else number)


def _ground(color: RichColor | None) -> RichColor | None:
    """The background color: one of the first eight, as some terminals blink with the others."""
    if color is None or _is_standard(color):
        return color
    number = (color.downgrade(ColorSystem.STANDARD).number or 0) % 8
    if _is_gray(color) or number == BLACK:
        number = BLUE if _brightness(color) >= RAISED_FROM else BLACK
    return RichColor.from_ansi(number)


def _is_standard(color: RichColor) -> bool:
    return color.type in (ColorType.DEFAULT, ColorType.STANDARD)


def _is_gray(color: RichColor) -> bool:
    parts = color.get_truecolor()
    return max(parts) - min(parts) < LEAST_DIFFERENCE


def _is_sunk(color: RichColor | None) -> bool:
    return color is not None and not color.is_default and _brightness(color) <= SUNK_TO


def _brightness(color: RichColor) -> float:
    red, green, blue = color.get_truecolor()
    return (0.299 * red + 0.587 * green + 0.114 * blue) / 255


NO_SIGN: Final = "?"
PLAIN_SIGNS: Final = {
    **dict.fromkeys("─╴╶╸╺╌┄", "-"),
    **dict.fromkeys("│╷╵║┆▏▎▍▌▐▕", "|"),
    **dict.fromkeys("┌┐└┘├┤┬┴┼╭╮╯╰", "+"),
    **dict.fromkeys("┏┓┗┛┣┫┥", "+"),
    **dict.fromkeys("━═▔▀▄▅", "="),
    **dict.fromkeys("▁▂▃", "_"),
    **dict.fromkeys("▆▇█▓▒░▚", "#"),
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
    "╱": "/",
    "╲": "\\",
    "◆": "+",
    "┃": "#",
    "⠒": "-",
    "⠂": "=",
    "■": "!",
    "…": "~",
    "µ": "u",
    "Ω": "O",
    "°": "o",
}
"""Drawn characters and their plain substitutes."""


class PlainSigns(LineFilter):
    """Replaces characters that an encoding lacks, one for one."""

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
    """A text with a plain sign for each character that an encoding lacks; its width is kept."""
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
