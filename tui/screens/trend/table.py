"""Table of the values of each band: now, at the cursor, at the marks, and between them; pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.text import Text

from tui.drive.values import NOT_AVAILABLE
from tui.session.record.decoding import HistoryPoint
from tui.widgets.drawing import short
from tui.widgets.palette import ATTENTION, FAINT, LINE, PLAIN, STRONG

from .traces import MarkValues

NAME_CELLS = 11
WIDE, NARROW = 100, 79
"""Least widths of the table with the present values, and with the values of both marks."""
MORE_SLOPE_DIGITS = 2
"""Decimals of a slope beyond those of its value: 0.9 A less in 18 s is -0.050 A/s."""
REDUCED_SIGN = "~"
"""Before a mean of several replies."""
VALUE_COLUMNS = {
    "now": 8, "cursor": 9, "A": 8, "B": 8, "B-A": 9, "slope/s": 10, "min": 8, "mean": 8, "max": 8,
}  # fmt: skip
"""Columns with their cells."""


@dataclass(frozen=True, slots=True)
class TableRow:
    """Values of one band; a point is None if there is no value."""

    name: str
    unit: str
    digits: int
    now: str
    """The present value as text; empty if it is old."""
    at_cursor: bool
    at_mark: bool
    """True while the cursor is open; True if mark A is set."""
    cursor: HistoryPoint | None
    at_a: HistoryPoint | None
    marks: MarkValues | None
    seconds: float
    """From mark A to mark B."""


def value_table(rows: Sequence[TableRow], width: int, *, present: bool) -> list[Text]:
    """Return the heading and a line for each band; with the `present` values if they fit."""
    heads = dict(VALUE_COLUMNS)
    if width < WIDE or not present:
        del heads["now"]
    if width < NARROW:
        del heads["A"], heads["B"]
    head = Text("  Value", FAINT, no_wrap=True)
    head.append(" " * (NAME_CELLS - head.cell_len))
    for name, cells in heads.items():
        gap = "─" * (cells - len(name) - 2)
        head.append(f" {gap} ", LINE)
        head.append(name, ATTENTION if name in "AB" else STRONG if name == "cursor" else FAINT)
    return [head, *(_row(row, heads) for row in rows)]


def _row(row: TableRow, heads: dict[str, int]) -> Text:
    line = Text("  ", no_wrap=True)
    line.append(short(row.name, 6), STRONG)
    line.append(f" {short(row.unit, 4)}", FAINT)
    line.append(" " * max(0, NAME_CELLS - line.cell_len))
    cells = _cells(row)
    for name, room in heads.items():
        text = cells[name]
        style = STRONG if name == "cursor" else FAINT if text == NOT_AVAILABLE else PLAIN
        line.append(f"{short(text, room - 1):>{room}}", style)
    return line


def _cells(row: TableRow) -> dict[str, str]:
    """Return the texts of a row by column."""
    marks = row.marks
    first = marks.at_a if marks is not None else row.at_a
    second = marks.at_b if marks is not None else None
    between = marks.between if marks is not None else None
    difference = slope = ""
    if marks is not None:
        difference = slope = NOT_AVAILABLE
        if first is not None and second is not None and first.mean is not None:
            apart = (second.mean or 0.0) - first.mean
            difference = _signed(apart, row.digits)
            if row.seconds:
                # a slow change must not read as none
                slope = _signed(apart / row.seconds, row.digits + MORE_SLOPE_DIGITS)
    found = {
        "now": row.now or NOT_AVAILABLE,
        "cursor": point_text(row.cursor, row) if row.at_cursor else "",
        "A": point_text(first, row) if row.at_mark else "",
        "B": point_text(second, row) if marks is not None else "",
        "B-A": difference,
        "slope/s": slope,
    }
    for name, value in zip(
        ("min", "mean", "max"),
        (between.least, between.mean, between.most) if between is not None else (None,) * 3,
        strict=True,
    ):
        shown = "" if marks is None else NOT_AVAILABLE
        found[name] = shown if value is None else f"{value:z.{row.digits}f}"
    return found


def _signed(value: float, digits: int) -> str:
    """Return a difference with its sign; none if it is shown as 0."""
    shown = f"{value:+.{digits}f}"
    return shown if float(shown) else f"{0:.{digits}f}"


def point_text(point: HistoryPoint | None, row: TableRow) -> str:
    """Return a value as text; a mean of several replies with a sign."""
    if point is None or point.mean is None:
        return NOT_AVAILABLE
    return f"{REDUCED_SIGN if point.reduced else ''}{point.mean:z.{row.digits}f}"
