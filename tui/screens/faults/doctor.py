"""Page of a fault with its causes, values, next steps and history; pure functions."""

from __future__ import annotations

import time

from rich.style import Style
from rich.text import Text

from tui.drive.causes import WeighedCause
from tui.drive.hints import TRUST
from tui.drive.plain import plain
from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import FaultHelp
from tui.session.monitor.fault_record import TRIP_NEAR
from tui.session.shown import Shown
from tui.widgets.drawing import cut, cut_at_word, fitted_names, rule, wrapped
from tui.widgets.palette import (
    ALARM,
    ALARM_BLOCK,
    CURSOR,
    FAINT,
    FAULT,
    FAULT_BLOCK,
    LINE,
    PLAIN,
    STALE,
    STRONG,
    TITLE,
)

from .doctor_view import DoctorView, ValueRow
from .next_steps import check_rows, next_heading, open_row, record_row, reset_rows, written_row
from .parts import ago_text, reading_text
from .quiet import quiet_rows
from .trip_curve import LEAST_ROWS, trip_curve_lines, trip_curve_width
from .view import history_rows, shown_count, stored_text

CODE_WIDTH = 7
TRIP, NOW = "at the trip", "now"
"""Headings of the columns."""
WIDEST_ROW = 90
"""Columns of a row, so that values stay close to their names."""
LEAST_TRIP, LEAST_NOW, MOST = 14, 10, 22
"""Columns of a value."""
BEFORE = "~"
"""Mark of a value that was read before the trip, if the drive has stored none."""


def value_rows(view: DoctorView, width: int) -> list[Text]:
    """Return the heading and a row for each parameter."""
    rows, width = view.rows, min(width, WIDEST_ROW)
    if not rows:
        return []
    trips = [_trip_text(view, row) for row in rows]
    nows = [reading_text(view.value_now(row), view.now) for row in rows]
    trip_width = _column([text for text, _ in trips], LEAST_TRIP)
    now_width = _column([text for text, _ in nows], LEAST_NOW)
    room = max(4, width - 4 - CODE_WIDTH - trip_width - now_width)
    names = fitted_names(tuple(dict.fromkeys(row.why for row in rows)), room)
    lines = [_heading(width, now_width)]
    for number, row in enumerate(rows):
        chosen = number == view.at
        text = Text("  ", no_wrap=True)
        unsure = "" if is_verified(view.profile[row.code]) else "?"
        text.append(row.code, STRONG)
        text.append(f"{unsure:<{max(1, CODE_WIDTH - len(row.code))}}", STALE)
        text.append(f"{names[row.why]:<{room}}", PLAIN if chosen else FAINT)
        for (value, style), cells in ((trips[number], trip_width), (nows[number], now_width)):
            text.append(f"{cut(value, cells - 1).rstrip():>{cells}}", style)
        text.pad_right(width - text.cell_len)
        if chosen:
            text.stylize(CURSOR)
        lines.append(text)
    return lines


def _column(texts: list[str], least: int) -> int:
    return max(least, min(MOST, max(map(len, texts), default=0) + 1))


def _heading(width: int, now: int) -> Text:
    """Return the title on its line, with the names of the columns over their values."""
    text = Text(no_wrap=True)
    text.append("Values ", TITLE)
    text.append("─" * max(0, width - 11 - len(TRIP) - now), LINE)
    text.append(f" {TRIP} ", TITLE)
    text.append("─" * max(0, now - len(NOW) - 2), LINE)
    text.append(f" {NOW}", TITLE)
    text.append(" ──", LINE)
    return text


def _trip_text(view: DoctorView, row: ValueRow) -> tuple[str, Style]:
    """Return the value at the trip: what the drive keeps, else the last one before it."""
    stored = view.value_stored(row)
    if stored is not None and stored.raw is not None:
        return stored_text(stored), PLAIN
    before = view.value_before(row)
    if before is None or before.raw is None or view.record is None:
        return "", FAINT
    return _before_text(before, max(r.time for r in view.record.before.values()))


def _before_text(reading: Shown, last: float) -> tuple[str, Style]:
    text = f"{BEFORE}{reading_text(reading, last)[0]}"
    age = reading.age(last)
    return (text, PLAIN) if age <= TRIP_NEAR else (f"{text} -{age:.0f}s", STALE)


UNDECIDED = "no value decides"
SIGN_WIDTH = 4
"""Columns of the sign before a cause."""
LIKELIEST, OPEN, EXCLUDED = "▸", "?", "×"
"""Sign of a cause: the likeliest or supported by a value, not decided, and ruled out."""
STRUCK = Style(color=FAINT.color, strike=True)


