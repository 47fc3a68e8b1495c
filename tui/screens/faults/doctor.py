"""Rows of a fault, its causes and checks, and the drive's history; pure functions."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

from rich.style import Style
from rich.text import Text

from tui.drive.hints import FaultAdvice, reset_text
from tui.drive.plain import plain
from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import FaultHelp, Quantity
from tui.drive.values import NOT_AVAILABLE, Value, set_bits
from tui.session.shown import Shown
from tui.widgets.drawing import cut, cut_at_word, fitted_names, wrapped
from tui.widgets.palette import (
    ALARM_BLOCK,
    CURSOR,
    FAINT,
    FAULT,
    FAULT_BLOCK,
    KEY,
    PLAIN,
    STALE,
    STRONG,
    age_text,
)

from .doctor_view import DoctorView
from .view import stored_text

LABEL = 13
"""Columns of the headings at the left."""
TRUST_WIDTH = 11
"""Columns at the right for the certainty of a cause or check."""
RESET_LINES = 8
"""Most rows of the text about the reset, at 60 columns."""
CODE_WIDTH, LOOK_VALUE_WIDTH = 7, 13
OPENS = "Enter open "
TRUST_MARKS: Mapping[str, str] = {"manual": "manual", "public": "guide", "practice": "practice"}
"""Certainty of the first cause in a word; `practice` is general practice."""
TRIP_QUANTITIES: Mapping[Quantity, str] = {
    "output_frequency": "",
    "motor_current": "",
    "mains_voltage": "mains ",
}
CONTACTS = ("digital_inputs", "digital_outputs")
"""Words shown by the names of their set bits, not in hexadecimal."""
STORED_MARK = " stored"
STORED_WIDTH = len(STORED_MARK) + 28
"""Columns of the values that the drive stored; the mark separates them from values read now."""
STORED_UNITS = ("Hz", "A", "h")
"""Units of the values shown for a fault of the history, if the drive stores them."""


def doctor_lines(view: DoctorView, width: int, height: int) -> list[Text]:
    """Return the whole page in at most `height` rows; empty rows are dropped first."""
    parts = [
        _headline(view, width),
        _probable(view, width),
        _look_at(view, width),
        _checks(view, width),
        _reset(view, width),
    ]
    least = min(3, max(1, _shown_count(view)))
    _shorten(parts, sum(map(len, parts)) + least - height)
    parts = [part for part in parts if part]
    spare = height - sum(len(part) for part in parts) - max(least, _shown_count(view))
    lines: list[Text] = [Text("")] if spare > len(parts) else []
    spare -= len(lines)
    for part in parts:
        lines += part
        if spare > 0:
            lines.append(Text(""))
            spare -= 1
    lines = lines[: max(1, height - least)]
    return lines + _history(view, width, height - len(lines))


def _shorten(parts: list[list[Text]], lines: int) -> None:
    """Remove up to `lines` rows: first checks, then causes, then parameters.

    One row of each stays. The reset is not shortened: it shows what may start the motor.
    """
    for part in (parts[3], parts[1], parts[2]):
        away = max(0, min(lines, len(part) - 1))
        del part[len(part) - away :]
        lines -= away


def _shown_count(view: DoctorView) -> int:
    """Return the rows of the history: up to the last fault or the cursor, at least 1."""
    raws = [r.raw if (r := view.readings.get(code)) else None for code in view.history]
    some = [n for n, raw in enumerate(raws) if raw not in (None, view.profile.data.faults.none)]
    return max([1, *(n + 1 for n in some), view.at - len(view.look_at) + 1])


def _headline(view: DoctorView, width: int) -> list[Text]:
    fault = view.fault
    text = Text(no_wrap=True)
    text.append("  ")
    if fault is None:
        if view.present:
            unknown = "its code was not read" if view.profile.data.faults.codes else "no number"
            text.append(f" ■ FAULT, {unknown} ", FAULT_BLOCK)
            text.append(f"   {_tripped(view)}", PLAIN)
        elif view.alarm is not None:
            text.append(f" ▲ {plain(view.alarm[2]).upper()} ", ALARM_BLOCK)
            text.append("   alarm, no fault", PLAIN)
            more = len(view.alarms) - 1
            text.append(f"   and {more} more" if more else "", PLAIN)
        else:
            text.append("No fault.", STRONG)
            text.append("   reading the history" if view.unread and view.history else "", FAINT)
        return [text]
    if view.present:
        text.append(f" ■ {fault.code}  {fault.name.upper()} ", FAULT_BLOCK)
    else:
        text.append(f"{fault.code}  {fault.name}", FAULT)
    room = width - text.cell_len - 4
    reported = _tripped(view) if view.present or view.record else "no longer present"
    text.append(f"   {cut_at_word(reported, max(1, room))}", PLAIN)
    return [text]


def _tripped(view: DoctorView) -> str:
    """Return the time of the trip or of the first read, and the last values before the trip."""
    record = view.record
    if view.since is not None:
        when = view.since.when
    elif record is not None:
        when = f"tripped {time.strftime('%H:%M:%S', time.localtime(record.wall))}"
    else:
        return "tripped before monitoring began"
    if record is None:
        return when if view.since and view.since.tripped else f"{when}, tripped earlier"
    before = [moment for moment in record.moments if moment.wall < record.wall]
    texts = before[-1].texts if before else ()  # at the trip itself the motor already coasts
    values = dict(zip(record.codes, texts, strict=False))
    parts = []
    for quantity, name in TRIP_QUANTITIES.items():
        parameter = view.profile.quantity(quantity)
        value = values.get(parameter.code, "") if parameter else ""
        if parameter and value not in ("", NOT_AVAILABLE):
            parts.append(f"{name}{value} {parameter.unit}".rstrip())
    return f"{when}, last read {', '.join(parts)}" if parts else when


def _labelled(label: str, lines: Sequence[Text]) -> list[Text]:
    """Return the lines, indented, with a label at the left of the first."""
    return [
        Text.assemble((f"  {label if not number else '':<{LABEL - 2}}", FAINT)).append_text(line)
        for number, line in enumerate(lines)
    ]


def _wrapped(texts: Sequence[str], width: int) -> list[Text]:
    """Return one row per text; the first leaves room for its certainty."""
    rooms = [max(10, width - LABEL - (TRUST_WIDTH if not n else 1)) for n in range(len(texts))]
    return [Text(cut(text, room), PLAIN) for text, room in zip(texts, rooms, strict=True)]


def _excluded(left: FaultAdvice, texts: Sequence[str], width: int) -> list[Text]:
    """Return those of the texts that a value rules out, each after the reason."""
    room = max(10, width - LABEL - 1)
    return [
        Text(cut_at_word(f"({advice.reason}) {advice.text}", room), FAINT)
        for advice in left.excluded
        if advice.text in texts
    ]


def _probable(view: DoctorView, width: int) -> list[Text]:
    fault, help_ = view.fault, view.hint
    room = max(10, width - LABEL - TRUST_WIDTH)
    if help_ is None and fault is None and view.alarm is None:
        return []
    if help_ is None:
        cause = fault.cause if fault else ""
        cause = cause or view.profile.guide.trouble or "The available manual gives no cause."
        return _labelled("Probably", [Text(part, PLAIN) for part in wrapped(cause, room, 3)])
    left = view.advice
    assert left is not None
    lines = _wrapped(left.probable, width)
    if lines:
        lines[0].append(f" {TRUST_MARKS[left.confidence]:>8}", FAINT)
    lines += _excluded(left, help_.probable, width)
    if isinstance(help_, FaultHelp) and help_.name:
        lines.insert(0, Text(cut(help_.name, width - LABEL), PLAIN))
    return _labelled("Probably", lines)


def _look_at(view: DoctorView, width: int) -> list[Text]:
    lines, cells = [], _value_cells(view, width)
    for number, look in enumerate(view.look_at):
        reading = view.readings.get(look.code)
        chosen = number == view.at
        text = Text(no_wrap=True)
        unsure = "" if is_verified(view.profile[look.code]) else "?"
        text.append(look.code, STRONG)
        text.append(f"{unsure:<{max(1, CODE_WIDTH - len(look.code))}}", STALE)
        value, style = _value(reading, view.now)
        text.append(f"{cut(value, cells)} ", style)
        room = max(4, width - LABEL - text.cell_len - 1)
        hint = OPENS if chosen and len(look.why) < room - 12 else ""
        text.append(cut(look.why, room - len(hint)), PLAIN if chosen else FAINT)
        text.append(hint, FAINT)
        if chosen:
            text.stylize(CURSOR)
        lines.append(text)
    return _labelled("Values", lines)


def _value_cells(view: DoctorView, width: int) -> int:
    """Return the columns of the values: as many as they need, if their reasons leave room."""
    longest = max(
        (len(_value(view.readings.get(look.code), view.now)[0]) for look in view.look_at), default=0
    )
    why = max((len(look.why) for look in view.look_at), default=0)
    room = width - LABEL - CODE_WIDTH - why - len(OPENS) - 2
    return max(LOOK_VALUE_WIDTH, min(longest, room))


def _value(reading: Shown | None, now: float) -> tuple[str, Style]:
    if reading is None:
        return NOT_AVAILABLE, FAINT
    parameter = reading.parameter

    def text(value: Value) -> str:
        if parameter.quantity in CONTACTS:
            return ", ".join(bit.name for bit in set_bits(parameter.bits, value.raw)) or "none"
        return f"{value.text} {value.unit}".rstrip()

    return reading.drawn(
        now,
        current=lambda value: (text(value), PLAIN),
        old=lambda value, age: (f"{text(value)}, {age_text(age)} old", STALE),
        missing=(NOT_AVAILABLE, FAINT),
    )


def _checks(view: DoctorView, width: int) -> list[Text]:
    fault, help_ = view.fault, view.hint
    room = max(10, width - LABEL - TRUST_WIDTH)
    if help_ is not None and help_.check:
        left = view.advice
        assert left is not None
        lines = _wrapped(left.check, width)
        if lines and help_.confidence != "practice":  # checks are always practice
            lines[0].append(f" {TRUST_MARKS['practice']:>8}", FAINT)
        return _labelled("Check", lines + _excluded(left, help_.check, width))
    if fault is not None and fault.remedy:
        return _labelled("Check", [Text(part, PLAIN) for part in wrapped(fault.remedy, room, 3)])
    return []


def _reset(view: DoctorView, width: int) -> list[Text]:
    if not view.present:
        return []
    message = reset_text(view.help, view.ready, "x", view.follows)
    room = max(10, width - LABEL - TRUST_WIDTH)
    # as many rows as needed: a warning that the motor may start is never cut off
    lines = [Text(cut(part, room), PLAIN) for part in wrapped(message.text, room, RESET_LINES)]
    if lines[0].plain.startswith("x "):
        lines[0].stylize(KEY, 0, 1)
    lines[0].append("" if message.by_drive else f" {TRUST_MARKS['practice']:>8}", FAINT)
    return _labelled("Reset", lines)


def _history(view: DoctorView, width: int, height: int) -> list[Text]:
    """Return the drive's history, scrolled to the cursor, with the values stored for each fault."""
    if height < 1:
        return []
    if not view.history:
        return _labelled("History", [Text("not known on this drive", FAINT)])
    reported = view.history[: max(_shown_count(view), 1)]
    texts = [_past_text(view, code) for code in reported]
    stored = [_past_stored(view, number, code) for number, code in enumerate(reported)]
    kept = STORED_WIDTH if any(stored) else 0
    room = max(8, width - LABEL - 5 - kept)
    names = fitted_names(tuple(texts), room)
    rows = [
        _past(view, number, f"{names[text]:<{room}}", f"{values:<{kept}}", width)
        for number, (text, values) in enumerate(zip(texts, stored, strict=True))
    ]
    chosen = view.at - len(view.look_at)
    top = max(0, min(chosen - height + 1, len(rows) - height)) if chosen >= 0 else 0
    return _labelled("History", rows[top : top + height])


def _past_fault(view: DoctorView, code: str) -> int | None:
    """Return the raw code of a past fault; None if it was not read."""
    reading = view.readings.get(code)
    return None if reading is None else reading.raw


def _past_text(view: DoctorView, code: str) -> str:
    raw = _past_fault(view, code)
    if raw is None:
        return NOT_AVAILABLE
    known = view.profile.fault(raw)
    return f"{known.code} {known.name}" if known else f"code {raw}"


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
    if number == view.at - len(view.look_at):
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
