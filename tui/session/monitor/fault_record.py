"""Record of a trip: the values and this program's writes in the seconds before it.

It is taken when the drive trips, and kept until the next trip.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime

from tui.drive.causes import KnownValues
from tui.drive.hints import advice, hint_markdown, reset_text
from tui.drive.plain import markdown_table, plain
from tui.drive.profile.schema import FaultCode
from tui.drive.values import NOT_AVAILABLE

from ..drive import DriveSession
from ..journal import Entry, Journal
from ..shown import Quality, Shown
from .snapshot import Snapshot
from .trend import TrendPoint, trend_codes, trend_values

SECONDS_KEPT = 30.0
"""Seconds before a trip that are kept."""
TRIP_NEAR = 2.0
"""Seconds between a value and the last cycle before a trip for it to count as that of the trip."""

SAME_RECORD = 5.0
"""Seconds between two records of the same trip."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Values of one cycle: `time` is monotonic, `wall` in seconds since 1970."""

    time: float
    wall: float
    state: str
    texts: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FaultRecord:
    """A trip and the seconds before it."""

    time: float
    """When the fault was first read (monotonic)."""
    wall: float
    fault: FaultCode | None
    codes: tuple[str, ...]
    """Codes of the values in each moment, in the order of its texts."""
    headings: tuple[str, ...]
    moments: tuple[Moment, ...]
    writes: tuple[Entry, ...]
    """Writes to the drive in these seconds, oldest first."""
    before: Mapping[str, Shown] = field(default_factory=dict)
    """Last values before the trip, by code, also those of the slow rate."""
    points: tuple[TrendPoint, ...] = ()
    """Curves of these seconds, oldest first; the last point is the trip."""
    period: float = 0.0
    """Seconds from one cycle to the next at the trip."""

    @property
    def raws(self) -> dict[str, int]:
        """Raw values that were good and at most TRIP_NEAR old in the last cycle before the trip."""
        last = max((reading.time for reading in self.before.values()), default=0.0)
        return {
            code: reading.raw
            for code, reading in self.before.items()
            if reading.quality is Quality.GOOD
            and reading.raw is not None
            and reading.age(last) <= TRIP_NEAR
        }


@dataclass(slots=True)
class Recorder:
    """Records the trips of one drive from its monitor's snapshots."""

    session: DriveSession
    journal: Journal
    latest: FaultRecord | None = None
    """Last trip that occurred while the drive was monitored."""
    seen: bool = True
    """True if a person has viewed it."""
    since: float | None = None
    """When this program first read the drive (monotonic); None before."""
    _moments: deque[tuple[Snapshot, float]] = field(default_factory=deque)
    _kind: str = "unknown"

    def take(self, snapshot: Snapshot) -> None:
        """Keep a snapshot; the first one of a fault creates the record. In the line's thread."""
        if not snapshot.error and snapshot.state.kind == "unknown":
            return
        if self.since is None:
            if snapshot.error:
                return
            self.since = snapshot.time
        self._moments.append((snapshot, snapshot.time))
        while self._moments[0][1] < snapshot.time - SECONDS_KEPT:
            self._moments.popleft()
        if snapshot.error:
            return
        before, self._kind = self._kind, snapshot.state.kind
        if self._kind == "fault" and before not in ("fault", "unknown"):
            self.latest = self._freeze(snapshot)
            self.seen = False
        elif self._kind == "fault" and self.latest is not None and self.latest.fault is None:
            # the fault code may be read a cycle after the state
            self.latest = replace(self.latest, fault=snapshot.state.fault)

    def _freeze(self, now: Snapshot) -> FaultRecord:
        codes = record_codes(self.session)
        profile = self.session.profile
        headings = tuple(f"{c} {profile[c].unit}".rstrip() for c in codes)
        begin = datetime.fromtimestamp(now.wall - SECONDS_KEPT).astimezone()
        writes = tuple(
            entry
            for entry in self.journal.recent
            if entry.device == self.session.device
            and entry.line == self.session.line_text
            and datetime.fromisoformat(entry.time) >= begin
        )
        moments = tuple(
            Moment(s.time, s.wall, *_state_and_texts(s, codes)) for s, _ in self._moments
        )
        known = [s for s, _ in self._moments if not s.error]
        earlier = [snapshot for snapshot in known if snapshot is not now]
        before = earlier[-1].readings if earlier else {}
        curve = trend_codes(profile)
        points = tuple(TrendPoint(s.time, trend_values(curve, s)) for s in known)
        return FaultRecord(
            now.time, now.wall, now.state.fault, codes, headings, moments, writes, before,
            points, now.period,
        )  # fmt: skip

    def recall(self, record: FaultRecord) -> None:
        """Take the record of an earlier trip, unless there was another one since."""
        if self.latest is None or self.latest.time < record.time + SAME_RECORD:
            self.latest = record

    def acknowledge(self) -> None:
        """Note that a person has viewed the record."""
        self.seen = True


