"""Runs of motors, trips and lost links in a record: from the status words that were read.

A run is known as exactly as the status word was read: rows that are older than an hour give its
times to 10 s. A shorter one may be missing there. Times are in seconds since 1970.
"""

from __future__ import annotations

import json
import sqlite3
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

from tui.drive.chart import ENABLED_KINDS, state_of
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Chart, Quantity, StateKind

from .decoding import HistoryPoint, joined_points
from .history import History, number_text, read_history
from .reader import RecordReader
from .schema import EventRow, RecordDamaged, to_microseconds
from .silences import LostLink, whole_silences, word_silences

UNREAD_FOR = 60.0
"""Seconds without a reading of the status word after which a run is not known."""
READ_AFTER = 2.0
"""Seconds after the last status word in which the fault word of the same cycle is read."""
COMMANDED_BEFORE = 10.0
"""Seconds before a run in which the write that began it is searched."""
RUN_REFERENCES: tuple[Quantity, ...] = (
    "frequency_reference",
    "speed_reference",
    "command_frequency",
    "command_speed",
)
"""Quantities of a reference; the first that was read during a run gives its reference."""


class RecordedRun(NamedTuple):
    """One run of a motor, until it was at standstill."""

    device: int
    profile: str
    begun: float
    ended: float
    begin_within: float | None
    """Seconds by which `begun` may be wrong. None: it ran when first read."""
    end_within: float | None
    """Seconds by which `ended` may be wrong. None: it ran when last read."""
    direction: str = ""
    reference: str = ""
    """The reference at the begin, with its unit; empty if it was not read.

    It has no sign if the direction is reverse, unless the sign changed during the run.
    """
    least: str = ""
    most: str = ""
    """Extent of the reference during the run; empty if it did not change."""
    who: str = ""
    """The program that wrote the command; empty if no program on the line did."""


class RecordedTrip(NamedTuple):
    """A fault of a drive, from its first reading to its end."""

    device: int
    profile: str
    raw: int | None
    """The raw fault code; None if it was not read."""
    code: str
    name: str
    begun: float
    ended: float | None
    """None if the drive was in fault when last read."""
    within: float | None
    """Seconds by which `begun` may be wrong. None: it was in fault when first read."""
    end_within: float | None = None
    """Seconds by which `ended` may be wrong: the drive may have been reset while it was lost."""


class DriveHistory(NamedTuple):
    """Runs, trips and lost links of one drive, each part oldest first."""

    runs: Sequence[RecordedRun] = ()
    trips: Sequence[RecordedTrip] = ()
    losses: Sequence[LostLink] = ()


class _Span(NamedTuple):
    """A time in which a drive was in states of some kinds."""

    begun: float
    ended: float
    begin_within: float | None
    words: Counter[int]
    """Words of that kind, with the number of their readings."""
    commanded: float = 0.0
    """End of the last reply that showed it running, not stopping."""
    mixed: bool = False
    """True if the last reduced row has a status word at rest too."""
    end_within: float | None = None


@dataclass(slots=True)
class RecordEvents:
    """All events of a line's files, the oldest first, and why files could not be read."""

    files: list[Path] = field(default_factory=list)
    """Files that can be read."""
    line: str = ""
    """The line as text, as the last file has it."""
    events: list[EventRow] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)

    def of(self, kind: str, device: int | None = None) -> Iterator[EventRow]:
        """Yield the events of a kind; of one drive if `device` is not None."""
        for event in self.events:
            if event.kind == kind and device in (None, event.device):
                yield event

    @property
    def profiles(self) -> dict[int, str]:
        """Profile ids of the drives; the last one of each."""
        found: dict[int, str] = {}
        for event in self.of("profile"):
            with suppress(ValueError, TypeError, KeyError):
                if event.device is not None:
                    found[event.device] = str(json.loads(event.text)["profile"])
        return found


def read_events(files: Sequence[Path]) -> RecordEvents:
    """Read the events of the files of a line, the oldest first."""
    found = RecordEvents()
    for path in files:
        try:
            with closing(RecordReader(path)) as reader:
                found.events += reader.events(-(1 << 62), 1 << 62)
                found.line = reader.line
            found.files.append(path)
        except (OSError, sqlite3.Error) as error:
            text = str(error)
            found.unread.append(text if text.startswith(str(path)) else f"{path}: {text}")
    return found


