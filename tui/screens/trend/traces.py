"""Values of the bands: read from the record in a thread, and added as they are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity
from tui.safety import STALE_LEAST
from tui.session.console import DriveConsole
from tui.session.monitor.live_trace import LiveTrace
from tui.session.monitor.snapshot import stale_after
from tui.session.monitor.trend import readout_parameter
from tui.session.monitor.trend_bands import TrendBand
from tui.session.record.columns import HistoryColumn, gaps_of, history_columns, reach_of_points
from tui.session.record.decoding import NO_GOOD_REPLY, HistoryPoint, curve_unit
from tui.session.record.history import History, read_history
from tui.session.shown import Shown

MOST_POINTS = 6000
"""Points of a band; more are reduced to COMPACT_COLUMNS."""
COMPACT_COLUMNS = 2000
DRAWN_REFERENCES: dict[Quantity, Quantity] = {
    "output_frequency": "frequency_reference",
    "speed": "speed_reference",
}
"""Quantities that have a reference, which is drawn with them."""
DRIVE_NOT_OPEN = "drive {} is not open on this line"
NO_PARAMETER = "the profile has no {}"
BAND_NOT_READ = "not read: {}"


@dataclass(slots=True)
class BandTrace:
    """One band with its values, oldest first; for the panel's event loop."""

    band: TrendBand
    console: DriveConsole | None
    live: LiveTrace | None = None
    points: list[HistoryPoint] = field(default_factory=list)
    loaded: bool = False
    """True once the record of the page was read."""
    unit: str = ""
    troubles: Sequence[str] = ()
    """Reasons why values of the record are missing or may differ."""
    scale: tuple[float, float] | None = None
    """Least and greatest value of the axis."""
    reference: BandTrace | None = None
    """The reference of the value, in the same unit."""

    @property
    def entry(self) -> Parameter | None:
        """The parameter, by the profile that this program uses; None if it has none."""
        return self.console.session.profile.get(self.band.code) if self.console else None

    def reading(self, moment: float) -> Shown | None:
        """Return the latest reading with its quality at a monotonic time; None without any."""
        latest = self.console.monitor.latest if self.console else None
        if latest is None or (found := latest.readings.get(self.band.code)) is None:
            return None
        return found.aged(moment, max(stale_after(latest.period), STALE_LEAST))

    @property
    def trouble(self) -> str:
        """Why the band is not read now; empty if it is."""
        if self.console is None:
            return BAND_NOT_READ.format(DRIVE_NOT_OPEN.format(self.band.device))
        if self.entry is None:
            return BAND_NOT_READ.format(NO_PARAMETER.format(self.band.code))
        latest = self.console.monitor.latest
        if latest is not None and latest.error:
            return BAND_NOT_READ.format(latest.error)
        reading = latest.readings.get(self.band.code) if latest is not None else None
        if reading is not None and reading.raw is None:
            return BAND_NOT_READ.format(reading.error or "no value")
        return ""

    def take(self, history: History) -> None:
        """Take what was read from the record, and what was read live since."""
        self.points = list(history.points)
        self.troubles = history.troubles
        self.unit = history.unit or self.unit
        self.loaded = True

    def add_live(self, start: float, span: float) -> None:
        """Add the values that were read since the last one; keep those of the page."""
        if self.live is None:
            return
        since = self.points[-1].end if self.points else 0.0
        self.points += self.live.points(self.band.code, since + 1e-3)
        if not self.unit and self.console is not None and self.entry is not None:
            session = self.console.session
            self.unit = curve_unit(session.profile, self.entry, session.image.trusted)
        before = next((at for at, point in enumerate(self.points) if point.end >= start), 0)
        del self.points[: max(0, before - 1)]
        if len(self.points) > MOST_POINTS:
            self.points = compacted(self.points, start, span)
        if self.reference is not None:
            self.reference.add_live(start, span)

    def close(self) -> None:
        """Read it no longer."""
        if self.live is not None:
            self.live.close()
            self.live = None


def reference_code(profile: Profile, entry: Parameter | None) -> str | None:
    """Return the code of the reference of a value; None if it has none in its unit."""
    for quantity, other in DRAWN_REFERENCES.items():
        drawn, reference = readout_parameter(profile, quantity), readout_parameter(profile, other)
        # equal, not the same: the profile may have been read anew
        if drawn is not None and drawn == entry and reference is not None:
            return reference.code if reference.unit == drawn.unit else None
    return None


def compacted(points: Sequence[HistoryPoint], start: float, span: float) -> list[HistoryPoint]:
    """Return points as COMPACT_COLUMNS of a page with minimum, mean and maximum, marked as reduced.

    Gaps stay gaps.
    """
    width = span / COMPACT_COLUMNS
    found = [
        HistoryPoint(begin, end, None, None, None, NO_GOOD_REPLY, 0, 1)
        for begin, end in gaps_of(points, reach_of_points(points))
        if end - begin > width
    ]
    for place, column in enumerate(history_columns(points, start, span, COMPACT_COLUMNS)):
        if column is not None:
            at = start + place * width
            found.append(
                HistoryPoint(
                    at,
                    at + width * 0.99,
                    column.least,
                    column.mean,
                    column.most,
                    good=column.good,
                    bad=column.bad,
                    reduced=True,
                    exact=column.exact,
                )
            )
    return sorted(found, key=lambda point: point.time)


@dataclass(frozen=True, slots=True)
class MarkValues:
    """Values at the marks, and of the time between them."""

    at_a: HistoryPoint | None
    at_b: HistoryPoint | None
    between: HistoryColumn | None


def value_at(points: Sequence[HistoryPoint], moment: float, reach: float) -> HistoryPoint | None:
    """Return the last point up to a moment, at most `reach` old; None if it has no value."""
    last = None
    for point in points:
        if point.time > moment:
            break
        last = point
    if last is None or last.mean is None or moment - last.end > reach:
        return None
    return last


def mark_values(
    points: Sequence[HistoryPoint], mark_a: float, mark_b: float, reach: float
) -> MarkValues:
    """Return the values at both marks, and the extent of the values from one to the other.

    The value at the earlier mark is one of them.
    """
    first, last = sorted((mark_a, mark_b))
    begin = value_at(points, first, reach)
    inside = [point for point in points if point.end >= first and point.time <= last]
    if begin is not None and begin not in inside:
        inside.insert(0, begin)
    start = min(point.time for point in inside) if inside else first
    (between,) = history_columns(inside, start, (last - start) + 1e-3, 1)
    return MarkValues(value_at(points, mark_a, reach), value_at(points, mark_b, reach), between)


def read_traces(
    files: Sequence[Path], wanted: Sequence[BandTrace], since: float, until: float
) -> list[History]:
    """Read the record of some bands; in a thread. `until` is included."""
    found = []
    for trace in wanted:
        own = trace.console.session.profile if trace.console else None
        band = trace.band
        found.append(read_history(files, *band, since, until + 1e-3, own=own))
    return found


def reach_of_trace(trace: BandTrace) -> float:
    """Return the longest time between two values without a gap, in seconds."""
    return max(reach_of_points(trace.points), 0.1)
