"""Rows of the drive's fault history; pure functions."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from tui.drive.values import NOT_AVAILABLE
from tui.widgets.drawing import fitted_names
from tui.widgets.palette import CURSOR, FAINT, PLAIN

from .doctor_view import DoctorView
from .parts import LABEL, labelled
from .view import stored_text

STORED_MARK = " stored"
STORED_WIDTH = len(STORED_MARK) + 28
"""Columns of the values that the drive stored; the mark separates them from values read now."""
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
    texts = [_past_text(view, code) for code in reported]
    stored = [_past_stored(view, number, code) for number, code in enumerate(reported)]
    kept = STORED_WIDTH if any(stored) else 0
    room = max(8, width - LABEL - 5 - kept)
    names = fitted_names(tuple(texts), room)
    rows = [
        _past(view, number, f"{names[text]:<{room}}", f"{values:<{kept}}", width)
        for number, (text, values) in enumerate(zip(texts, stored, strict=True))
    ]
    chosen = view.at - len(view.rows)
    top = max(0, min(chosen - height + 1, len(rows) - height)) if chosen >= 0 else 0
    return labelled("History", rows[top : top + height])


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
