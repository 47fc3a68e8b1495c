"""Table of the drives of a line: one or two rows for each, in fixed columns. Pure functions."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.drive.sentences import counted
from tui.widgets.drawing import cut, fitted_name, short
from tui.widgets.palette import (
    ALARM,
    ATTENTION,
    BAR,
    BAR_REST,
    FAINT,
    FAULT,
    FAULT_BLOCK,
    KEY,
    LINE,
    PLAIN,
    RUNNING,
    STALE,
    STATE_SIGNS,
    STRONG,
)

STATE_STYLE: dict[str, Style] = {
    "running": RUNNING,
    "fault": FAULT_BLOCK,
    "unknown": ALARM,
    "stop": ATTENTION,
    "stop failed": FAULT_BLOCK,
    "none": FAINT,
    "ready": FAINT,
    "stopped": FAINT,
    "blocked": FAINT,
}
WALL_SIGNS = {**STATE_SIGNS, "stop": "▼", "stop failed": "■", "none": " "}
TURNING_KINDS = frozenset({"running", "stop", "stopping", "stop failed"})
"""Kinds of state in which the motor may turn."""
MESSAGE_STYLES: dict[str, Style] = {"fault": FAULT, "alarm": ALARM, "": FAINT}
FULL = "━"


class WallRow(NamedTuple):
    """Drive at one moment, as text; unknown values are empty."""

    device: int
    name: str = ""
    """Name that it reports; empty if none."""
    model: str = ""
    kind: str = "none"
    """Kind of its state; `stop` or `stop failed` during a stop, `none` without a state."""
    words: str = ""
    frequency: str = ""
    reference: str = ""
    """Frequency that a running motor has not reached yet."""
    current: str = ""
    current_unit: str = "A"
    share: float | None = None
    """Motor current as a fraction of the rated current; None if unknown."""
    age: float | None = None
    """Seconds since the shown values were received; None if there are none."""
    old: bool = False
    """True if the values are too old to count as current."""
    message: tuple[str, str] = ("", "")
    """Fault, alarm or silence in two parts, for two rows or one after the other."""
    brief: str = ""
    """The time since a trip, or the age of old values; for a narrow column."""
    message_kind: str = ""
    """`fault`, `alarm`, or empty if nothing needs attention."""
    curve: tuple[str, ...] = ()
    """Rows of the curve of the last minute; empty if there is no room for it."""


class WallColumns(NamedTuple):
    """Widths of the variable columns in cells, and the rows of a drive; 0 hides a column."""

    name: int
    """The name, or the model of a drive without one."""
    model: int
    """The model beside the name; with two rows for a drive it is below the name."""
    state: int
    load: int
    curve: int
    message: int
    rows: int = 1

    @property
    def taken(self) -> int:
        """Cells of a whole row, with device, Hz and A."""
        given = (self.name, self.model, self.state, self.load, self.curve, self.message)
        return DEVICE + HERTZ + CURRENT + sum(width + 1 for width in given if width)


DEVICE, HERTZ, CURRENT = 4, 7, 8
WIDEST_MESSAGE = 60
LEAST_MESSAGE = 14
"""Cells from which a message is shown; a narrower column has its brief form."""
SINGLE_ROWS = (
    WallColumns(20, 16, 14, 16, 42, 38),
    WallColumns(14, 14, 13, 0, 24, 26),
    WallColumns(12, 0, 13, 0, 18, 24),
    WallColumns(12, 0, 13, 0, 12, 19),
    WallColumns(10, 0, 12, 0, 12, 6),
    WallColumns(11, 0, 12, 0, 6, 6),
    WallColumns(9, 0, 12, 0, 0, 8),
    WallColumns(8, 0, 11, 0, 0, 6),
    WallColumns(0, 0, 10, 0, 0, 5),
)
"""Layouts from wide to narrow with one row for a drive."""
DOUBLE_ROWS = (
    WallColumns(20, 0, 16, 20, 42, 46, 2),
    WallColumns(14, 0, 16, 15, 24, 26, 2),
    WallColumns(12, 0, 13, 0, 18, 24, 2),
    WallColumns(13, 0, 13, 0, 12, 18, 2),
)
"""The same with two rows."""
TICKS = 6
"""Parts of the page of a curve; dots below a curve are between them."""


def columns_for(width: int, *, two_rows: bool = False, names: Sequence[str] = ()) -> WallColumns:
    """Return the widest layout that fits; spare cells go to long `names`, then to the message.

    Two rows for a drive are used only if they fit.
    """
    layouts = (*(DOUBLE_ROWS if two_rows else ()), *SINGLE_ROWS)
    found = next((layout for layout in layouts if layout.taken <= width), SINGLE_ROWS[-1])
    spare = max(0, width - found.taken)
    if found.name:
        wider = min(spare, max(0, max(map(len, names), default=0) - found.name))
        found, spare = found._replace(name=found.name + wider), spare - wider
    return found._replace(message=min(WIDEST_MESSAGE, found.message + spare))


def aligned(texts: Sequence[str]) -> list[str]:
    """Return numbers with their decimal points below each other once they are right-aligned."""
    places = [len(text.partition(".")[2]) for text in texts]
    most = max(places, default=0)
    # without a point, a number ends where the others have theirs
    return [
        text + " " * (most - digits + (not digits and bool(most))) if text else ""
        for text, digits in zip(texts, places, strict=True)
    ]


FIRST_STATES, LAST_STATES = ("running",), ("fault", "no answer")


def state_counts(rows: Sequence[WallRow]) -> list[tuple[str, int, Style]]:
    """Return each state of the drives with its number and style: the running ones first."""
    found = Counter(_counted_as(row) for row in rows)
    others = sorted(found.keys() - {*FIRST_STATES, *LAST_STATES})
    styles = {"running": RUNNING, "fault": FAULT, "no answer": ALARM, "not stopped": FAULT}
    order = (*FIRST_STATES, *others, *LAST_STATES)
    return [(name, found[name], styles.get(name, PLAIN)) for name in order if found[name]]


def _counted_as(row: WallRow) -> str:
    if row.kind in ("running", "fault"):
        return row.kind
    return row.words.lower() or "unknown"


def heading(rows: Sequence[WallRow], scan: Sequence[str], width: int) -> Text:
    """Draw the title of the table: the number of drives in each state, and the scan.

    `scan` are forms of one text, of which the first that fits is shown.
    """
    text = Text(no_wrap=True)
    text.append(counted(len(rows), " 1 drive: ", " {count} drives: "), STRONG)
    counts = state_counts(rows)
    for place, (name, number, style) in enumerate(counts):
        part = f"{number} {name}s" if name == "fault" and number > 1 else f"{number} {name}"
        rest = len(counts) - place - 1
        if text.cell_len + len(part) + (5 if rest else 0) > width:
            text.append("...", FAINT)
            break
        text.append(part, style).append(", " if rest else "", FAINT)
    room = width - text.cell_len - 2
    if form := next((form for form in scan if len(form) < room), ""):
        text.append(f"{form:>{room + 1}} ", FAINT)
    text.append(" " * max(0, width - text.cell_len))
    text.truncate(width)
    return text


def column_heads(columns: WallColumns, scale: float | None = None) -> Text:
    """Draw the names of the columns; `scale` is the highest frequency of the curves in Hz."""
    text = Text(f"{'Dev':>{DEVICE}}", FAINT, no_wrap=True)
    for title, width in (("Drive", columns.name), ("Model", columns.model)):
        text.append(f" {title:<{width}}" if width else "")
    text.append(f" {'State':<{columns.state}}{'Hz':>{HERTZ}}{'A':>{CURRENT - 1}} ")
    text.append(f"  {'Load':<{columns.load - 1}}" if columns.load else "")
    if columns.curve:
        ranges = ["60 s", f"60 s, 0-{scale:g} Hz", f"Hz, 60 s, 0-{scale:g}"] if scale else ["60 s"]
        text.append(f" {next(r for r in ranges[::-1] if len(r) <= columns.curve):<{columns.curve}}")
    title = "Message" if columns.message >= LEAST_MESSAGE else ""
    return text.append(f" {title:<{columns.message}}")


@lru_cache(maxsize=512)
def wall_line(row: WallRow, columns: WallColumns) -> Text:
    """Draw a drive in one or two rows; no column moves when a value changes.

    The Text is cached: callers must not modify it.
    """
    text = _first_row(row, columns)
    if columns.rows == 2:
        text.append("\n").append_text(_second_row(row, columns))
    return text


def _first_row(row: WallRow, columns: WallColumns) -> Text:
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f"{row.device:>{DEVICE}}", FAINT)
    if columns.name:
        named = row.name if columns.model or row.name else row.model
        name = fitted_name(named, columns.name)
        text.append(f" {name:<{columns.name}}", STRONG if row.name else PLAIN)
    if columns.model:
        text.append(f" {fitted_name(row.model, columns.model):<{columns.model}}", FAINT)
    text.append(" ")
    words, room = row.words, columns.state - 2
    if row.kind == "fault" and len(words) > room:
        words = words.removeprefix("FAULT ")  # the sign and the color remain
    state = f"{WALL_SIGNS.get(row.kind, '□')} {short(words, room)}"
    block = row.kind in ("fault", "stop failed")
    message = f"{state:<{columns.state}}" if block else state
    text.append(message, STATE_STYLE.get(row.kind, PLAIN))
    text.append(" " * (columns.state - len(message)))
    turning = row.kind in TURNING_KINDS
    style = STALE if row.old else STRONG if turning else FAINT
    text.append(f"{short(row.frequency, HERTZ - 1):>{HERTZ}}", style)
    unit = "" if row.current_unit == "A" else row.current_unit[:1]
    current = row.current + (unit or " ") if row.current else ""
    style = STALE if row.old else PLAIN if turning else FAINT
    text.append(f"{short(current, CURRENT - 1):>{CURRENT}}", style)
    if columns.load:
        text.append("  ").append_text(load_cell(None if row.old else row.share, columns.load - 1))
    if columns.curve:
        _append_curve(text, row, 0, columns)
    text.append(" ")
    message = _message(row, columns)
    return text.append(cut(message, columns.message), MESSAGE_STYLES[row.message_kind])


def _message(row: WallRow, columns: WallColumns) -> str:
    """Return the message of the first row, or all of it if there is only one row."""
    first, rest = row.message
    if columns.message < LEAST_MESSAGE:
        fits = len(row.brief) <= columns.message
        return row.brief if fits else row.brief.replace(" ", "")  # "12min"
    if columns.rows == 2:
        return first
    if row.message_kind == "fault":
        return f"{row.brief} · {first}"  # the time comes first: a long name is cut
    if not first and row.reference:
        return f"→ {row.reference.strip()} Hz"
    return f"{first} · {rest}" if rest else first


def _second_row(row: WallRow, columns: WallColumns) -> Text:
    text = Text(" " * DEVICE, no_wrap=True, overflow="ellipsis")
    model = fitted_name(row.model, columns.name) if row.name else ""
    text.append(f" {model:<{columns.name}}", FAINT)
    text.append(" " * (columns.state + 1))
    old = spaced_age(row.age) if row.old else ""
    if row.reference and not old:
        text.append(f"{short(f'→ {row.reference}', HERTZ):>{HERTZ}}{'':>{CURRENT}}", KEY)
    else:
        # only below a value: the message has the age, too
        ages = old if row.frequency else "", f"{old} " if old and row.current else ""
        text.append(f"{ages[0]:>{HERTZ}}{ages[1]:>{CURRENT}}", ALARM)
    text.append(" " * (columns.load + 1 if columns.load else 0))
    if columns.curve:
        _append_curve(text, row, 1, columns)
    return text.append(f" {cut(row.message[1], columns.message)}", FAINT)


def _append_curve(text: Text, row: WallRow, at: int, columns: WallColumns) -> None:
    """Append a row of the curve; below a curve, dots show every tenth second."""
    cells = row.curve[at] if at < len(row.curve) else ""
    cells = f"{cells:<{columns.curve}}"[: columns.curve]
    style = STALE if row.old else STRONG if row.kind in TURNING_KINDS else FAINT
    text.append(" ")
    if at == 0 or cells.strip():
        text.append(cells, style)
        return
    dots = {columns.curve * tick // TICKS for tick in range(TICKS)}
    text.append("".join("·" if x in dots else " " for x in range(columns.curve)), LINE)


def load_cell(share: float | None, width: int) -> Text:
    """Draw the load as a bar and in percent; blank if `share` is None."""
    if share is None:
        return Text(" " * width)
    percent = f"{min(share, 9.99) * 100:4.0f} %"
    return load_bar(share, width - len(percent)).append(percent, FAINT)


def load_bar(share: float | None, width: int) -> Text:
    """Draw a bar from 0 to the rated current; blank if `share` is None, alarm color above 1."""
    if share is None:
        return Text(" " * width)
    inner = width - 2
    filled = max(0, min(inner, round(share * inner)))
    text = Text("╶", LINE, no_wrap=True) if not filled else Text("", no_wrap=True)
    full = FULL * (filled + (1 if filled else 0))
    text.append(full, ALARM if share > 1 else BAR)
    text.append("─" * (width - 1 - text.cell_len), BAR_REST)
    return text.append("╴" if filled < inner else FULL, LINE if filled < inner else BAR)


def spaced_age(age: float | None) -> str:
    """Format an age in whole seconds, minutes or days, or in hours, in six cells at most."""
    if age is None:
        return ""
    for seconds, unit in ((1, "s"), (60, "min")):
        if age < 100 * seconds:
            return f"{math.floor(age / seconds)} {unit}"
    hours = age / 3600
    if hours < 100:
        return f"{math.floor(10 * hours) / 10:.1f} h" if hours < 10 else f"{math.floor(hours)} h"
    return f"{math.floor(min(hours / 24, 999))} d"
