"""Contents of Trend, and the places of moments in its columns; pure."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

from rich.style import Style

from tui.drive.profile.schema import Parameter
from tui.session.record.decoding import HistoryPoint
from tui.session.shown import Shown
from tui.widgets.curve import BRAILLE, CurveScale, CurveSigns, Plot
from tui.widgets.palette import ATTENTION, STRONG

from .event_list import TrendEvent
from .page import TrendPage
from .table import TableRow

AXIS_CELLS = 6
LATEST_CELLS = 8
"""Cells at the right of a curve for the latest value."""


@dataclass(frozen=True, slots=True)
class BandView:
    """One band, with what is drawn of it."""

    name: str
    """Code, after the address of the drive if the bands are of several drives."""
    title: str
    unit: str
    entry: Parameter | None
    digits: int
    points: Sequence[HistoryPoint]
    reach: float
    scale: tuple[float, float]
    reading: Shown | None
    trouble: str
    """Why it is not read now; empty if it is."""
    note: str
    row: TableRow
    reference: str = ""
    """Code of the reference; empty if none is drawn."""
    reference_points: Sequence[HistoryPoint] = ()


@dataclass(frozen=True, slots=True)
class TrendView:
    """Contents of the screen; times are in seconds since 1970."""

    bands: Sequence[BandView]
    selected: int
    page: TrendPage
    now: float
    moment: float
    """Now, on the monotonic clock."""
    events: Sequence[TrendEvent]
    """Of the page's drives, newest first."""
    event: int | None
    """Selected event while the events are open."""
    oldest: float | None = None
    """Begin of the record; None without any."""
    plain: bool = False
    lean: bool = False
    """True on a low-bandwidth link: no value is shown twice."""
    signs: CurveSigns = BRAILLE

    @property
    def start(self) -> float:
        """Start of the page."""
        return self.page.begins(self.now)


@dataclass(frozen=True, slots=True)
class TrendRoom:
    """Rows and columns of the parts."""

    columns: int
    """Cells of the curves."""
    rows: int
    """Of each curve."""
    clock: bool
    table: bool
    marks: bool
    line: bool
    """True if the clock times, the table, the marks and the last event have rows."""
    kept: bool
    """True if the overview of the record has a row."""
    events: int
    """Rows of the events below the curves, instead of the table; 0 without them."""
    side: bool
    """True if the events are at the right."""


def trend_plot(view: TrendView, room: TrendRoom, scale: CurveScale) -> Plot:
    return Plot(view.start, view.page.step.span, scale, room.columns, room.rows, view.signs)


def mark_places(view: TrendView, room: TrendRoom) -> dict[int, tuple[str, Style]]:
    """Return the columns of the marks and of the cursor, with their signs."""
    plot = trend_plot(view, room, CurveScale(0, 1))
    found = {}
    for moment, sign, style in (
        (view.page.mark_a, "A", ATTENTION),
        (view.page.mark_b, "B", ATTENTION),
        (view.page.cursor, "*" if view.plain else "◆", STRONG),
    ):
        column = None if moment is None else plot.column(moment)
        if column is not None:
            found[column] = sign, style
    return found


def clock_of(wall: float, *, day: bool = False) -> str:
    """Return the local time of day with hundredths; with the date if `day`."""
    hundredths = math.floor(wall * 100 + 1e-6)
    form = "%m-%d %H:%M:%S" if day else "%H:%M:%S"
    clock = time.strftime(form, time.localtime(hundredths // 100))
    return f"{clock}.{hundredths % 100:02}"
