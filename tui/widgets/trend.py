"""A trend: the value as an area from zero, what is wanted as a line; pure functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby

from rich.style import Style
from rich.text import Text

from .palette import BAR, GROUND, KEY

EIGHTHS = " ▁▂▃▄▅▆▇█"
NEAR = 2.0
"""Eighths of a row within which the line and the end of the area are one."""
WANTED = Style(color=KEY.color)
WANTED_OVER = "#123a5c"
"""Color of the line where the area lies over it."""
AREA, HANGING, LINE_ABOVE, LINE_OVER = range(4)
"""Contents of a cell: the area, the end of one that hangs from zero, the line beside or over it."""

TrendCell = tuple[str, int]


def trend_rows(
    points: Sequence[float | None],
    wanted: Sequence[float | None],
    high: float,
    height: int,
    *,
    signed: bool = False,
    style: Style = BAR,
) -> list[Text]:
    """One column a point, the newest at the right; a gap where there was no value.

    From 0 to `high`, or with `signed` from -high to high with zero between the rows; a row that
    cannot be halved stays empty at the bottom.
    """
    half = height // 2 if signed else height
    pairs = list(zip(points, wanted, strict=True))
    rows = [[_above(p, w, high, half, half - 1 - row) for p, w in pairs] for row in range(half)]
    if signed:
        rows += [[_below(p, w, high, half, row) for p, w in pairs] for row in range(half)]
        rows += [[(" ", AREA)] * len(pairs)] * (height - 2 * half)
    styles = {
        AREA: style,
        HANGING: Style(color=GROUND, bgcolor=style.color),
        LINE_ABOVE: WANTED,
        LINE_OVER: Style(color=WANTED_OVER, bgcolor=style.color),
    }
    return [_text(row, styles) for row in rows]


def _above(
    value: float | None, wanted: float | None, high: float, rows: int, row: int
) -> TrendCell:
    """A cell above zero; `row` 0 is on it."""
    filled = 0 if value is None else _eighths(value, high, rows, row)
    line = None if wanted is None or wanted < 0 else _line_at(wanted, high, rows, row)
    if line is not None:
        if value is None or line - filled > NEAR:
            return _line(line), LINE_ABOVE
        if filled == 8 and 8 - line > NEAR:
            return "─", LINE_OVER
    if row == 0 and value is not None and value >= 0:
        return EIGHTHS[max(1, filled)], AREA
    return EIGHTHS[filled], AREA


def _below(
    value: float | None, wanted: float | None, high: float, rows: int, row: int
) -> TrendCell:
    """A cell below zero; `row` 0 hangs from it."""
    filled = 0 if value is None else _eighths(-value, high, rows, row)
    line = None if wanted is None or wanted >= 0 else _line_at(-wanted, high, rows, row)
    if line is not None:
        if value is None or line - filled > NEAR:
            return _line(8 - line), LINE_ABOVE
        if filled == 8 and 8 - line > NEAR:
            return "─", LINE_OVER
    if filled in (0, 8):
        return EIGHTHS[filled], AREA
    return EIGHTHS[8 - filled], HANGING


def _eighths(value: float, high: float, rows: int, row: int) -> int:
    """Return the filled part of a row, 0 to 8."""
    return max(0, min(8, round(value / high * rows * 8) - row * 8))


def _line_at(value: float, high: float, rows: int, row: int) -> float | None:
    """Return the place of a line in a row, in eighths from zero's side; None if it is in
    another."""
    place = min(value / high, 1.0) * rows
    own = min(rows - 1, int(place))
    return (place - own) * 8 if own == row else None


def _line(eighths: float) -> str:
    """A line at the lower end, the middle or the upper end of its cell."""
    return "▁" if eighths < 2 else "─" if eighths < 6.5 else "▔"


def _text(cells: Sequence[TrendCell], styles: Mapping[int, Style]) -> Text:
    """Cells as a text, with a span for each run of one kind."""
    text = Text(no_wrap=True)
    for kind, run in groupby(cells, key=lambda cell: cell[1]):
        text.append("".join(character for character, _ in run), styles[kind])
    return text
