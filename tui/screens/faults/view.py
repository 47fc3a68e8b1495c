"""Rows of the history of faults, of stored values, and of the seconds before a trip; pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime

from rich.text import Text

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.sentences import counted
from tui.drive.values import NOT_AVAILABLE
from tui.session.journal import Entry
from tui.session.monitor.fault_record import FaultRecord, Moment
from tui.session.shown import Shown
from tui.widgets.drawing import fitted_names, rule, short
from tui.widgets.palette import ALARM, ATTENTION, CURSOR, FAINT, PLAIN, STRONG

from .doctor_view import DoctorView
from .parts import LABEL, labelled

RECORD_VALUE_WIDTH = 9
FAULT_TIME_WIDTH = 8


def stored_lines(
    profile: Profile, codes: Sequence[str], readings: Mapping[str, Shown], width: int
) -> list[Text]:
    """Return the values that the drive stored at the moment of a fault."""
    if not codes:
        return [Text(" The drive stores nothing about this fault.", FAINT)]
    known = [profile[code] for code in codes if profile.get(code) is not None]
    values = [stored_text(readings.get(parameter.code)) for parameter in known]
    longest = max(map(len, values), default=0)
    room = max(8, width - longest - 8)
    names = fitted_names(tuple(map(_stored_name, known)), room)
    return [
        _stored_line(
            parameter,
            f"{names[_stored_name(parameter)]:<{room}}",
            f"{value:>{longest}}",
            held=(reading := readings.get(parameter.code)) is not None and reading.raw is not None,
        )
        for parameter, value in zip(known, values, strict=True)
    ]


def _stored_name(parameter: Parameter) -> str:
    """Return a name without the words that all stored values share."""
    return parameter.name.removesuffix(" before the last fault").removesuffix(", last fault")


def _stored_line(parameter: Parameter, name: str, value: str, *, held: bool) -> Text:
    """Return the row of a stored value; it is dim if it was not read."""
    text = Text(f" {parameter.code:<5} ", FAINT, no_wrap=True)
    text.append(name, FAINT)
    text.append(f" {value}", STRONG if held else FAINT)
    return text


def stored_text(reading: Shown | None) -> str:
    """Return the text of a stored value, which never ages: it belongs to the fault's moment."""
    if reading is None:
        return NOT_AVAILABLE
    return reading.drawn(
        reading.time,
        current=lambda value: f"{value.text} {value.unit}".rstrip(),
        old=lambda value, age: f"{value.text} {value.unit}".rstrip(),
        missing=f"{NOT_AVAILABLE} {reading.parameter.unit}".rstrip(),
    )


def record_lines(record: FaultRecord | None, width: int, height: int, offset: int) -> list[Text]:
    """Return the values and writes before the trip, newest first, from row `offset` on."""
    if record is None:
        return [
            rule("Before the trip", width),
            Text(" No trip since monitoring of this drive began.", FAINT),
        ]
    cycles = len(record.moments)
    title = counted(
        len(record.writes),
        "Before the trip: {cycles} cycles, 1 write by Drive Panel",
        "Before the trip: {cycles} cycles, {count} writes by Drive Panel",
        cycles=cycles,
    )
    if not record.writes:
        title = f"Before the trip: {cycles} cycles"
    head = Text(f" {'s':>{FAULT_TIME_WIDTH - 1}}", FAINT, no_wrap=True)
    for heading, cells in zip(record.headings, _columns(record, width), strict=False):
        head.append(f"{short(heading, cells - 1):>{cells}}", FAINT)
    rows = record_rows(record, width)
    return [rule(title, width), head, *rows[offset : offset + max(1, height - 2)]]


def record_rows(record: FaultRecord, width: int) -> list[Text]:
    """Return a row for each cycle and each write, newest first."""
    columns = _columns(record, width)
    rows = [(moment.wall, _moment(moment, record, columns)) for moment in record.moments]
    for entry in record.writes:
        wall = datetime.fromisoformat(entry.time).timestamp()
        rows.append((wall, _write(entry, wall - record.wall, width)))
    return [text for _, text in sorted(rows, key=lambda row: -row[0])]


def _columns(record: FaultRecord, width: int) -> list[int]:
    """Return the cells of the columns that fit, each as wide as its longest value; one at least."""
    found: list[int] = []
    room = width - FAULT_TIME_WIDTH - 1
    for texts in zip(record.headings, *(m.texts for m in record.moments), strict=False):
        cells = max(RECORD_VALUE_WIDTH, 1 + max(map(len, texts)))
        if found and sum(found) + cells > room:
            break
        found.append(min(cells, room))
    return found


