"""Saving of a trend: its values as CSV, and a drawing as SVG; files are written in a thread."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from xml.sax.saxutils import escape

from tui.drive.plain import csv_text
from tui.session.record.decoding import HistoryPoint
from tui.session.record.history import History

from .contents import clock_of
from .traces import BandTrace, reach_of_trace, read_traces
from .view import scale_for

SAVED_TREND_AS = (
    "Every value of the page, or from mark A to B: as CSV, and a drawing beside it as SVG."
    " A reduced row has the minimum, mean and maximum of up to 10 s."
)
COLUMNS_OF_CSV = (
    "utc", "local", "drive", "code", "value", "unit", "quality", "min", "max", "replies", "reduced",
)  # fmt: skip
WIDTH, HEIGHT, LEFT, RIGHT, TOP = 1000, 160, 70, 20, 24
"""Of the drawing and of each band, in pixels."""


def save_trend(
    path: Path, files: Sequence[Path], traces: Sequence[BandTrace], since: float, until: float
) -> int:
    """Write both files, and return the number of values. Raises OSError, also if one exists."""
    found = read_traces(files, traces, since, until)
    merged = [points_of_time(*pair, since, until) for pair in zip(traces, found, strict=True)]
    drawing = path.with_suffix(".svg")
    if drawing.exists():
        raise FileExistsError(17, "The drawing exists already", str(drawing))
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.with_suffix(".csv").open("x", encoding="utf-8", newline="") as file:
        file.write(trend_csv(traces, merged))
    with drawing.open("x", encoding="utf-8") as file:
        file.write(svg_text(traces, merged, since, until))
    return sum(point.mean is not None for points in merged for point in points)


def points_of_time(
    trace: BandTrace, history: History, since: float, until: float
) -> list[HistoryPoint]:
    """Return the points of a time, with those that are not in the record yet."""
    points = [point for point in history.points if since <= point.end <= until]
    last = points[-1].end + 1e-3 if points else since
    live = trace.live.points(trace.band.code, last) if trace.live is not None else []
    return points + [point for point in live if since <= point.time <= until]


def trend_csv(traces: Sequence[BandTrace], points: Sequence[Sequence[HistoryPoint]]) -> str:
    """Return the rows of all bands, by time; a row without a value has its reason as quality."""
    table: list[Sequence[object]] = [COLUMNS_OF_CSV]
    rows = [
        (point.time, trace, point)
        for trace, found in zip(traces, points, strict=True)
        for point in found
    ]
    for _, trace, point in sorted(rows, key=lambda row: row[0]):
        utc = datetime.fromtimestamp(point.time, UTC)
        values = (point.mean, point.least, point.most)
        mean, least, most = ("" if value is None else f"{value:.10g}" for value in values)
        local = utc.astimezone().isoformat(timespec="milliseconds")
        first = utc.isoformat(timespec="milliseconds").replace("+00:00", "Z"), local
        last = point.quality, least, most, point.good, int(point.reduced)
        table.append((*first, *trace.band, mean, trace.unit, *last))
    return csv_text(table)


def svg_text(
    traces: Sequence[BandTrace],
    points: Sequence[Sequence[HistoryPoint]],
    since: float,
    until: float,
) -> str:
    """Return a drawing: a band for each parameter; a gap has no line."""
    span = max(until - since, 1e-3)
    height = TOP + HEIGHT * len(traces) + TOP
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}"'
        f' viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
    ]
    for number, (trace, found) in enumerate(zip(traces, points, strict=True)):
        parts += _band(trace, found, since, span, TOP + number * HEIGHT)
    for place in range(5):
        at = since + span * place / 4
        x = LEFT + (WIDTH - LEFT - RIGHT) * place / 4
        anchor = "start" if place == 0 else "end" if place == 4 else "middle"
        parts.append(
            f'<text x="{x:.0f}" y="{height - 8}" text-anchor="{anchor}">'
            f"{clock_of(at, day=place == 0)}</text>"
        )
    return "\n".join([*parts, "</svg>", ""])


def _band(
    trace: BandTrace, points: Sequence[HistoryPoint], since: float, span: float, top: int
) -> list[str]:
    low, high = scale_for(points, None)
    room = HEIGHT - 40

    def x(moment: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (moment - since) / span

    def y(value: float) -> float:
        return top + 20 + room * (high - value) / (high - low)

    title = f"{trace.band.device} {trace.band.code} {trace.entry.name if trace.entry else ''}"
    parts = [f'<text x="{LEFT}" y="{top + 12}">{escape(f"{title} {trace.unit}".strip())}</text>']
    parts += [
        f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(value):.1f}" y2="{y(value):.1f}"'
        ' stroke="#cccccc"/>'
        f'<text x="{LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:g}</text>'
        for value in (low, high)
    ]
    runs: list[list[HistoryPoint]] = [[]]
    reach = reach_of_trace(trace)
    for point in points:
        last = runs[-1][-1] if runs[-1] else None
        if point.mean is None or (last is not None and point.time - last.end > reach):
            runs.append([])
        if point.mean is not None:
            runs[-1].append(point)
    for run in filter(None, runs):
        line = " ".join(f"{x(point.time):.1f},{y(point.mean or 0.0):.1f}" for point in run)
        parts.append(f'<polyline points="{line}" fill="none" stroke="#1f5fa8"/>')
        parts += [
            f'<rect x="{x(point.time):.1f}" y="{y(point.most):.1f}"'
            f' width="{max(1.0, x(point.end) - x(point.time)):.1f}"'
            f' height="{max(1.0, y(point.least) - y(point.most)):.1f}"'
            ' fill="#1f5fa8" fill-opacity="0.25"/>'
            for point in run
            if point.reduced and point.least is not None and point.most is not None
        ]
    return parts
