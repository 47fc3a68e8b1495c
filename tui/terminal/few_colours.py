"""Colours for terminals that have sixteen, or none: the same state, told by what there is.

Without colours what has a colour behind it is shown in reverse, and what is bold stays so; words
and signs tell the state in any case.
"""

from __future__ import annotations

from functools import lru_cache

from rich.color import Color as RichColor
from rich.color import ColorSystem, ColorType
from rich.segment import Segment
from rich.style import Style
from textual.color import Color
from textual.filter import LineFilter

RAISED_FROM = 0.21
"""Brightness of a background, from 0 to 1, that is no part of the calm ground any more."""

SUNK_TO = 0.09
"""Brightness up to which a background is darker than the ground: a field to type in."""

BRIGHT_FROM = 0.5
"""Brightness from which a colour of words is one of the brighter eight."""

BLACK, BLUE, WHITE = 0, 4, 15

LEAST_DIFFERENCE = 60
"""Difference between the strongest and the weakest part of a colour, of 255, that is no grey."""

GREYS: tuple[tuple[float, int], ...] = ((0.25, 0), (0.42, 8), (0.75, 7), (1.01, 15))
"""Up to which brightness a grey is which of the sixteen: ground, rules, words, what stands out."""


class NoColours(LineFilter):
    """Attributes instead of colours."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """The same line without a colour."""
        return [
            Segment(text, without_colours(style) if style else None, control)
            for text, style, control in segments
        ]


class SixteenColours(LineFilter):
    """The sixteen colours that every colour terminal has."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """The same line in sixteen colours."""
        return [
            Segment(text, in_sixteen(style) if style else None, control)
            for text, style, control in segments
        ]


@lru_cache(maxsize=1024)
def without_colours(style: Style) -> Style:
    """Bold, underlined and reversed, for what was coloured."""
    behind = style.bgcolor
    coloured = behind is not None and _brightness(behind) >= RAISED_FROM
    return Style(
        bold=style.bold or None,
        underline=(style.underline or _is_sunk(behind)) or None,
        reverse=(bool(style.reverse) != coloured) or None,
        meta=style.meta or None,
    )


@lru_cache(maxsize=1024)
def in_sixteen(style: Style) -> Style:
    """The style with the nearest of sixteen colours; words are never of the colour behind them."""
    front, behind = _words(style.color), _ground(style.bgcolor)
    if front is not None and behind is not None and front.number == behind.number:
        front = RichColor.from_ansi(WHITE if behind.number in (BLACK, BLUE) else BLACK)
    sunk = True if _is_sunk(style.bgcolor) else None
    return style + Style(color=front, bgcolor=behind, underline=sunk)


def _words(colour: RichColor | None) -> RichColor | None:
    """The colour of words."""
    if colour is None or _is_one_of_them(colour):
        return colour
    bright = _brightness(colour)
    if _is_grey(colour):
        return RichColor.from_ansi(next(number for most, number in GREYS if bright <= most))
    number = colour.downgrade(ColorSystem.STANDARD).number or 0
    return RichColor.from_ansi(number + 8 if number < 8 and bright >= BRIGHT_FROM else number)


def _ground(colour: RichColor | None) -> RichColor | None:
    """The colour behind words: one of the first eight, as terminals blink with the others."""
    if colour is None or _is_one_of_them(colour):
        return colour
    number = (colour.downgrade(ColorSystem.STANDARD).number or 0) % 8
    if _is_grey(colour) or number == BLACK:
        number = BLUE if _brightness(colour) >= RAISED_FROM else BLACK
    return RichColor.from_ansi(number)


def _is_one_of_them(colour: RichColor) -> bool:
    return colour.type in (ColorType.DEFAULT, ColorType.STANDARD)


def _is_grey(colour: RichColor) -> bool:
    parts = colour.get_truecolor()
    return max(parts) - min(parts) < LEAST_DIFFERENCE


def _is_sunk(colour: RichColor | None) -> bool:
    return colour is not None and not colour.is_default and _brightness(colour) <= SUNK_TO


def _brightness(colour: RichColor) -> float:
    red, green, blue = colour.get_truecolor()
    return (0.299 * red + 0.587 * green + 0.114 * blue) / 255
