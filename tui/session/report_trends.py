"""Curves of a report: the last trip and the last run of a drive, from the record of its line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Literal, NamedTuple

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity
from tui.drive.values import is_signed_type

from .acceptance.curve import RunCurve, RunPoint, curve_svg
from .changes import EXACT_WITHIN, local_time, run_text
from .journal import Entry
from .monitor.trend import readout_parameter
from .record.columns import reach_of_points
from .record.decoding import HistoryPoint
from .record.history import History, read_history
from .record.runs import RecordedRun, history_of, read_events
from .report import trips_of

SECONDS_BEFORE_TRIP, SECONDS_AFTER_TRIP = 60.0, 10.0
SECONDS_AROUND_RUN = 5.0
RUN_SOUGHT_FOR = 7 * 86400.0
"""Seconds before the report in which a run and a trip are searched."""
SAME_READING = 1.0
"""Most seconds between a frequency and the current beside it."""
TrendKind = Literal["trip", "run"]
TREND_KINDS: tuple[TrendKind, ...] = ("trip", "run")


class ReportTrend(NamedTuple):
    """Frequency and current around one event; the times of the curve are since 1970."""

    kind: TrendKind
    title: str
    curve: RunCurve
    reach: float
    """Longest time in seconds between two values without a gap."""
    remark: str = ""
    """A sentence about the values; empty if each reply is drawn."""


def report_trends(
    files: Sequence[Path], device: int, profile: Profile, entries: Iterable[Entry], now: float
) -> list[ReportTrend]:
    """Return the trends of the last trip and the last run, as far as they are recorded.

    `entries` are those of the drive in the journal; `now` is in seconds since 1970. It reads files.
    """
    shown = history_of(read_events(files), device, profile.id, now - RUN_SOUGHT_FOR, now)
    seen = (
        (trip.begun, trip.code, trip.name, trip.within)
        for trip in shown.trips
        if trip.within is not None
    )
    trip = max((*_journal_trips(entries), *seen), default=None)
    found = [
        _trip(files, device, profile, *trip) if trip else None,
        _run(files, device, profile, shown.runs[-1]) if shown.runs else None,
    ]
    return [trend for trend in found if trend is not None]


def _journal_trips(entries: Iterable[Entry]) -> Iterator[tuple[float, str, str, float]]:
    """Yield time, code, name and 0 of the last trip in the journal, if its time is valid."""
    for trip in trips_of(entry for entry in entries if entry.kind == "fault")[-1:]:
        with suppress(ValueError, OverflowError):
            yield datetime.fromisoformat(trip.tripped).timestamp(), trip.code, trip.name, 0.0


def _trip(
    files: Sequence[Path],
    device: int,
    profile: Profile,
    at: float,
    code: str,
    called: str,
    within: float,
) -> ReportTrend | None:
    """Return the seconds around a trip, whose time may be wrong by `within` seconds."""
    name = f"{code} {called}".strip()
    times = at - SECONDS_BEFORE_TRIP, at + SECONDS_AFTER_TRIP
    trend = _trend(files, device, profile, times)
    if trend is None:
        return None
    trend.curve.marks.append((at, code or "trip"))
    title = f"Trip {name}, {_when(at)}"
    if within > EXACT_WITHIN:
        title = f"{title} (time to {within:.0f} s)"
    return trend._replace(kind="trip", title=title)


def _run(
    files: Sequence[Path], device: int, profile: Profile, run: RecordedRun
) -> ReportTrend | None:
    """Return a run with the seconds around it."""
    times = run.begun - SECONDS_AROUND_RUN, run.ended + SECONDS_AROUND_RUN
    trend = _trend(files, device, profile, times, reverse=run.direction == "reverse")
    if trend is None:
        return None
    return trend._replace(title=f"{_when(run.begun)}: {run_text(run)}")


def _trend(
    files: Sequence[Path],
    device: int,
    profile: Profile,
    times: tuple[float, float],
    *,
    reverse: bool = False,
) -> ReportTrend | None:
    """Return the values of a time; None without two frequencies in Hz."""

    def read(quantity: Quantity, unit: str) -> History:
        parameter = readout_parameter(profile, quantity)
        if parameter is None:
            return History(())
        found = read_history(files, device, parameter.code, *times, own=profile)
        return found if found.unit == unit else History(())

    frequency, current = read("output_frequency", "Hz"), read("motor_current", "A")
    is_signed = frequency.entry is not None and is_signed_type(frequency.entry)
    sign = -1.0 if reverse and not is_signed else 1.0
    points = list(_points(frequency.points, current.points, sign))
    if len(points) < 2:
        return None
    reduced = any(point.reduced for point in frequency.points)
    remark = "Values older than an hour are means over up to 10 s." if reduced else ""
    reach = reach_of_points(frequency.points)
    return ReportTrend("run", "", RunCurve(profile, points), reach, remark)


def _points(
    frequency: Iterable[HistoryPoint], current: Sequence[HistoryPoint], sign: float
) -> Iterator[RunPoint]:
    """Yield each frequency with the current that was read nearest to it."""
    held = [point for point in current if point.mean is not None]
    at = 0
    for point in (point for point in frequency if point.mean is not None):
        while at + 1 < len(held) and abs(held[at + 1].time - point.time) <= abs(
            held[at].time - point.time
        ):
            at += 1
        near = bool(held) and abs(held[at].time - point.time) <= SAME_READING
        yield RunPoint(point.time, sign * (point.mean or 0.0), held[at].mean if near else None)


def trend_files(trends: Iterable[ReportTrend], stem: str) -> dict[TrendKind, tuple[str, str]]:
    """Return the name and the SVG of each curve, for a report with this stem of its name."""
    return {
        trend.kind: (trend_file(stem, trend.kind), curve_svg(trend.curve, trend.title, trend.reach))
        for trend in trends
    }


def trend_file(stem: str, kind: TrendKind) -> str:
    """Return the name of the file of a curve beside a report."""
    return f"{stem}-{kind}.svg"


def report_trend_lines(
    trends: Iterable[ReportTrend], drawings: Mapping[TrendKind, Sequence[str]]
) -> list[str]:
    """Return the part of a report about trends, as Markdown; `drawings` are lines by kind."""
    lines: list[str] = []
    for trend in trends:
        head = "Last trip" if trend.kind == "trip" else "Last run"
        lines += [f"## {head}", "", f"{trend.title}.", "", *drawings[trend.kind], ""]
        lines += [trend.remark, ""] if trend.remark else []
    return lines[:-1]


def linked(files: Mapping[TrendKind, tuple[str, str]]) -> dict[TrendKind, list[str]]:
    """Return the links to the files of the curves, by kind."""
    return {kind: [f"![Curve of the {kind}](<{name}>)"] for kind, (name, _) in files.items()}


def _when(seconds: float) -> str:
    return f"{local_time(seconds):%Y-%m-%d %H:%M:%S}"