def cause_rows(view: DoctorView, width: int) -> list[list[Text]]:
    """Return the rows of each cause, the likeliest first, under the heading."""
    left = view.advice
    if view.hint is None or left is None:
        return _unweighed(view, width)
    count = len(left.probable)
    reported = f"{count} of {len(left.causes)} left, {TRUST[left.confidence]}"
    heading = [rule("Why", width, reported)]
    if isinstance(view.hint, FaultHelp) and view.hint.name:
        heading.append(Text(cut(f"  {view.hint.name}", width), PLAIN))
    if not count:
        heading.append(Text(cut("  No cause is left: the values rule out each one.", width), ALARM))
    aligned = SIGN_WIDTH + 2 + max(len(cause.text) for cause in left.causes)
    rows = [_rows(cause, not n, aligned, width) for n, cause in enumerate(left.causes)]
    return [heading, *rows]


def _unweighed(view: DoctorView, width: int) -> list[list[Text]]:
    """Return the cause that the profile names, if there is no help on the fault."""
    if view.is_quiet:
        return []
    if view.fault is None and view.profile.data.faults.codes:
        text = "Its code was not read, so its causes are unknown."
    else:
        cause = view.fault.cause if view.fault else ""
        text = cause or view.profile.guide.trouble or "The available manual gives no cause."
    rows = [Text(f"    {part}", PLAIN) for part in wrapped(text, width - SIGN_WIDTH - 1, 3)]
    return [[rule("Why", width)], rows]


