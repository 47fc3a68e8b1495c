"""Words with named bits, as rows of true texts or as tables; pure functions of a view."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

from rich.style import Style
from rich.text import Text

from tui.drive.bit_texts import bit_text, is_true, is_valid, short_bit, true_bits
from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import Bit, Parameter
from tui.drive.values import NOT_AVAILABLE
from tui.widgets.drawing import cut, rule
from tui.widgets.palette import ALARM, BAR, FAINT, KEY, LINE, PLAIN, STRONG

from .view import View

CODE_CELLS, RAW_CELLS = 6, 9
BIT_CELLS = 26
"""Least cells of a bit if bits are in columns."""
ALL_BITS = (("Tab", KEY), (" all bits ", FAINT))
NEXT_BITS = (("Tab", KEY), (" next     ", FAINT))
ALL_BITS_CELLS = 13


@dataclass(frozen=True, slots=True)
class WordPage:
    """Bits of a word that are shown together, as page `number` of `of`."""

    parameter: Parameter
    bits: tuple[Bit, ...]
    number: int
    of: int


def shown_words(view_words: Sequence[Parameter]) -> list[Parameter]:
    """Return at most two words for the bottom rows: those with more than alarm bits."""
    return [word for word in view_words if not all(bit.alarm for bit in word.bits)][:2]


def word_line(view: View, parameter: Parameter, width: int) -> Text:
    """Return a word with its true bit texts, and the count of those that do not fit."""
    raw, shown = _raw(view, parameter)
    mark = "" if is_verified(parameter) else " ?"
    text = Text(f"  {cut(parameter.code + mark, CODE_CELLS)}", FAINT, no_wrap=True)
    text.append(f"{shown:<{RAW_CELLS}}", FAINT)
    reported = [] if raw is None else list(_true_words(parameter, raw))
    for at, (name, alarm) in enumerate(reported):
        more = len(reported) - at
        if text.cell_len + len(name) + 4 + (5 if more > 1 else 0) > width:
            text.append(f" … {more}", FAINT)
            break
        text.append("  " if at else " ").append("● ", ALARM if alarm else BAR)
        text.append(name, ALARM if alarm else PLAIN)
    return text


def _true_words(parameter: Parameter, raw: int) -> Iterator[tuple[str, bool]]:
    """Yield each true bit text in short form, and True if it is an alarm."""
    for bit, on in true_bits(parameter.bits, raw):
        if words := short_bit(bit, on=on):
            yield words, on and bit.alarm


def alarm_line(view: View, width: int, *, tab: bool) -> Text:
    """Return the present alarms and, if `tab`, the key that shows all bits."""
    text = Text(f"  {'Alarms':<{CODE_CELLS + RAW_CELLS}} ", FAINT, no_wrap=True)
    message, style = _alarms(view)
    room = width - text.cell_len - (ALL_BITS_CELLS if tab else 1)
    text.append(cut(message, max(1, room)), style)
    if tab:
        text.append_text(Text.assemble(*(ALL_BITS if view.word is None else NEXT_BITS)))
    return text


def _alarms(view: View) -> tuple[str, Style]:
    if view.snapshot is None or view.lost:
        return NOT_AVAILABLE, FAINT
    state = view.snapshot.state
    if state.alarms:
        return ", ".join(bit.name for bit in state.alarms), ALARM
    if state.alarm:
        return "shown by the status word", ALARM
    watched = [view.profile[value.parameter] for value in view.values]
    tells = state.alarm is not None or any(bit.alarm for word in watched for bit in word.bits)
    return ("none" if tells else "not reported by this drive"), FAINT


def has_alarm(view: View) -> bool:
    """Return True if the drive's current values contain an alarm."""
    if view.snapshot is None or view.lost:
        return False
    return bool(view.snapshot.state.alarms or view.snapshot.state.alarm)


