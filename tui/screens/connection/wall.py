"""Table of the drives of a line: a row for each, in fixed columns. Pure functions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.widgets.drawing import cut, rule, short
from tui.widgets.palette import (
    ALARM,
    ATTENTION,
    BAR,
    BAR_REST,
    FAINT,
    FAULT,
    FAULT_BLOCK,
    LINE,
    PLAIN,
    RUNNING,
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
FULL = "━"


class WallRow(NamedTuple):
    """Drive at one moment, as text; unknown values are empty."""

    device: int
    drive: str
    name: str = ""
    kind: str = "none"
    """Kind of its state; `stop` or `stop failed` during a stop, `none` without a state."""
    words: str = ""
    frequency: str = ""
    current: str = ""
    current_unit: str = "A"
    share: float | None = None
    """Motor current as a fraction of the rated current; None if unknown."""
    age: float | None = None
    """Seconds since the shown values were received; None if there are none."""
    old: bool = False
    """True if the values are too old to count as current."""


class WallColumns(NamedTuple):
    """Widths of the variable columns in cells; 0 hides a column."""

    drive: int
    name: int
    state: int
    load: int

    @property
    def taken(self) -> int:
        """Cells of a whole row, with device, Hz, A and age."""
        given = (self.drive, self.name, self.state, self.load)
        return DEVICE + HERTZ + CURRENT + AGE + 1 + sum(width + 1 for width in given if width)


DEVICE, HERTZ, CURRENT, AGE = 3, 6, 7, 5
WIDEST_STATE = 30
LAYOUTS = (
    WallColumns(20, 20, 24, 24),
    WallColumns(16, 18, 20, 14),
    WallColumns(14, 12, 15, 10),
    WallColumns(14, 12, 15, 0),
    WallColumns(13, 0, 15, 0),
    WallColumns(12, 0, 14, 0),
    WallColumns(11, 0, 13, 0),
    WallColumns(8, 0, 12, 0),
    WallColumns(0, 0, 12, 0),
    WallColumns(0, 0, 10, 0),
)
"""Layouts from wide to narrow: the load is hidden first, then the name, then the drive."""


def columns_for(width: int) -> WallColumns:
    """Return the widest layout that fits; spare cells go to the state, which has fault names."""
    found = next((layout for layout in LAYOUTS if layout.taken <= width), LAYOUTS[-1])
    return found._replace(state=min(WIDEST_STATE, found.state + max(0, width - found.taken)))


def in_order(devices: Iterable[int], faults: Sequence[int]) -> list[int]:
    """Sort devices: those in `faults` first and in that order, then the others by address."""
    first = {device: place for place, device in enumerate(faults)}
    return sorted(devices, key=lambda device: (first.get(device, len(first)), device))


def heading(label: str, rows: Sequence[WallRow], requested: int, width: int) -> Text:
    """Draw the title of the table: line, number in fault, number lost, number that answered.

    `requested` is the number of addresses in the scan.
    """
    if not rows:
        return rule(short(label, max(4, width - 2)), width)
    faults = sum(row.kind == "fault" for row in rows)
    lost = sum(row.words == "lost" for row in rows)
    parts = [(f"{faults} in fault", FAULT)] if faults else []
    parts += [(f"{lost} lost", ALARM)] if lost else []
    parts.append((f"{len(rows)} of {max(requested, len(rows))}", PLAIN))
    tail = Text(no_wrap=True)
    for number, (words, style) in enumerate(parts):
        tail.append(" · " if number else " ", FAINT)
        tail.append(words, style)
    text = rule(short(label, max(4, width - tail.cell_len - 4)), width - tail.cell_len - 2)
    text.append_text(tail)
    return text.append(" ─", LINE)


def column_heads(columns: WallColumns) -> Text:
    text = Text(f"{'Dev':>{DEVICE + 1}}", FAINT, no_wrap=True)
    for title, width in (("Drive", columns.drive), ("Name", columns.name)):
        text.append(f" {title:<{width}}" if width else "")
    text.append(f" {'State':<{columns.state}}{'Hz':>{HERTZ}}{'A':>{CURRENT}}")
    text.append(f"  {'Load':<{columns.load - 1}}" if columns.load else "")
    return text.append(f"{'Age':>{AGE}}")


@lru_cache(maxsize=512)
def wall_line(row: WallRow, columns: WallColumns) -> Text:
    """Draw a drive in one row; no column moves when a value changes.

    The Text is cached: callers must not modify it.
    """
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f"{row.device:>{DEVICE + 1}}", FAINT)
    if columns.drive:
        text.append(f" {cut(row.drive, columns.drive)}", PLAIN)
    if columns.name:
        text.append(f" {cut(row.name, columns.name)}", FAINT)
    text.append(" ")
    state = f"{WALL_SIGNS.get(row.kind, '□')} {short(row.words, columns.state - 2)}"
    block = row.kind in ("fault", "stop failed")
    message = f"{state:<{columns.state}}" if block else state
    text.append(message, STATE_STYLE.get(row.kind, PLAIN))
    text.append(" " * (columns.state - len(message)))
    turning = row.kind in ("running", "stop", "stopping", "stop failed") and not row.old
    text.append(f"{short(row.frequency, HERTZ - 1):>{HERTZ}}", STRONG if turning else FAINT)
    current = row.current + ("" if row.current_unit == "A" else row.current_unit[:1])
    current = current if row.current else ""
    text.append(f"{short(current, CURRENT - 1):>{CURRENT}}", PLAIN if turning else FAINT)
    if columns.load:
        text.append("  ")
        text.append_text(load_bar(None if row.old else row.share, columns.load - 1))
    text.append(f"{_age(row.age):>{AGE}}", ALARM if row.old else FAINT)
    return text


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


def _age(age: float | None) -> str:
    """Format an age in whole seconds, minutes (m) or hours (h), in at most five cells."""
    if age is None:
        return ""
    if age < 100:
        return f"{age:.0f} s"
    return f"{age / 60:.0f} m" if age < 6000 else f"{min(age / 3600, 999):.0f} h"
