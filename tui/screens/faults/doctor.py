"""Page of a fault with its causes, values, next steps and history; pure functions."""

from __future__ import annotations

import time

from rich.text import Text

from tui.drive.plain import plain
from tui.widgets.drawing import cut_at_word
from tui.widgets.palette import ALARM_BLOCK, FAINT, FAULT, FAULT_BLOCK, PLAIN, STRONG

from .cause_rows import cause_rows
from .doctor_view import DoctorView
from .history import history_rows, shown_count
from .next_steps import (
    check_rows,
    next_heading,
    open_row,
    record_row,
    reset_rows,
    written_row,
)
from .parts import ago_text
from .quiet import quiet_rows
from .trip_curve import LEAST_ROWS, trip_curve_lines, trip_curve_width
from .value_rows import value_rows

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
    record, wall = view.record, None
    if view.since is not None:
        when, wall = view.since.when, view.since.wall
        if record is None and not view.since.tripped:
            when = f"{when}, tripped earlier"
    elif record is not None:
        when, wall = f"tripped {time.strftime(TIME, time.localtime(record.wall))}", record.wall
    elif view.present:
        return "tripped before monitoring began"
    else:
        return "no longer present"
    ago = ago_text(view.wall - wall)
    return f"{when}, {ago}" if view.present else f"{when}, {ago}, no longer present"
