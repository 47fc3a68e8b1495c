"""Words with named bits, as rows of true texts or as tables; pure functions of a view."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from rich.style import Style
from rich.text import Text

from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import Bit, Parameter
from tui.drive.sentences import capitalized, uncapitalized
from tui.drive.values import NOT_AVAILABLE
from tui.widgets.drawing import cut, rule
from tui.widgets.palette import ALARM, BAR, FAINT, KEY, LINE, PLAIN, STRONG

from .view import View

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
}
"""Short forms of bit texts, by the text in lower case; empty for the normal state."""
CODE_CELLS, RAW_CELLS = 6, 9
BIT_CELLS = 26
"""Least cells of a bit if bits are in columns."""
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
    for bit in parameter.bits:
        on = bool(raw >> bit.bit & 1)
        if _counts(bit, raw) and _holds(bit, on) and (words := short_bit(bit, on=on)):
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


def short_bit(bit: Bit, *, on: bool) -> str:
    """Return a bit's text in a word or two; empty for the normal state."""
    message = bit.name if on and bit.on.casefold() in GENERIC else _bit_words(bit, on, 60)
    for words in (message.casefold(), *([bit.name.casefold()] if on else [])):
        if words in SHORT_NAMES:
            return SHORT_NAMES[words]
    return uncapitalized(message)


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
    if raw is not None and not _counts(bit, raw):
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
    true = _holds(bit, on)
    alarm = on and bit.alarm
    text.append("●" if true else "·", ALARM if alarm else STRONG if true else FAINT)
    return text.append(f" {cut(_bit_words(bit, on, room), room)} ", PLAIN if true else FAINT)


def _counts(bit: Bit, raw: int) -> bool:
    """Return True if the bit is valid in the state that its word shows."""
    return bit.counts is None or raw & bit.counts.mask == bit.counts.value


def _holds(bit: Bit, on: bool) -> bool:
    """Return True if the drawn text is true now; a bit that is 0 may state a fact too."""
    if (bit.on if on else bit.off).casefold() not in PLAIN_ANSWERS:
        return True
    return on or _denied_at_1(bit)


def _denied_at_1(bit: Bit) -> bool:
    """Return True if the name alone would be wrong at 1 and right at 0."""
    on, off = bit.on.casefold(), bit.off.casefold()
    return on in DENIALS or (off in PLAIN_ANSWERS - DENIALS and off != "")


def _bit_words(bit: Bit, on: bool, room: int) -> str:
    """Return the name of a bit, its text, or both if they fit in `room` cells.

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