def _moment(moment: Moment, record: FaultRecord, columns: Sequence[int]) -> Text:
    after = moment.wall - record.wall
    text = Text(f" {after:>{FAULT_TIME_WIDTH - 1}.1f}", FAINT, no_wrap=True)
    for value, cells in zip(moment.texts, columns, strict=False):
        text.append(f"{short(value, cells - 1):>{cells}}", PLAIN)
    if after >= 0:
        text.stylize(ALARM, 0, FAULT_TIME_WIDTH)
    return text


def _write(entry: Entry, after: float, width: int) -> Text:
    text = Text(f" {after:>{FAULT_TIME_WIDTH - 1}.1f}", FAINT, no_wrap=True)
    text.append(f"  wrote {entry.code} {entry.new}", ATTENTION)
    text.append(f"  {entry.why}" + ("" if entry.answer == "ok" else f": {entry.answer}"), FAINT)
    text.truncate(width, overflow="ellipsis")
    return text


STORED_MARK = " stored"
STORED_WIDTH = len(STORED_MARK) + 28
"""Columns of the values that the drive stored; the mark separates them from values read now."""
LEAST_FAULT_NAME = 8
"""Cells below which a shortened name would not name its fault."""
STORED_UNITS = ("Hz", "A", "h")
"""Units of the values shown for a fault of the history, if the drive stores them."""


def shown_count(view: DoctorView) -> int:
    """Return the rows of the history: up to the last fault or the cursor, at least 1."""
    raws = [r.raw if (r := view.readings.get(code)) else None for code in view.history]
    some = [n for n, raw in enumerate(raws) if raw not in (None, view.profile.data.faults.none)]
    return max([1, *(n + 1 for n in some), view.at - len(view.rows) + 1])


def history_rows(view: DoctorView, width: int, height: int) -> list[Text]:
    """Return the drive's history, scrolled to the cursor, with the values stored for each fault."""
    if height < 1:
        return []
    if not view.history:
        return labelled("History", [Text("not known on this drive", FAINT)])
    reported = view.history[: max(shown_count(view), 1)]
    stored = [_past_stored(view, number, code) for number, code in enumerate(reported)]
    room = max(8, width - LABEL - 5)
    rows = []
    for number, (code, values) in enumerate(zip(reported, stored, strict=True)):
        cells = max(8, room - STORED_WIDTH) if values else room
        name = f"{_past_text(view, code, cells):<{cells}}"
        rows.append(_past(view, number, name, f"{values:<{STORED_WIDTH if values else 0}}", width))
    chosen = view.at - len(view.rows)
    top = max(0, min(chosen - height + 1, len(rows) - height)) if chosen >= 0 else 0
    return labelled("History", rows[top : top + height])


def _past_fault(view: DoctorView, code: str) -> int | None:
    """Return the raw code of a past fault; None if it was not read."""
    reading = view.readings.get(code)
    return None if reading is None else reading.raw


def _past_text(view: DoctorView, code: str, cells: int) -> str:
    """Return a past fault's code and as much of its name as fits; the code is never cut."""
    raw = _past_fault(view, code)
    if raw is None:
        return NOT_AVAILABLE
    known = view.profile.fault(raw)
    if known is None:
        return f"code {raw}"
    left = cells - len(known.code) - 1
    if left < min(len(known.name), LEAST_FAULT_NAME):
        return known.code
    return f"{known.code} {fitted_names((known.name,), left)[known.name]}"


def _past_stored(view: DoctorView, number: int, code: str) -> str:
    """Return the values that the drive stored for a past fault; empty if there was no fault."""
    faults = view.profile.data.faults
    if number >= len(faults.stored) or _past_fault(view, code) == faults.none:
        return ""
    return _stored(view, faults.stored[number])


def _past(view: DoctorView, number: int, name: str, stored: str, width: int) -> Text:
    """Return the row of a past fault; it is dim without a known fault."""
    raw = _past_fault(view, view.history[number])
    text = Text(f"{number + 1 if number else 'last':<5}", no_wrap=True)
    text.append(name, FAINT if raw in (None, view.profile.data.faults.none) else PLAIN)
    text.append(stored, FAINT)
    if number == view.at - len(view.rows):
        text.stylize(CURSOR)
    text.truncate(max(1, width - LABEL))
    return text


def _stored(view: DoctorView, codes: Sequence[str]) -> str:
    """Return the frequency, current and hours stored for a fault, each in its column."""
    found = dict.fromkeys(STORED_UNITS, "")
    for code in codes:
        reading = view.readings.get(code)
        text = stored_text(reading)
        unit = text.rpartition(" ")[2]
        if reading is not None and found.get(unit) == "":
            found[unit] = text
    cells = "".join(f"{text:>9}" for text in found.values())
    return f"{STORED_MARK}{cells}" if any(found.values()) else ""
