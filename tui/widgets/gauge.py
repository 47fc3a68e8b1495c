"""A thin bar with end marks, filled from zero to the value, with a mark for the reference. Pure."""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter

from rich.style import Style
from rich.text import Text

from .palette import BAR, BAR_REST, LINE, MARK


def gauge(
    value: float | None,
    low: float,
    high: float,
    width: int,
    mark: float | None = None,
    style: Style = BAR,
) -> Text:
    """A bar of exactly `width` cells, filled from zero (or the low end) to the value.

    If the low end is below zero, zero has a sign of its own inside the bar.
    """
    inner = max(1, width - 2)
    cells = [("─", BAR_REST)] * inner
    if high > low:
        zero = _halves(max(low, min(high, 0.0)), low, high, inner)
        if value is not None:
            end = _halves(value, low, high, inner)
            cells = [_cell(at, min(zero, end), max(zero, end), style) for at in range(inner)]
        if low < 0 < high and cells[at := min(inner - 1, zero // 2)][0] == "─":
            cells[at] = ("┼", LINE)
        if mark is not None:
            cells[min(inner - 1, _halves(mark, low, high, inner) // 2)] = ("┃", MARK)
    text = Text("├", LINE, no_wrap=True)
    for item, run in groupby(cells, key=itemgetter(1)):
        text.append("".join(character for character, _ in run), item)
    return text.append("┤", LINE)


def _halves(value: float, low: float, high: float, inner: int) -> int:
    """The position of a value, in halves of a cell."""
    return round((max(low, min(high, value)) - low) / (high - low) * inner * 2)


def _cell(at: int, start: int, end: int, style: Style) -> tuple[str, Style]:
    """The cell `at`; `start` and `end` of the filled part are in halves of a cell."""
    left, right = start <= 2 * at < end, start <= 2 * at + 1 < end
    if left and right:
        return "━", style
    if left or right:
        return ("╸" if left else "╺"), style
    return "─", BAR_REST
