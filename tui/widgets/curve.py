"""Curves over time that stay in place: a new value changes only the cells at their end.

The page of time does not scroll. It turns when its end is reached, so few cells change with a
sample. Pure functions; times are seconds on one clock, values in the unit of the scale.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from .palette import CURSOR, KEY, LINE

Samples = Sequence[tuple[float, float | None]]
"""Times and values, oldest first; None for a value that was not read."""


class PageStep(NamedTuple):
    """Length of a page, interval of its ticks, and shift when it turns, all in seconds."""

    span: float
    tick: float
    turn: float


PAGE_STEPS: Sequence[PageStep] = (
    PageStep(10, 2, 4),
    PageStep(30, 5, 10),
    PageStep(60, 10, 20),
    PageStep(120, 20, 40),
    PageStep(300, 60, 60),
    PageStep(600, 120, 120),
)
"""Each turn is a whole number of ticks, so the ticks stay in their columns."""


class CurveSigns(NamedTuple):
    """Characters that draw curves; a cell has `across` x `down` dots."""

    across: int
    down: int
    glyphs: Sequence[str]
    """Characters by the dots of a cell as bits: left column first, each from its lowest dot."""
    dotted: Sequence[str]
    """The same for a dotted curve."""
    grid: str
    mark: str
    """Vertical line of a mark."""
    dots: str
    """Two cells of a dotted curve, for a legend."""


_LEFT, _RIGHT = (0x40, 0x04, 0x02, 0x01), (0x80, 0x20, 0x10, 0x08)
"""Braille dots of both columns, from the lowest."""


def _braille(dots: int) -> str:
    code = 0x2800
    for bit in range(4):
        code += _LEFT[bit] * (dots >> bit & 1) + _RIGHT[bit] * (dots >> bit + 4 & 1)
    return chr(code)


_BRAILLE = tuple(_braille(dots) for dots in range(256))
BRAILLE = CurveSigns(2, 4, _BRAILLE, _BRAILLE, "·", "┆", "⠂⠂")
BLOCKS = CurveSigns(1, 2, " ▄▀█", " ▄▀█", "·", "│", "▄ ")
"""For consoles whose fonts have no braille."""
ASCII_SIGNS = CurveSigns(1, 3, ' _-|"|||', " .=:':::", " ", "!", "= ")


def curve_signs(*, plain: bool, braille: bool, grid: bool = True) -> CurveSigns:
    """Return the characters for a terminal; `plain` means ASCII only.

    A grid needs colors: without them it would look like part of a curve. It is also a third of the
    bytes of Monitor.
    """
    signs = ASCII_SIGNS if plain else BRAILLE if braille else BLOCKS
    return signs if grid else signs._replace(grid=" ")


@dataclass(frozen=True, slots=True)
class Curve:
    """Values of one quantity and how they are drawn."""

    samples: Samples
    style: Style
    held: bool = False
    """True if a value holds until the next one, as a reference does. It is drawn dotted."""


@dataclass(frozen=True, slots=True)
class CurveScale:
    """Ends of the vertical axis, and the values that have a label."""

    low: float
    high: float
    labels: tuple[float, ...] = ()

    def dot(self, value: float, dots: int) -> int:
        """Return the dot of a value, 0 at the low end; a value beyond an end has that end's dot."""
        if value <= self.low or self.high <= self.low:
            return 0
        if value >= self.high:
            return dots - 1
        return round((value - self.low) / (self.high - self.low) * (dots - 1))


@dataclass(frozen=True, slots=True)
class Plot:
    """Area of curves: start and span of its page in seconds, its scale and its cells."""

    start: float
    span: float
    scale: CurveScale
    columns: int
    rows: int
    signs: CurveSigns = BRAILLE

    @property
    def end(self) -> float:
        """The first moment after the page."""
        return self.start + self.span

    def column(self, time: float) -> int | None:
        """Return the column of a moment; None outside the page."""
        column = math.floor((time - self.start) / self.span * self.columns)
        return column if 0 <= column < self.columns else None

    def row(self, value: float) -> int:
        """Return the row of a value, 0 at the top."""
        down = self.signs.down
        return self.rows - 1 - self.scale.dot(value, self.rows * down) // down


