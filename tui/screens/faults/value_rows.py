"""Rows of values at the trip and now, in two columns; pure functions."""

from __future__ import annotations

from rich.style import Style
from rich.text import Text

from tui.drive.profile.profile import is_verified
from tui.session.monitor.fault_record import TRIP_NEAR
from tui.session.shown import Shown
from tui.widgets.drawing import cut, fitted_names
from tui.widgets.palette import CURSOR, FAINT, LINE, PLAIN, STALE, STRONG, TITLE

from .doctor_view import DoctorView, ValueRow
from .parts import reading_text
from .view import stored_text

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
