"""Words with named bits; pure functions of a view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.text import Text

from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import Bit, Parameter
from tui.drive.values import NOT_AVAILABLE
from tui.session.reading import Quality
from tui.widgets.drawing import cut, rule
from tui.widgets.palette import ALARM, FAINT, LINE, PLAIN, STRONG

from .view import View


@dataclass(frozen=True, slots=True)
class WordPage:
    """Bits of a word that are shown together."""

    parameter: Parameter
    bits: tuple[Bit, ...]
    number: int
    of: int


def word_pages(words: Sequence[Parameter], room: int) -> list[WordPage]:
    """The words in pages of at most so many bits."""
    pages: list[WordPage] = []
    for parameter in words:
        bits = parameter.bits
        chunks = [tuple(bits[at : at + room]) for at in range(0, len(bits), max(1, room))]
        pages += [WordPage(parameter, c, n, len(chunks)) for n, c in enumerate(chunks, start=1)]
    return pages


def bit_lines(view: View, page: WordPage, width: int) -> list[Text]:
    """Named bits of a word, each at its place, with the word itself."""
    parameter = page.parameter
    reading = view.reading(parameter.code)
    good = reading is not None and reading.raw is not None and reading.quality is Quality.GOOD
    raw = reading.raw if good and reading is not None else None
    heading = parameter.code + ("" if is_verified(parameter) else " ?")
    if page.of > 1:
        heading += f" {page.number}/{page.of}"
    shown = reading.text if reading is not None and raw is not None else NOT_AVAILABLE
    lines = [rule(heading, width, shown)]
    return lines + [_bit_line(bit, raw, width) for bit in page.bits]


def _bit_line(bit: Bit, raw: int | None, width: int) -> Text:
    text = Text(no_wrap=True)
    text.append(f" {bit.bit:>2} ", LINE)
    room = width - 7
    if raw is None:
        text.append(f"  {cut(bit.name, room)}", FAINT)
        return text
    on = bool(raw >> bit.bit & 1)
    text.append("●" if on else "·", ALARM if on and bit.alarm else STRONG if on else FAINT)
    text.append(f" {cut(_bit_words(bit, on, room), room)}", PLAIN if on else FAINT)
    return text


SHORTEST_NAME = 6
"""Characters of a bit's name that still tell which one it is."""
PLAIN_ANSWERS = frozenset({"", "yes", "no", "on", "off", "none", "normal", "0", "1"})


def _bit_words(bit: Bit, on: bool, room: int) -> str:
    """The name of a bit; what it says as well, where that is more than yes or no and fits."""
    said = bit.on if on else bit.off
    if said.lower() in PLAIN_ANSWERS:
        return bit.name
    if said.casefold() in bit.name.casefold():
        return bit.name
    alone = said[:1].upper() + said[1:]
    if bit.name.casefold() in said.casefold():
        return alone
    both = f"{bit.name}: {said}"
    if len(both) <= room:
        return both
    left = room - len(said) - 3
    if " " in said or left < SHORTEST_NAME:
        return alone
    return f"{bit.name[:left].rstrip()}…: {said}"