def page_start(moment: float, step: PageStep) -> float:
    """Return the start of the page that shows a moment, both in seconds of wall-clock time."""
    return (math.floor(moment / step.turn) + 1) * step.turn - step.span


def on_page(samples: Samples, start: float, end: float) -> Samples:
    """Return the samples of a page, and one more at each side for the lines that cross its edge."""
    times = _Times(samples)
    first = bisect_left(times, start)
    last = bisect_left(times, end)
    return samples[max(0, first - 1) : last + 1]


def sample_at(samples: Samples, moment: float, reach: float) -> tuple[float, float | None] | None:
    """Return the last sample up to a moment, at most `reach` seconds old, or None."""
    at = bisect_right(_Times(samples), moment) - 1
    if at < 0 or moment - samples[at][0] > reach:
        return None
    return samples[at]


class _Times(Sequence[float]):
    """Times of samples for `bisect`, without a copy."""

    def __init__(self, samples: Samples) -> None:
        self._samples = samples

    def __len__(self) -> int:
        return len(self._samples)

    def __getitem__(self, at: int) -> float:  # type: ignore[override]
        return self._samples[at][0]


def dots_of(curve: Curve, plot: Plot, reach: float) -> list[int]:
    """Return the dots of a curve: an integer for each column of dots, bit 0 the lowest dot.

    Two values are connected if they are at most `reach` seconds apart and no failed read is
    between them.
    """
    width, height = plot.columns * plot.signs.across, plot.rows * plot.signs.down
    columns = [0] * width
    start, per_second, floor, dot = plot.start, width / plot.span, math.floor, plot.scale.dot
    before: tuple[float, int, int] | None = None
    # a page of ten minutes has 6,000 samples at 10 Hz: most are in the column of their predecessor
    for time, value in on_page(curve.samples, start, plot.end):
        if value is None:
            before = None
            continue
        x, y = floor((time - start) * per_second), dot(value, height)
        if 0 <= x < width:
            columns[x] |= 1 << y
        if before is not None and (x, y) != before[1:] and time - before[0] <= reach:
            _connect(columns, before[1:], (x, y), held=curve.held)
        before = (time, x, y)
    return [_thinned(dots, x) for x, dots in enumerate(columns)] if curve.held else columns


def _connect(
    columns: list[int], first: tuple[int, int], last: tuple[int, int], *, held: bool
) -> None:
    """Draw a line between two dots into `columns`; a held value stays level up to the next."""
    (x, y), (end, target) = first, last

    def level(at: int) -> int:
        if held:
            return target if at >= end else y
        return round(y + (target - y) * (at - x) / (end - x)) if end > x else y

    if end == x:
        if 0 <= x < len(columns):
            columns[x] |= _between(y, target)
        return
    begin = max(x + 1, 0)
    previous = level(begin - 1)
    for at in range(begin, min(end, len(columns) - 1) + 1):
        reached = level(at)
        # the previous column already has its own dot
        joint = previous + (reached > previous) - (reached < previous)
        columns[at] |= _between(previous if held else joint, reached)
        previous = reached


def _between(first: int, last: int) -> int:
    """Return the bits of all dots between two dots, both included."""
    low, high = min(first, last), max(first, last)
    return (1 << high + 1) - (1 << low)


_EVERY_SECOND = int("01" * 256, 2)


def _thinned(dots: int, x: int) -> int:
    """Remove every second dot of a level or vertical line."""
    if dots & dots - 1:
        return dots & (_EVERY_SECOND << (x & 1))
    return 0 if x & 1 else dots


def curve_rows(
    curves: Sequence[Curve],
    plot: Plot,
    reach: float,
    *,
    ticks: tuple[int, ...] = (),
    marks: tuple[int, ...] = (),
    cursor: int | None = None,
) -> list[Text]:
    """Return the rows of a plot; each cell shows the first curve that has a dot there.

    `ticks` are columns of the grid, `marks` columns of vertical lines, `cursor` the column of
    the cursor.
    """
    lit: list[dict[int, CurveCell]] = [{} for _ in range(plot.rows)]
    for curve in reversed(curves):
        for row, column, character in _cells(curve, plot, reach):
            lit[row][column] = character, curve.style
    labelled = {plot.row(value) for value in plot.scale.labels}
    rows = []
    for row, found in enumerate(lit):
        empty = _empty_row(plot.signs, plot.columns, ticks, marks, row in labelled)
        if not found and cursor is None:
            rows.append(_row(empty))
            continue
        cells = list(empty)
        for column, cell in found.items():
            cells[column] = cell
        if cursor is not None and 0 <= cursor < plot.columns:
            cells[cursor] = _under_cursor(cells[cursor], is_lit=cursor in found)
        rows.append(_row(tuple(cells)))
    return rows


