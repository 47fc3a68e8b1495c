"""All lines of Monitor, by their place; pure functions of a view."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.widgets.drawing import wrapped
from tui.widgets.palette import ALARM, ATTENTION, FAINT, PLAIN

from .arrange import WORD_WIDTH, Arrangement
from .motor import motor_lines
from .readouts import plain_lines, readout_lines
from .state import state_lines
from .trends import trend_lines
from .view import View
from .words import (
    WordPage,
    alarm_line,
    bit_columns,
    bit_grid,
    bit_lines,
    shown_words,
    word_line,
    word_pages,
)

NOTICE_ROWS = 2
HELD = 0.9
"""Share of the wished rate from which on it counts as held."""


def notice_lines(view: View, width: int) -> list[Text]:
    """The one notice that matters most now, on at most two lines; none while there is nothing."""
    if view.snapshot is None or view.lost or view.snapshot.state.kind == "fault":
        return []
    control = view.control
    no_effect = f"No effect: {control.hindrance.sentence}" if control.hindrance else ""
    for message, style in (
        (control.offer, ATTENTION),
        (control.lost, ALARM),
        (control.why_disarmed, ATTENTION),
        (no_effect, PLAIN),
    ):
        if message:
            return [Text(f"  {line}", style) for line in wrapped(message, width - 4, NOTICE_ROWS)]
    return []


def line_figures(view: View) -> Text:
    """Return the read rate of the drive and the line's share of good replies."""
    rate = view.snapshot.rate if view.snapshot and not view.lost else 0.0
    wished = 1 / view.period
    held = rate > HELD * wished or not rate
    text = Text(f"{rate:.1f} of {wished:.1f} cycles/s", FAINT if held else ALARM, no_wrap=True)
    if view.snapshot is not None and view.snapshot.block:
        text.append(f" by {view.snapshot.block.lower()}", FAINT)
    counts = view.counters
    failed = counts.timeouts + counts.checksum + counts.wrong
    return text.append(f", {counts.requests} requests, {failed} failed ", FAINT)


Parts = dict[str, list[Text]]
WORDS_MOST = 6


def monitor_parts(view: View, room: Arrangement, words: Sequence[Parameter]) -> Parts:
    """Return the lines of each place, in exactly its number of rows."""
    lead = [Text("")] * room.lead
    big = room.width - room.state_width - 2
    state = state_lines(view, room.state_width)
    if room.big:
        parts = {"readouts": lead + readout_lines(view, big), "state": lead + state}
    else:
        both = [Text(f" {line.plain}", line.style) if not line.spans else line for line in state]
        parts = {"readouts": plain_lines(view, room.width)[: room.top], "state": both}
    gap = [Text("")] * int(room.values > 1)
    rows = max(0, room.values - len(gap))
    parts["motor"] = gap + (motor_lines(view, room.width, rows, room.columns) if rows else [])
    parts["trend"] = _trend_or_word(view, room, words)
    parts["message"] = bottom_lines(view, room, words)
    return parts | _side_by_side(view, room, words)


def word_parts(view: View, room: Arrangement, words: Sequence[Parameter]) -> Parts:
    """Return the parts that change with the chosen word: the words side by side, or the trend's
    place."""
    if room.wide:
        return _side_by_side(view, room, words)
    return {"trend": _trend_or_word(view, room, words)}


def _trend_or_word(view: View, room: Arrangement, words: Sequence[Parameter]) -> list[Text]:
    """The trend, or in its place the chosen word with all its bits."""
    if not room.trend:
        return []
    page = None if room.wide else chosen_page(view, room, words)
    if page is None:
        return [Text(""), *trend_lines(view, room.width - 1, room.trend - 1)]
    return bit_grid(view, page, room.width - 1, room.trend)


def pages_in(room: Arrangement, words: Sequence[Parameter]) -> list[WordPage]:
    """The words in pages as large as the place of the trend."""
    return word_pages(words, bit_columns(room.width - 1) * max(1, room.trend - 1))


def chosen_page(view: View, room: Arrangement, words: Sequence[Parameter]) -> WordPage | None:
    """The page that is shown in place of the trend; behind the last one comes the trend."""
    pages = pages_in(room, words)
    if view.word is None or not pages:
        return None
    at = view.word % (len(pages) + 1)
    return pages[at] if at < len(pages) else None


def bottom_lines(view: View, room: Arrangement, words: Sequence[Parameter]) -> list[Text]:
    """Notices, words in a line each, the alarms; what is lowest is dropped last."""
    if not room.bottom:
        return []
    notices = notice_lines(view, room.width)
    last = alarm_line(view, room.width, tab=bool(words) and not room.wide and room.trend > 0)
    if room.wide:
        figures = line_figures(view)
        last = alarm_line(view, room.width - figures.cell_len - 1, tab=False)
        last.append(" ")
        last.append_text(figures)
        lines = notices
    else:
        lines = [*notices, *(word_line(view, word, room.width - 1) for word in shown_words(words))]
    space = room.bottom - 1
    lines = lines[:space]
    return [*[Text("")] * (space - len(lines)), *lines, last]


def _side_by_side(view: View, room: Arrangement, words: Sequence[Parameter]) -> Parts:
    """As many words as there is room for, with all their bits, from the chosen one on."""
    parts: Parts = {f"word{index}": [] for index in range(WORDS_MOST)}
    if not room.words:
        return parts
    lead = [Text("")] * room.lead
    pages = word_pages(words, room.words - room.lead - 1)
    many = min(WORDS_MOST, room.width // (WORD_WIDTH + 1))
    for index in range(min(many, len(pages))):
        page = pages[((view.word or 0) + index) % len(pages)]
        parts[f"word{index}"] = [*lead, *bit_lines(view, page, room.width // many - 1)]
    return parts


def watched_words(profile: Profile) -> list[Parameter]:
    """Words with named bits: the monitoring set's, then inputs and outputs."""
    watched = [profile[v.parameter] for v in profile.data.monitoring.values]
    found = [parameter for parameter in watched if parameter.bits]
    for quantity in ("digital_inputs", "digital_outputs"):
        parameter = profile.quantity(quantity)
        if parameter is not None and parameter.bits and parameter not in found:
            found.append(parameter)
    return sorted(found, key=lambda p: p.quantity != "status_word")


def codes_beside(profile: Profile) -> list[str]:
    """Return the slowly read codes: ends of bars, channels, inputs and outputs."""
    codes = [v.high for v in profile.data.monitoring.values if profile.get(v.high)]
    for quantity in ("command_channel", "reference_channel"):
        parameter = profile.quantity(quantity)
        if parameter is not None:
            codes.append(parameter.code)
    codes += [parameter.code for parameter in watched_words(profile)]
    return list(dict.fromkeys(codes))
