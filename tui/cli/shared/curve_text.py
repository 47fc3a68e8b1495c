"""Curves of a report as text, with the characters that the panel draws with."""

from __future__ import annotations

import codecs
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.session.report_trends import ReportTrend
    from tui.widgets.curve import CurveSigns, Samples

CURVE_COLUMNS, CURVE_ROWS = 64, 7
CURVE_LABEL_CELLS = 7


def curve_text(trend: ReportTrend) -> list[str]:
    """Return the curves of frequency and current as a code block, one below the other.

    They are made of ASCII characters if the output has no others.
    """
    from tui.widgets.curve import curve_signs

    points = trend.curve.points
    hertz = [(point.time, point.hertz) for point in points]
    amperes = [(point.time, point.amperes) for point in points]
    is_utf = codecs.lookup(output_encoding()).name.startswith("utf")
    signs = curve_signs(plain=not is_utf, braille=True)
    lines = ["```", *_curve_rows(hertz, "Hz", trend, signs)]
    if any(value is not None for _, value in amperes):
        lines += _curve_rows(amperes, "A", trend, signs)
    return [*lines, *_axis(trend), "```"]


def output_encoding() -> str:
    """The encoding of standard output."""
    return sys.stdout.encoding or "ascii"


def _curve_rows(samples: Samples, unit: str, trend: ReportTrend, signs: CurveSigns) -> list[str]:
    """The rows of one curve, with the ends of its scale at the left."""
    from rich.style import Style

    from tui.widgets.curve import Curve, Plot, curve_texts, round_up, scale_of

    values = [value for _, value in samples if value is not None]
    high = round_up(max(map(abs, values)))
    scale = scale_of(-high if min(values) < 0 else 0.0, high, CURVE_ROWS)
    start, end = trend.curve.points[0].time, trend.curve.points[-1].time
    # a little longer, so that the last value is inside
    span = (end - start) * (1 + 0.5 / CURVE_COLUMNS)
    plot = Plot(start, span, scale, CURVE_COLUMNS, CURVE_ROWS, signs)
    labels = {plot.row(value): f"{value:g} {unit}" for value in (scale.low, scale.high)}
    rows = curve_texts(Curve(samples, Style()), plot, trend.reach)
    return [
        f"{labels.get(number, ''):>{CURVE_LABEL_CELLS}} {row}".rstrip()
        for number, row in enumerate(rows)
    ]


def _axis(trend: ReportTrend) -> list[str]:
    """The times of both ends below them, and those of the marks."""
    from tui.session.changes import local_time

    first, last = (local_time(trend.curve.points[at].time) for at in (0, -1))
    ends = f"{first:%H:%M:%S}", f"{last:%H:%M:%S}"
    line = f"{'':>{CURVE_LABEL_CELLS}} {ends[0]}{ends[1]:>{CURVE_COLUMNS - len(ends[0])}}"
    marks = [f"{text} at {local_time(time):%H:%M:%S}" for time, text in trend.curve.marks]
    return [line, *(f"{'':>{CURVE_LABEL_CELLS}} {mark}" for mark in marks)]