def curve_texts(curve: Curve, plot: Plot, reach: float) -> list[str]:
    """Return the rows of a plot with one curve and nothing else, as characters."""
    rows = [[" "] * plot.columns for _ in range(plot.rows)]
    for row, column, character in _cells(curve, plot, reach):
        rows[row][column] = character
    return ["".join(cells) for cells in rows]


CurveCell = tuple[str, Style]


def _cells(curve: Curve, plot: Plot, reach: float) -> Iterator[tuple[int, int, str]]:
    """Yield row, column and character of each cell that has a dot of the curve."""
    signs, dots = plot.signs, dots_of(curve, plot, reach)
    glyphs, down = signs.dotted if curve.held else signs.glyphs, signs.down
    full = (1 << down) - 1
    for column in range(plot.columns):
        parts = dots[column * signs.across : (column + 1) * signs.across]
        left = parts[0]
        right = parts[1] if signs.across == 2 else 0
        rest = left | right
        while rest:
            above = (rest & -rest).bit_length() - 1
            level = above // down
            shift = level * down
            cell = left >> shift & full | (right >> shift & full) << down
            yield plot.rows - 1 - level, column, glyphs[cell]
            rest = rest >> shift + down << shift + down


GRID_EVERY = 3
"""Columns from one dot of a level grid line to the next."""


@lru_cache(maxsize=64)
def _empty_row(
    signs: CurveSigns, columns: int, ticks: tuple[int, ...], marks: tuple[int, ...], labelled: bool
) -> tuple[CurveCell, ...]:
    """Return a row without curves: the grid, and the vertical lines of marks."""
    cells = []
    for column in range(columns):
        grid = column % GRID_EVERY == 1 if labelled else column in ticks
        sign = signs.mark if column in marks else signs.grid if grid else " "
        cells.append((sign, LINE))
    return tuple(cells)


def _under_cursor(cell: CurveCell, *, is_lit: bool) -> CurveCell:
    """Return a cell under the cursor, which is visible even on a terminal without colors."""
    return (cell[0], cell[1] + CURSOR) if is_lit else ("│", KEY + CURSOR)


@lru_cache(maxsize=256)
def _row(cells: tuple[CurveCell, ...]) -> Text:
    """Return cells as a text. The text is cached: copy it before changing it."""
    text = Text(no_wrap=True)
    for style, run in groupby(cells, key=lambda cell: cell[1]):
        text.append("".join(character for character, _ in run), style)
    return text


ROUND_NUMBERS = (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)


def round_up(value: float) -> float:
    """Return the lowest round number not below a positive value; 1.0 for any other value."""
    if value <= 0 or not math.isfinite(value):
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    fitting = (number * power for number in ROUND_NUMBERS if number * power >= value * (1 - 1e-9))
    return next(fitting, 10 * power)


ROUND_STEPS = (1, 1.5, 2, 2.5, 3, 4, 5, 6, 10)
STEPS_MOST = 5


def scale_of(low: float, high: float, rows: int) -> CurveScale:
    """Return the scale from `low` to `high`, with as many round labels as fit in the rows."""
    span = high - low
    for steps in range(max(1, min(STEPS_MOST, (rows - 1) // 2)), 0, -1):
        step = span / steps
        digits = step / 10.0 ** math.floor(math.log10(step)) if step > 0 else 1.0
        if any(math.isclose(digits, number) for number in ROUND_STEPS) and (
            low == 0 or steps % 2 == 0
        ):
            return CurveScale(low, high, tuple(low + step * at for at in range(steps + 1)))
    return CurveScale(low, high, (low, high))