def word_pages(words: Sequence[Parameter], room: int) -> list[WordPage]:
    """Return the words in pages of at most `room` bits."""
    pages: list[WordPage] = []
    room = max(1, room)
    for parameter in words:
        bits = parameter.bits
        chunks = [tuple(bits[at : at + room]) for at in range(0, len(bits), room)]
        pages += [WordPage(parameter, c, n, len(chunks)) for n, c in enumerate(chunks, start=1)]
    return pages


def bit_columns(width: int) -> int:
    """Return the number of columns of bits that fit in `width` cells."""
    return max(1, (width - 1) // BIT_CELLS)


def bit_grid(view: View, page: WordPage, width: int, height: int) -> list[Text]:
    """Return a word with its bits in columns below a heading, in exactly `height` rows.

    There are no more columns than the bits need, so that each name has as much room as possible.
    """
    raw, _ = _raw(view, page.parameter)
    columns = max(1, min(bit_columns(width), -(-len(page.bits) // max(1, height - 1))))
    cells, rows = (width - 1) // columns, height - 1
    lines = [Text(" ", no_wrap=True) for _ in range(rows)]
    filled = -(-len(page.bits) // columns)
    for at, bit in enumerate(page.bits):
        lines[at % filled].append_text(_bit_line(bit, raw, cells))
    heading = Text(" ", no_wrap=True).append_text(_heading(view, page, width - 14))
    heading.append("  ")
    heading.append_text(Text.assemble(("Tab", KEY), (" next", FAINT)))
    return [heading, *lines]


def bit_lines(view: View, page: WordPage, width: int) -> list[Text]:
    """Return the heading of a word, and a row for each bit of the page."""
    raw, _ = _raw(view, page.parameter)
    return [_heading(view, page, width), *(_bit_line(bit, raw, width) for bit in page.bits)]


def _raw(view: View, parameter: Parameter) -> tuple[int | None, str]:
    """Return the current raw value of a word and its text; None and dashes if unknown."""
    reading = view.reading(parameter.code)
    none: tuple[int | None, str] = (None, NOT_AVAILABLE)
    if reading is None:
        return none
    return reading.drawn(
        view.now,
        current=lambda value: (value.raw, value.text),
        old=lambda value, age: none,
        missing=none,
    )


def _heading(view: View, page: WordPage, width: int) -> Text:
    parameter = page.parameter
    heading = parameter.code + ("" if is_verified(parameter) else " ?")
    if page.of > 1:
        heading += f" {page.number}/{page.of}"
    if width > len(heading) + len(parameter.name) + 20:
        heading += f" {parameter.name}"
    return rule(heading, width, _raw(view, parameter)[1])


def _bit_line(bit: Bit, raw: int | None, width: int) -> Text:
    """Return a bit in exactly `width` cells. The text is cached: copy it before changing it."""
    if raw is not None and not is_valid(bit, raw):
        return _dim_bit(bit, width)
    return _drawn_bit(bit, None if raw is None else bool(raw >> bit.bit & 1), width)


@lru_cache(maxsize=128)
def _dim_bit(bit: Bit, width: int) -> Text:
    """Return a bit that is not valid in this state: its name without its value."""
    text = Text(f" {bit.bit:>2} ", LINE, no_wrap=True).append("·", FAINT)
    return text.append(f" {cut(bit.name, width - 7)} ", FAINT)


@lru_cache(maxsize=1024)
def _drawn_bit(bit: Bit, on: bool | None, width: int) -> Text:
    text = Text(no_wrap=True)
    text.append(f" {bit.bit:>2} ", LINE)
    room = width - 7
    if on is None:
        return text.append(f"  {cut(bit.name, room)} ", FAINT)
    true = is_true(bit, on)
    alarm = on and bit.alarm
    text.append("●" if true else "·", ALARM if alarm else STRONG if true else FAINT)
    return text.append(f" {cut(bit_text(bit, on, room), room)} ", PLAIN if true else FAINT)
