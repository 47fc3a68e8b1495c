"""Curves of the seconds before a trip, beside the values at it; pure functions."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.safety import STALE_CYCLES
from tui.session.monitor.fault_record import FaultRecord
from tui.session.monitor.trend import REFERENCE_PLACE, TREND_QUANTITIES, readout_parameter
from tui.widgets.curve import Curve, CurveScale, Plot, curve_rows, round_up, scale_of
from tui.widgets.drawing import short
from tui.widgets.palette import ATTENTION, BAR, FAINT, FAULT, KEY, LINE, STRONG, TITLE

from .doctor_view import DoctorView

CURVE_LEAST, CURVE_MOST = 27, 60
"""Columns of the curves with their labels."""
LEAST_WIDTH = 80
"""Least columns of the page for curves beside the values."""
LEAST_ROWS = 6
"""Least rows for two curves, with the heading and the axis."""
SECONDS_BEFORE = 10.0
LABEL_CELLS, UNIT_CELLS = 4, 4


class TripBand(NamedTuple):
    """One curve: the place of its values in a point, its unit and style."""

    place: int
    unit: str
    style: Style


def trip_curve_width(view: DoctorView, width: int) -> int:
    """Return the columns of the curves; 0 without a recorded trip, or on a narrow terminal."""
    if width < LEAST_WIDTH or view.record is None or not _bands(view, view.record):
        return 0
    return max(CURVE_LEAST, min(CURVE_MOST, width // 3))


def trip_curve_lines(view: DoctorView, width: int, rows: int) -> list[Text]:
    """Return exactly `rows` rows, LEAST_ROWS at least: the heading, the curves and their axis."""
    assert view.record is not None
    bands = _bands(view, view.record)
    space, lines = rows - 2, [_heading(width)]
    for left in range(len(bands), 0, -1):
        height = -(-space // left)
        space -= height
        lines += _band_lines(
            view, view.record, bands[-left], _plot(view, view.record, width, height)
        )
    return [*lines, _axis(view.record, _plot(view, view.record, width, 1))]


def _bands(view: DoctorView, record: FaultRecord) -> list[TripBand]:
    """Return the curves that have at least two values in these seconds."""
    found = []
    for quantity, style in (("output_frequency", STRONG), ("motor_current", BAR)):
        place, start = TREND_QUANTITIES.index(quantity), record.time - SECONDS_BEFORE
        seen = [p for p in record.points if p.time >= start and p.values[place] is not None]
        parameter = readout_parameter(view.profile, TREND_QUANTITIES[place])
        if parameter is not None and len(seen) > 1:
            found.append(TripBand(place, parameter.unit or "raw", style))
    return found


def _plot(view: DoctorView, record: FaultRecord, width: int, rows: int) -> Plot:
    """Return the plot whose last column has the trip; the scale follows."""
    columns = width - LABEL_CELLS - 1 - UNIT_CELLS
    # a little longer than that column, so that rounding errors do not put the trip outside
    span = SECONDS_BEFORE * columns / (columns - 0.5)
    return Plot(record.time - SECONDS_BEFORE, span, CurveScale(0, 1), columns, rows, view.signs)


def _heading(width: int) -> Text:
    title = f" the {SECONDS_BEFORE:g} s before it "
    text = Text("──", LINE, no_wrap=True).append(title, TITLE)
    return text.append("─" * (width - text.cell_len), LINE)


def _band_lines(view: DoctorView, record: FaultRecord, band: TripBand, plot: Plot) -> list[Text]:
    """Return the rows of one quantity, with its ends at the left and its unit at the right."""
    points = [point for point in record.points if point.time >= plot.start]
    curves = [Curve([(p.time, p.values[band.place]) for p in points], band.style)]
    if band.place == 0:
        reference = [(p.time, p.values[REFERENCE_PLACE]) for p in points]
        curves.append(Curve(reference, Style(color=KEY.color), held=True))
    seen = [value for curve in curves for _, value in curve.samples if value is not None]
    high = round_up(max(map(abs, seen)))
    plot = replace(plot, scale=scale_of(-high if min(seen) < 0 else 0.0, high, plot.rows))
    labels = {plot.row(value): f"{value:g}" for value in plot.scale.labels}
    lines = []
    for row, cells in enumerate(curve_rows(curves, plot, STALE_CYCLES * record.period)):
        label = labels.get(row, "")
        line = Text(f"{short(label, LABEL_CELLS):>{LABEL_CELLS}}", FAINT, no_wrap=True)
        line.append("┤" if label else "│", LINE).append_text(cells)
        unit = short(band.unit, UNIT_CELLS - 1) if row == 0 else ""
        lines.append(line.append(f" {unit:<{UNIT_CELLS - 1}}", FAINT))
    return lines


def _axis(record: FaultRecord, plot: Plot) -> Text:
    """Return the axis, with the writes of Drive Panel and the trip at its end."""
    cells = [("─", LINE)] * plot.columns
    for entry in record.writes:
        before = record.wall - datetime.fromisoformat(entry.time).timestamp()
        if (column := plot.column(record.time - before)) is not None:
            cells[column] = ("●", ATTENTION)
    cells[-1] = ("■", FAULT)
    axis = Text(" " * LABEL_CELLS, no_wrap=True).append("└", LINE)
    for style, run in groupby(cells, key=itemgetter(1)):
        axis.append("".join(character for character, _ in run), style)
    return axis.append(" " * UNIT_CELLS)
