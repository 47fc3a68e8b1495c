"""Rows of the values stored with a fault, and of the seconds before a trip; pure functions."""

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
from tui.widgets.drawing import fitted_names, rule
from tui.widgets.palette import ALARM, ATTENTION, FAINT, PLAIN, STRONG

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
    for heading in record.headings[: _columns(width)]:
        head.append(f"{heading[: RECORD_VALUE_WIDTH - 1]:>{RECORD_VALUE_WIDTH}}", FAINT)
    rows = record_rows(record, width)
    return [rule(title, width), head, *rows[offset : offset + max(1, height - 2)]]


def record_rows(record: FaultRecord, width: int) -> list[Text]:
    """Return a row for each cycle and each write, newest first."""
    rows = [(moment.wall, _moment(moment, record, width)) for moment in record.moments]
    for entry in record.writes:
        wall = datetime.fromisoformat(entry.time).timestamp()
        rows.append((wall, _write(entry, wall - record.wall, width)))
    return [text for _, text in sorted(rows, key=lambda row: -row[0])]


def _columns(width: int) -> int:
    return max(1, (width - FAULT_TIME_WIDTH - 1) // RECORD_VALUE_WIDTH)


def _moment(moment: Moment, record: FaultRecord, width: int) -> Text:
    after = moment.wall - record.wall
    text = Text(f" {after:>{FAULT_TIME_WIDTH - 1}.1f}", FAINT, no_wrap=True)
    for value in moment.texts[: _columns(width)]:
        text.append(f"{value[: RECORD_VALUE_WIDTH - 1]:>{RECORD_VALUE_WIDTH}}", PLAIN)
    if after >= 0:
        text.stylize(ALARM, 0, FAULT_TIME_WIDTH)
    return text


def _write(entry: Entry, after: float, width: int) -> Text:
    text = Text(f" {after:>{FAULT_TIME_WIDTH - 1}.1f}", FAINT, no_wrap=True)
    text.append(f"  wrote {entry.code} {entry.new}", ATTENTION)
    text.append(f"  {entry.why}" + ("" if entry.answer == "ok" else f": {entry.answer}"), FAINT)
    text.truncate(width, overflow="ellipsis")
    return text