def record_codes(session: DriveSession) -> tuple[str, ...]:
    """Return the codes of a record: values of the monitoring set that are read in each cycle."""
    values = session.profile.data.monitoring.values
    return tuple(value.parameter for value in values if value.rate == "fast")


def _text(reading: Shown | None) -> str:
    if reading is None:
        return NOT_AVAILABLE
    return reading.drawn(
        reading.time,
        current=lambda value: value.text,
        old=lambda value, age: NOT_AVAILABLE,
        missing=NOT_AVAILABLE,
    )


NO_ANSWER_STATE = "no answer"


def _state_and_texts(snapshot: Snapshot, codes: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """Return the state and the values of a cycle; none of a cycle without an answer."""
    if snapshot.error:
        return NO_ANSWER_STATE, (NOT_AVAILABLE,) * len(codes)
    return snapshot.state.headline, tuple(_text(snapshot.readings.get(code)) for code in codes)


def record_text(
    session: DriveSession,
    record: FaultRecord,
    stored: Sequence[tuple[str, str, str]],
    values: Mapping[str, str] | None = None,
    known: KnownValues | None = None,
) -> str:
    """Format a record as Markdown: fault, likely causes, the drive's stored data, values, writes.

    `stored` lists code, name and value of the drive's own data about its last fault. `values` maps
    codes to the texts of parameters that the causes mention, and `known` weighs these causes;
    without it only the values before the trip do.
    """
    fault = record.fault
    name = (
        f"{fault.code} ({fault.raw}) {fault.name}" if fault else "a fault whose code was not read"
    )
    identity = session.identity
    who = " ".join(x for x in (identity.reference, identity.name) if x) if identity else ""
    lines = [
        f"# Trip of device {session.device}: {name}",
        "",
        f"- Time: {_clock(record.wall)}, {datetime.fromtimestamp(record.wall):%Y-%m-%d}",
        f"- Drive: {session.profile.name} {who}".rstrip(),
        f"- Line: {session.line_text}",
    ]
    lines += [f"- Cause: {fault.cause}"] if fault and fault.cause else []
    lines += [f"- Remedy: {fault.remedy}"] if fault and fault.remedy else []
    lines += _pointed_at(session, fault, values or {}, known or KnownValues(before=record.raws))
    if stored:
        lines += ["", "## Stored by the drive", ""]
        lines += markdown_table(("code", "name", "value"), stored)
    lines += ["", f"## Values of the last {SECONDS_KEPT:g} s", ""]
    lines.append(f"| time | state | {' | '.join(record.headings)} |")
    lines.append("|---|---|" + "---:|" * len(record.headings))
    lines += [f"| {_clock(m.wall)} | {m.state} | {' | '.join(m.texts)} |" for m in record.moments]
    lines += ["", f"## Writes by Drive Panel in the last {SECONDS_KEPT:g} s", ""]
    head = ("time", "code", "old", "new", "answer", "why")
    rows = [(e.time[11:23], e.code, e.old, e.new, e.answer, e.why) for e in record.writes]
    lines += markdown_table(head, rows) if rows else ["Nothing."]
    return plain("\n".join(lines) + "\n", lines=True)


def _pointed_at(
    session: DriveSession, fault: FaultCode | None, values: Mapping[str, str], known: KnownValues
) -> list[str]:
    """Return the likely causes of the fault as Markdown lines; empty if none are known."""
    help_ = session.profile.guide.fault(fault.raw if fault else None)
    if help_ is None:
        return []
    reported = hint_markdown(
        session.profile,
        help_,
        advice(session.profile, help_, known),
        lambda code: values.get(code, NOT_AVAILABLE),
        reset_text(help_, None, "a fault reset").text,
    )
    return ["", "## What it points at", "", *reported]


def _clock(wall: float) -> str:
    return f"{datetime.fromtimestamp(wall):%H:%M:%S.%f}"[:12]


def record_name(session: DriveSession, record: FaultRecord) -> str:
    """A file name for a record."""
    when = time.strftime("%Y%m%d-%H%M%S", time.localtime(record.wall))
    fault = record.fault.code if record.fault else "fault"
    safe = "".join(c for c in fault if c.isalnum())
    return f"trip-{session.profile.id}-{session.device}-{when}-{safe}.md"
