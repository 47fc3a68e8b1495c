"""Curves of the last minute on Line, one for each drive, from the trends of their monitors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rich.style import Style

from tui.session.monitor.trend import TREND_QUANTITIES, TrendPoint, readout_parameter
from tui.widgets.curve import (
    BRAILLE,
    PAGE_STEPS,
    Curve,
    CurveScale,
    CurveSigns,
    Plot,
    Samples,
    curve_texts,
    page_start,
    round_up,
)

if TYPE_CHECKING:
    from tui.session.console import DriveConsole

PAGE = PAGE_STEPS[2]
"""Page of 60 s, as on Monitor. It turns every 20 s; in between, only new cells are drawn."""
FREQUENCY = TREND_QUANTITIES.index("output_frequency")
SCALE_ENDS = (60.0, 120.0, 200.0, 400.0, 600.0, 1200.0)
"""Ends of the scale in Hz, the same for all drives of the list."""
CLOCK_SET_BY = 0.5
"""Seconds by which the computer's clock must be set for the curves to follow it."""
LOST_SIGN = "×"


class CurveCells(NamedTuple):
    """Size of each curve in cells, and the characters that draw it."""

    columns: int
    rows: int
    signs: CurveSigns = BRAILLE


@dataclass(slots=True)
class _Series:
    """Output frequency of one drive on the page; drawn again only if it has changed."""

    console: DriveConsole
    last: TrendPoint | None
    start: float
    samples: Samples
    highest: float
    lost: tuple[float, ...]
    """Times at which the drive stopped answering."""
    in_hertz: bool
    drawn: dict[tuple[object, ...], tuple[str, ...]] = field(default_factory=dict)


class WallCurves:
    """Draws the curves of all drives; keeps what has not changed since the last call."""

    def __init__(self) -> None:
        self._series: dict[int, _Series] = {}
        self._apart: float | None = None

    def draw(
        self,
        consoles: Iterable[DriveConsole],
        cells: CurveCells,
        *,
        now: float,
        wall: float,
        reach: float,
    ) -> tuple[Mapping[int, tuple[str, ...]], float]:
        """Return the rows of each drive's curve by address, and the end of their scale in Hz.

        `now` is monotonic, `wall` the same moment in seconds since 1970. Values more than `reach`
        seconds apart are not connected.
        """
        if self._apart is None or abs(wall - now - self._apart) > CLOCK_SET_BY:
            self._apart = wall - now
        start = page_start(now + self._apart, PAGE) - self._apart
        before = self._series
        self._series = {
            console.device: _series(console, start, before.get(console.device))
            for console in consoles
        }
        found = self._series.values()
        highest = max((item.highest for item in found if item.in_hertz), default=0.0)
        high = next((end for end in SCALE_ENDS if end >= highest), round_up(highest))
        return {
            device: _drawn(item, cells, high, reach) for device, item in self._series.items()
        }, high


def _series(console: DriveConsole, start: float, kept: _Series | None) -> _Series:
    last = console.monitor.last_point
    if kept is not None and kept.console is console and kept.last is last and kept.start == start:
        return kept
    parameter = readout_parameter(console.session.profile, "output_frequency")
    points = [p for p in console.monitor.trend if p.time >= start - PAGE.span]
    # the direction is in the state's words: a curve below zero would have no room
    samples = [(p.time, None if (v := p.values[FREQUENCY]) is None else abs(v)) for p in points]
    shown = [value for time, value in samples if value is not None and time >= start]
    return _Series(
        console,
        last,
        start,
        samples,
        max(shown, default=0.0),
        tuple(point.time for point in points if point.mark == "lost"),
        parameter is not None and parameter.unit == "Hz",
    )


def _drawn(series: _Series, cells: CurveCells, high: float, reach: float) -> tuple[str, ...]:
    if not series.in_hertz:
        high = round_up(series.highest)  # a raw value has a scale of its own
    key = cells, high, reach
    if key not in series.drawn:
        plot = Plot(
            series.start, PAGE.span, CurveScale(0.0, high), cells.columns, cells.rows, cells.signs
        )
        rows = curve_texts(Curve(series.samples, Style.null()), plot, reach)
        for time in series.lost:
            if (column := plot.column(time)) is not None:
                rows[0] = rows[0][:column] + LOST_SIGN + rows[0][column + 1 :]
        series.drawn = {key: tuple(rows)}
    return series.drawn[key]
