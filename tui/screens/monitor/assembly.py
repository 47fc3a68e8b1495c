"""Rows of all parts of Monitor; pure functions of a view."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.widgets.drawing import rule, wrapped
from tui.widgets.palette import ALARM, ATTENTION, FAINT, KEY, PLAIN

from .arrange import WIDE_VALUE_COLUMN, Arrangement
from .curves import curve_lines
from .motor import motor_lines, other_values
from .readouts import framed, readout_lines
from .state import state_lines
from .view import View
from .words import (
    WordPage,
    alarm_line,
    bit_columns,
    bit_grid,
    bit_lines,
    has_alarm,
    shown_words,
    word_line,
    word_pages,
)

NOTICE_ROWS = 2
HELD = 0.9
"""Least share of the requested poll rate that counts as reached."""


def notice_lines(view: View, width: int) -> list[Text]:
    """Return the most important notice in at most two rows.

    The list is empty without a notice, in a fault, and while values are not current.
    """
    if view.snapshot is None or view.lost or view.snapshot.state.kind == "fault":
        return []
    control = view.control
    no_effect = f"No effect. {control.hindrance.sentence}" if control.hindrance else ""
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
    """Return the poll rate in cycles per second, and the block that carries the values."""
    rate = view.snapshot.rate if view.snapshot and not view.lost else 0.0
    wished = 1 / view.period
    held = rate > HELD * wished or not rate
    block = view.snapshot.block.lower() if view.snapshot is not None else ""
    cycles = figures = f"{rate:.1f} of {wished:.1f} cycles/s"
    if block:
        figures = f"{cycles} by {block}"
    text = Text(f"{figures} ", FAINT, no_wrap=True)
    if not held:
        text.stylize(ALARM, 0, len(cycles))
    return text


Parts = dict[str, list[Text]]
WORD_WIDTH = 30
"""Least cells of each table of bits, if several are side by side."""
NEXT_CELLS = 12
WordTable = tuple[WordPage, ...]
"""Pages of bits that Tab shows together; empty for the table of all values."""


def monitor_parts(view: View, room: Arrangement, words: Sequence[Parameter]) -> Parts:
    """Return the rows of each part, by its widget ID.

    Each part has exactly its number of rows; a notice may add some to the message.
    """
    lead = [Text("")] * room.lead
    readouts = readout_lines(view, room.width - room.state_width - 1, wide=room.third)
    return {
        "readouts": lead + readouts,
        "state": lead + framed_state(view, room.state_width),
        "motor": motor_lines(view, room.width, room.values, room.columns, wide=room.third),
        "curve": curve_or_table(view, room, words),
        "message": bottom_lines(view, room, words),
    }


def framed_state(view: View, width: int) -> list[Text]:
    """Return the framed state block, with the line's answers in its lower edge."""
    head, *rows = state_lines(view, width - 4)
    right = Text(" ").append_text(head).append(" ")
    title = Text(" State ", FAINT)
    if title.cell_len + right.cell_len > width - 2:  # the state itself is never left out
        title = Text("")
        right.truncate(width - 2, overflow="ellipsis")
    padded = [Text(" ").append_text(row).append(" ") for row in rows]
    return framed(title, right, padded[:3], padded[3], width)


def curve_or_table(view: View, room: Arrangement, words: Sequence[Parameter]) -> list[Text]:
    """Return the curve, or the table that Tab shows instead."""
    found = tables(view.profile, room, words)
    if view.word is None or view.word >= len(found):
        return curve_lines(view, room)
    return _table_lines(view, room, found[view.word])


def tables(profile: Profile, room: Arrangement, words: Sequence[Parameter]) -> list[WordTable]:
    """Return the tables in the order of Tab; all values are first if some do not fit above."""
    values = other_values(profile, wide=room.third)
    found: list[WordTable] = [()] if len(values) > room.values * room.columns else []
    if not room.wide:
        most = bit_columns(room.width - 1) * (room.curve - 1)
        return found + [(page,) for page in word_pages(words, most)]
    pages, many = word_pages(words, room.curve - 1), room.width // WORD_WIDTH
    return found + [tuple(pages[at : at + many]) for at in range(0, len(pages), many)]


def _table_lines(view: View, room: Arrangement, table: WordTable) -> list[Text]:
    """Return a table in exactly the rows of the curve."""
    width = room.width - 1
    following = Text.assemble(("  Tab", KEY), (" next", FAINT))
    if not table:
        columns = max(1, width // WIDE_VALUE_COLUMN)
        rows = -(-len(other_values(view.profile, wide=room.third)) // columns)
        heading = Text(" ").append_text(rule("All values", width - NEXT_CELLS))
        lines = motor_lines(view, width, min(rows, room.curve - 1), columns, wide=room.third)
        rest = [Text("")] * (room.curve - 1 - len(lines))
        return [heading.append_text(following), *lines, *rest]
    if len(table) == 1 and not room.wide:
        return bit_grid(view, table[0], width, room.curve)
    cells = width // len(table) - 1
    parts = [bit_lines(view, page, cells) for page in table]
    lines = [Text(no_wrap=True) for _ in range(room.curve)]
    for part in parts:
        for line, row in zip(lines, [*part, *[Text("")] * room.curve], strict=False):
            line.append_text(row).append(" " * (cells + 1 - row.cell_len))
    return lines


def bottom_lines(view: View, room: Arrangement, words: Sequence[Parameter]) -> list[Text]:
    """Return notices, the set bits of up to two words, and the alarms in the last row.

    If there is one row, notices and an alarm still get rows of their own; words get none.
    """
    notices = notice_lines(view, room.width)
    figures = line_figures(view) if room.wide else Text("")
    last = alarm_line(view, room.width - figures.cell_len - 1, tab=True)
    last.append(" ").append_text(figures)
    texts = notices + [word_line(view, word, room.width - 1) for word in shown_words(words)]
    if room.bottom == 1:
        return [*notices, last] if has_alarm(view) else notices or texts[:1] or [last]
    space = max(room.bottom - 1, len(notices))
    texts = texts[:space]
    return [*texts, *[Text("")] * (space - len(texts)), last]


def watched_words(profile: Profile) -> list[Parameter]:
    """Return the words with named bits: the status word, the monitoring set's, inputs, outputs."""
    watched = [profile[v.parameter] for v in profile.data.monitoring.values]
    found = [parameter for parameter in watched if parameter.bits]
    for quantity in ("digital_inputs", "digital_outputs"):
        parameter = profile.quantity(quantity)
        if parameter is not None and parameter.bits and parameter not in found:
            found.append(parameter)
    return sorted(found, key=lambda p: p.quantity != "status_word")


def codes_beside(profile: Profile) -> list[str]:
    """Return the codes to read slowly: ends of bars, channels, and words with named bits."""
    codes = [v.high for v in profile.data.monitoring.values if profile.get(v.high)]
    for quantity in ("command_channel", "reference_channel"):
        parameter = profile.quantity(quantity)
        if parameter is not None:
            codes.append(parameter.code)
    codes += [parameter.code for parameter in watched_words(profile)]
    return list(dict.fromkeys(codes))