def history_of(
    line: RecordEvents, device: int, profile_id: str, since: float, until: float
) -> DriveHistory:
    """Return the runs and trips of a drive, and the times in which it did not answer.

    Nothing is found with a profile that cannot be loaded, or that has no chart.
    """
    try:
        profile = library.load(profile_id)
    except (DriveError, OSError):
        return DriveHistory()

    def read(code: str) -> Sequence[HistoryPoint]:
        return read_history(line.files, device, code, since, until).points

    selecting = {item.when.parameter for item in profile.data.charts if item.when is not None}
    words = {code: raws[-1] for code in selecting if (raws := _raws(read(code)))}
    chart = profile.chart(words)
    if chart is None:
        return DriveHistory()
    points = states = read(chart.status)
    for place, code in enumerate(chart.status_codes[1:], 1):
        states = list(joined_points(states, read(code), 32 * place))
    kinds = partial(_kind_of, chart)
    spans = list(_spans(states, kinds, ENABLED_KINDS))
    references = _references(line.files, device, profile, spans)
    runs = [_described(line, device, profile, chart, references, span) for span in spans]
    faults = read(profile.data.faults.parameter)
    trips = list(_trips(device, profile, states, kinds, faults))
    losses = list(word_silences(device, points))
    losses += [
        each
        for each in whole_silences(line.files, device, since, until)
        if not any(each.begun <= (loss.ended or until) and loss.begun <= (each.ended or until)
                   for loss in losses)
    ]  # fmt: skip
    return DriveHistory(runs, trips, sorted(losses, key=lambda loss: loss.begun))


def _kind_of(chart: Chart, word: int) -> StateKind:
    codes = enumerate(chart.status_codes)
    return state_of(chart, {code: word >> 32 * at & 0xFFFFFFFF for at, code in codes}).kind


def _trips(
    device: int,
    profile: Profile,
    points: Sequence[HistoryPoint],
    kind_of: Callable[[int], StateKind],
    faults: Sequence[HistoryPoint],
) -> Iterator[RecordedTrip]:
    """Yield the trips; `points` are those of the status word, `faults` those of the fault word.

    A fault word that shows present faults decides, if it was read; else the status word does.
    """
    about = profile.data.faults

    def kind_of_fault(word: int) -> StateKind:
        return "ready" if word == about.none else "fault"

    if not about.shows_last and any(point.least is not None for point in faults):
        points, kind_of = faults, kind_of_fault
    times = [point.time for point in faults]
    for span in _spans(points, kind_of, {"fault"}):
        until = span.ended if span.end_within is not None else span.ended + READ_AFTER
        first = bisect_left(times, span.begun), bisect_left(times, until)
        codes = [raw for raw in _raws(faults[slice(*first)]) if raw != about.none]
        raw = codes[-1] if codes else None
        found = None if raw is None else profile.fault(raw)
        code = found.code if found else "" if raw is None else f"code {raw}"
        ended = None if span.end_within is None else span.ended
        name = found.name if found else ""
        yield RecordedTrip(
            device, profile.id, raw, code, name, span.begun, ended, span.begin_within,
            span.end_within,
        )  # fmt: skip


def _raws(points: Iterable[HistoryPoint]) -> list[int]:
    """Return the raw values of whole points, and of reduced ones that did not change."""
    return [
        int(point.least)
        for point in points
        if point.least is not None and point.least == point.most
    ]


def lost_lines(line: RecordEvents) -> Iterator[LostLink]:
    """Yield the times in which a line was lost, the oldest first."""
    lost: tuple[float, str] | None = None
    for event in line.of("line"):
        state, _, reason = event.text.partition(" ")
        if state == "lost" and lost is None:
            lost = event.utc / 1e6, reason
        elif state in ("connected", "closed") and lost is not None:
            yield LostLink(None, lost[0], event.utc / 1e6, lost[1])
            lost = None
    if lost is not None:
        yield LostLink(None, lost[0], None, lost[1])