def _rows(cause: WeighedCause, first: bool, aligned: int, width: int) -> list[Text]:
    """Return a cause, and its values beside it or, if there is no room, below it."""
    excluded = cause.verdict == "excluded"
    likely = cause.verdict == "supported" or (first and not excluded)
    sign = EXCLUDED if excluded else LIKELIEST if likely else OPEN
    text = Text("  ", no_wrap=True)
    text.append(f"{sign} ", FAINT if excluded else STRONG if likely else ALARM)
    style = STRUCK if excluded else STRONG if first else PLAIN
    text.append(cut(cause.text, min(len(cause.text), width - SIGN_WIDTH)).rstrip(), style)
    aligned = min(aligned, max(width // 2 + SIGN_WIDTH, width - len(UNDECIDED)))
    reason = reason_text(cause)
    if max(aligned, text.cell_len + 2) + len(reason) > width:
        reason = reason_text(cause, 1)
    column = max(aligned, text.cell_len + 2)
    if column + len(reason) > width:
        column = text.cell_len + 2
    if column + len(reason) <= width:
        text.append(" " * (column - text.cell_len))
        text.append(reason, PLAIN if cause.verdict == "supported" else FAINT)
        return [text]
    if cause.verdict == "open":
        return [text]
    parts = wrapped(reason, width - SIGN_WIDTH - 2, 2)
    below = [Text(f"{' ' * (SIGN_WIDTH + 2)}{part}", PLAIN) for part in parts]
    return [text, *below]


def reason_text(cause: WeighedCause, most: int = 2) -> str:
    """Return the values that decided about a cause, `most` of them, or why none did."""
    if cause.verdict == "open":
        unknown = ", ".join(cause.unknown[:2])
        return f"not known: {unknown}" if unknown else UNDECIDED
    texts = [evidence.text for evidence in cause.evidence[:most]]
    text = "; ".join(texts)
    if cause.evidence[0].basis == "now" and cause.verdict == "excluded":
        return f"not now: {text}"
    return f"now {text}" if cause.evidence[0].basis == "now" else text


TIME = "%H:%M:%S"
FEW_ROWS = 12
"""Rows of a place in which one row of the history is enough."""
LEAST_VALUES = 6
"""Rows of values, with their heading, that are kept before causes are shortened."""
TOO_FEW = "Enlarge the terminal to read what a reset does."


def doctor_lines(view: DoctorView, width: int, height: int) -> list[Text]:
    """Return the whole page in at most `height` rows; the least needed rows are left out first.

    The text of a reset is whole or absent: a sentence then asks for a larger terminal.
    """
    lines, values = _page(view, width, height, width)
    if (cells := trip_curve_width(view, width)) and len(values) >= LEAST_ROWS:
        lines, values = _page(view, width, height, width - cells - 1)
        for row, curve in zip(values, trip_curve_lines(view, cells, len(values)), strict=True):
            row.pad_right(1)  # all rows of values have the same width
            row.append_text(curve)
    return lines


def _page(view: DoctorView, width: int, height: int, beside: int) -> tuple[list[Text], list[Text]]:
    """Return the whole page, and of it the rows of values, which have `beside` columns."""
    reset = reset_rows(view, width)
    if len(reset) > height - 1:
        reset = [Text(f"  {cut_at_word(TOO_FEW, max(10, width - 2))}", PLAIN)]
    values: list[Text] = []
    if view.is_quiet:
        parts = [[_headline(view, width)], *quiet_rows(view, width)]
    else:
        values = value_rows(view, beside)
        parts = [[_headline(view, width)], *cause_rows(view, width), values]
        parts += [next_heading(view, width), check_rows(view, width), open_row(view, width)]
        parts += [reset, written_row(view, width), record_row(view, width)]
    least = min(2 if height > FEW_ROWS else 1, max(1, shown_count(view)))
    _shorten(view, parts, sum(map(len, parts)) + least - height)
    lines = [line for part in _spaced(view, parts, height - shown_count(view)) for line in part]
    lines = lines[:height]
    return lines + history_rows(view, width, height - len(lines)), values


def _shorten(view: DoctorView, parts: list[list[Text]], lines: int) -> None:
    """Remove up to `lines` rows, the least needed first; never the first row and the reset."""
    if view.is_quiet:
        for part in reversed(parts[1:]):
            lines -= _removed(part, lines, 1)
        return
    causes, (values, heading, checks, enter, _, written, record) = parts[1:-7], parts[-7:]
    every = list(values)
    lines -= _removed(record, lines, 0)
    lines -= _removed(checks, lines, 1)
    lines -= _scrolled(view, values, every, lines, LEAST_VALUES)
    for cause in reversed(causes[2:]):
        lines -= _removed(cause, lines, 1)
    lines -= _removed(written, lines, 0)
    lines -= _removed(checks, lines, 0)
    lines -= _removed(heading, lines, 0)
    lines -= _scrolled(view, values, every, lines, 3)
    for cause in reversed(causes[2:]):
        lines -= _removed(cause, lines, 0)
    lines -= _removed(enter, lines, 0)
    lines -= _scrolled(view, values, every, lines, 2)
    lines -= _removed(causes[1], lines, 1)
    for part in (values, *reversed(causes)):
        lines -= _removed(part, lines, 0)


def _removed(part: list[Text], lines: int, kept: int) -> int:
    """Remove up to `lines` rows at the end of a part, but keep some; return how many."""
    away = max(0, min(lines, len(part) - kept))
    del part[len(part) - away :]
    return away


def _scrolled(
    view: DoctorView, values: list[Text], every: list[Text], lines: int, kept: int
) -> int:
    """Remove up to `lines` of the values, not the one under the cursor; return how many."""
    away = max(0, min(lines, len(values) - kept))
    count = len(values) - 1 - away
    if away and count > 0:
        top = max(0, view.at - count + 1) if view.at < len(view.rows) else 0
        values[1:] = every[1 + top : 1 + top + count]
    return away


def _spaced(view: DoctorView, parts: list[list[Text]], height: int) -> list[list[Text]]:
    """Return the parts; a quiet page gets an empty row between them if it has the room."""
    left = [part for part in parts if part]
    spare = height - sum(map(len, left))
    if not view.is_quiet or spare < len(left) + 1:
        return left
    return [[Text("")], *(row for part in left for row in (part, [Text("")]))]


def _headline(view: DoctorView, width: int) -> Text:
    fault = view.fault
    text = Text("  ", no_wrap=True)
    if fault is None:
        if view.present:
            unknown = "its code was not read" if view.profile.data.faults.codes else "no number"
            text.append(f" ■ FAULT, {unknown} ", FAULT_BLOCK)
            text.append(f"   {_when_text(view)}", PLAIN)
        elif view.alarm is not None:
            text.append(f" ▲ {plain(view.alarm[2]).upper()} ", ALARM_BLOCK)
            text.append("   alarm, no fault", PLAIN)
            more = len(view.alarms) - 1
            text.append(f"   and {more} more" if more else "", PLAIN)
        else:
            text.append("No fault.", STRONG)
            text.append("   reading the history" if view.unread and view.history else "", FAINT)
        return text
    if view.present:
        text.append(f" ■ {fault.code}  {fault.name.upper()} ", FAULT_BLOCK)
    else:
        text.append(f"{fault.code}  {fault.name}", FAULT)
    room = width - text.cell_len - 4
    text.append(f"   {cut_at_word(_when_text(view), max(1, room))}", PLAIN)
    return text


def _when_text(view: DoctorView) -> str:
    """Return the time of the trip or of the first read, and how long ago it was."""
    record = view.record
    if view.since is not None:
        when, ago = view.since.when, ago_text(view.wall - view.since.wall)
        if record is None and not view.since.tripped:
            when = f"{when} ({ago}); tripped before that"  # that is not the time of the trip
        else:
            when = f"{when}, {ago}"
    elif record is not None:
        tripped = time.strftime(TIME, time.localtime(record.wall))
        when = f"tripped {tripped}, {ago_text(view.wall - record.wall)}"
    elif view.present:
        return "tripped before monitoring began"
    else:
        return "no longer present"
    return when if view.present else f"{when}, no longer present"