def _spans(
    points: Iterable[HistoryPoint],
    kind_of: Callable[[int], StateKind],
    wanted: Collection[StateKind],
) -> Iterator[_Span]:
    """Yield the times in which a word was of a wanted kind; `points` are those of the word."""
    span: _Span | None = None
    before: HistoryPoint | None = None
    for point in points:
        if point.least is None or point.most is None:
            continue
        words = int(point.least), int(point.most)
        kinds = {kind_of(word) for word in words} - {"unknown"}
        if not kinds:
            continue
        runs, rests = bool(kinds & set(wanted)), bool(kinds - set(wanted))
        if before is not None and point.time - before.end > UNREAD_FOR:
            if span is not None:
                yield span
            span = before = None
        if runs:
            if span is None:
                first = point.end if rests else point.time
                within = None if before is None else first - before.end
                span = _Span(point.time, point.end, within, Counter())
            span.words.update(word for word in words if kind_of(word) in wanted)
            commanded = point.end if "running" in kinds else span.commanded
            span = span._replace(ended=point.end, commanded=commanded, mixed=rests)
        elif span is not None:
            assert before is not None
            last = before.time if span.mixed else before.end
            yield span._replace(ended=point.time, end_within=point.time - last)
            span = None
        before = point
    if span is not None:
        yield span


def _described(
    line: RecordEvents,
    device: int,
    profile: Profile,
    chart: Chart,
    references: History,
    span: _Span,
) -> RecordedRun:
    """Return a run with its reference, and the program that began it."""
    who = ""
    if span.begin_within is not None and chart.command:
        command = profile[chart.command].place
        first = span.begun - span.begin_within - COMMANDED_BEFORE
        who = _last_writer(line.files, device, command, first, span.begun + span.begin_within)
    stops = [event.utc / 1e6 for event in line.of("stop", device)]
    until = min((span.commanded, *(stop for stop in stops if span.begun <= stop)))
    points = references.points
    times = bisect_left(points, span.begun, key=_time), bisect_left(points, until, key=_time)
    values = [point for point in points[slice(*times)] if point.least is not None]
    steady = [point for point in values if point.least == point.most]
    seen = [
        steady[0].least if steady else None,
        min((point.least for point in values if point.least is not None), default=None),
        max((point.most for point in values if point.most is not None), default=None),
    ]
    direction = _direction(chart, span.words)
    if direction == "reverse" and seen[2] is not None and seen[2] <= 0:
        # such a drive has the direction as the sign of its reference
        seen = [None if each is None else abs(each) for each in (seen[0], seen[2], seen[1])]
    at_begin, least, most = (_text(references, value) for value in seen)
    least, most = (least, most) if least != most else ("", "")
    return RecordedRun(
        device, profile.id, span.begun, span.ended, span.begin_within, span.end_within,
        direction, at_begin, least, most, who,
    )  # fmt: skip


def _time(point: HistoryPoint) -> float:
    return point.time


def _direction(chart: Chart, words: Counter[int]) -> str:
    """Return the direction of most words: a drive shows it only once the motor turns."""
    mark = chart.direction
    if mark is None or mark.parameter != chart.status:
        return ""
    reverse = [count for word, count in words.items() if word >> mark.bit & 1 == mark.reverse]
    return "reverse" if 2 * sum(reverse) >= words.total() else "forward"


def _references(
    files: Sequence[Path], device: int, profile: Profile, spans: Sequence[_Span]
) -> History:
    """Return the values of the reference that was read during the runs."""
    parameters = (profile.quantity(quantity) for quantity in RUN_REFERENCES if spans)
    for parameter in (item for item in parameters if item is not None):
        times = spans[0].begun, max(span.ended for span in spans)
        found = read_history(files, device, parameter.code, *times)
        if any(point.least is not None for point in found.points):
            return found
    return History(())


def _text(references: History, value: float | None) -> str:
    if value is None or references.entry is None:
        return ""
    return f"{number_text(references, value)} {references.unit}".rstrip()


def _last_writer(files: Sequence[Path], device: int, place: int, since: float, until: float) -> str:
    times = to_microseconds(since), to_microseconds(until) + 1
    for path in reversed(files):
        with suppress(RecordDamaged, OSError, sqlite3.Error), closing(RecordReader(path)) as reader:
            if who := reader.last_writer(device, place, *times):
                return who
    return ""
