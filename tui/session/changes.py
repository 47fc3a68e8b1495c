"""Changes on the lines of this computer: writes, trips, timeout tests, runs, lost links.

Writes and tests come from the journal, runs and lost links from the record of each line. Trips come
from both: a program that shows no faults notes none in the journal.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, time, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from .connect.line_key import line_key
from .journal import RECORD_SHOWS_IT, Entry, Journal, entry_time
from .journal_reading import DamagedLine, completed, read_journal, selected, time_of
from .record.ring import DAMAGED_MARK, RECORD_SUFFIX, SECONDS_A_DAY, day_of_record

if TYPE_CHECKING:
    from .record.runs import RecordedRun, RecordedTrip, RecordEvents
    from .record.silences import LostLink
    from .report import Trip

_SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400, "w": 604800}
_AGO = re.compile(r"(\d{1,9})\s*([smhdw])")
TIME_EXAMPLES = "2h, 30m, 7d, 08:30, 2026-03-01, 2026-03-01T08:30"
RUN_SEARCHED = 86400.0
"""Seconds before the wanted time in which the begin of a run is searched."""
BEGIN_REPORTED_AFTER = 60.0
"""Seconds after the wanted time from which the begin of a record is reported."""
RECORD_BEGINS = (
    "Nothing of {line} is recorded before {time:%Y-%m-%d %H:%M:%S}:"
    " earlier runs and lost links are not known."
)
TRIP_NOTED_WITHIN = 5.0
"""Seconds between the reading of a fault and its entry in the journal, at most."""
_END_OF_TIME = 4e9
"""A time after all records, in seconds since 1970."""
EXACT_WITHIN = 1.0
"""Seconds up to which the times of a run or a trip count as exact."""


class LineRun(NamedTuple):
    """A run of a drive, with the line as its record names it."""

    line: str
    run: RecordedRun


class LineLoss(NamedTuple):
    """A lost link, with the line as its record names it."""

    line: str
    loss: LostLink


class DriveTrip(NamedTuple):
    """A trip of a drive, with the line as it was typed."""

    line: str
    device: int
    trip: Trip


Change = Entry | LineRun | LineLoss


@dataclass(slots=True)
class ChangeList:
    """Changes on the lines, each part oldest first."""

    entries: list[Entry] = field(default_factory=list)
    runs: list[LineRun] = field(default_factory=list)
    losses: list[LineLoss] = field(default_factory=list)
    damaged: list[DamagedLine] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    """Why records could not be read, with their files, and which do not reach far enough back."""
    has_more: bool = False
    """True if the journal has entries that were not selected."""

    @property
    def in_order(self) -> list[Change]:
        """All of them, oldest first. An entry without a valid time comes after the one before."""
        return _by_time([*self.entries, *self.runs, *self.losses])

    @property
    def trips(self) -> Iterator[DriveTrip]:
        """The trips of the entries, those of one drive after the other."""
        from .report import trips_of

        faults = [entry for entry in self.entries if entry.kind == "fault"]
        for line, device in dict.fromkeys((entry.line, entry.device) for entry in faults):
            own = [entry for entry in faults if (entry.line, entry.device) == (line, device)]
            yield from (DriveTrip(line, device, trip) for trip in trips_of(own))


ChangeOrEntry = TypeVar("ChangeOrEntry", Change, Entry)


def _by_time(changes: Iterable[ChangeOrEntry]) -> list[ChangeOrEntry]:
    last = datetime.min.replace(tzinfo=UTC)
    found: list[tuple[datetime, ChangeOrEntry]] = []
    for change in changes:
        last = time_of_change(change) or last
        found.append((last, change))
    return [change for _, change in sorted(found, key=lambda pair: pair[0])]


def parse_since(text: str, now: datetime) -> datetime | None:
    """Return the time that a text names; None if it names none. A time of day is the last one."""
    text = text.strip()
    try:
        if ago := _AGO.fullmatch(text):
            return now - timedelta(seconds=int(ago[1]) * _SECONDS[ago[2]])
        if re.fullmatch(r"\d\d?:\d\d(:\d\d)?", text):
            clock_time = time.fromisoformat(
                text.rjust(5, "0") if len(text) < 6 else text.rjust(8, "0")
            )
            then = datetime.combine(now.date(), clock_time).astimezone()
            return then if then <= now else then - timedelta(days=1)
        return datetime.fromisoformat(text).astimezone()
    except (ValueError, OverflowError, OSError):
        return None


def read_changes(
    folder: Path,
    *,
    device: int | None = None,
    lines: Sequence[str] = (),
    since: datetime | None = None,
    private: Mapping[str, Path] | None = None,
) -> ChangeList:
    """Read the changes from the journal and from the records in a folder.

    `lines` selects lines by one of their spellings; without any, all are read. `private` has
    folders of single lines by their texts. It takes some seconds for a full record. Raises OSError
    for a journal that cannot be read.
    """
    from .record.runs import read_events

    kept = list(read_journal(Journal().files))
    entries = completed(item for item in kept if isinstance(item, Entry))
    shown = selected(entries, device=device, lines=lines, since=since)
    found = ChangeList(entries=shown, has_more=len(shown) < len(entries))
    found.damaged = [item for item in kept if isinstance(item, DamagedLine)]
    keys = {line_key(line) for line in lines}
    begin = 0.0 if since is None else since.timestamp()
    for text, each in (("", folder), *(private or {}).items()):
        for paths in _files_by_line(each, begin - RUN_SEARCHED):
            _add_record(found, read_events(paths), text, device, keys, begin)
    found.entries = _by_time(found.entries)
    found.runs.sort(key=lambda item: item.run.begun)
    found.losses.sort(key=lambda item: item.loss.begun)
    return found


def _files_by_line(folder: Path, begin: float) -> Iterator[list[Path]]:
    """Yield the files of each line from a time on, the oldest first."""
    by_line: dict[str, list[Path]] = {}
    for path in sorted(folder.glob(f"*{RECORD_SUFFIX}")):
        day = day_of_record(path)
        is_damaged = DAMAGED_MARK in path.name
        if day is not None and day >= begin // SECONDS_A_DAY and not is_damaged:
            by_line.setdefault(path.name.partition("_")[2], []).append(path)
    yield from by_line.values()


def _add_record(
    found: ChangeList,
    record: RecordEvents,
    text: str,
    device: int | None,
    keys: Collection[str],
    begin: float,
) -> None:
    """Add what the record of one line shows; `text` is its name, if not that of the record."""
    found.unread += record.unread
    line = text or record.line
    if not record.files or (keys and line_key(line) not in keys):
        return
    from .record.history import oldest_reply
    from .record.runs import history_of, lost_lines

    oldest = oldest_reply(record.files, record.profiles)
    if begin and oldest is not None and oldest - begin > BEGIN_REPORTED_AFTER:
        found.unread.append(RECORD_BEGINS.format(line=line, time=local_time(oldest)))
    line_losses = list(lost_lines(record))
    losses = list(line_losses)
    runs: list[RecordedRun] = []
    known = [entry for entry in found.entries if entry.kind == "fault"]
    known = [entry for entry in known if line_key(entry.line) == line_key(line)]
    for each, profile in sorted(record.profiles.items()):
        if device in (None, each):
            since = max(0.0, begin - RUN_SEARCHED)
            own = history_of(record, each, profile, since, _END_OF_TIME)
            runs += own.runs
            losses += [loss for loss in own.losses if not _is_within(loss, line_losses)]
            noted = [entry for entry in known if entry.device == each]
            name = known[-1].line if known else line
            made = [entry for trip in own.trips for entry in _trip_entries(name, trip, noted)]
            found.entries += [entry for entry in made if _wall(entry) >= begin]
    found.runs += [LineRun(line, run) for run in runs if run.ended >= begin]
    found.losses += [
        LineLoss(line, loss) for loss in losses if loss.ended is None or loss.ended >= begin
    ]


def _trip_entries(line: str, trip: RecordedTrip, noted: Sequence[Entry]) -> Iterator[Entry]:
    """Yield the begin and the end of a trip as entries, unless the journal has noted them."""
    began = "seen" if trip.within is None else "tripped"
    both = (began, trip.begun, trip.within), ("reset", trip.ended, trip.end_within)
    for answer, wall, within in both:
        near = TRIP_NOTED_WITHIN + (within or 0.0)
        if wall is None or any(
            (entry.answer == "reset") == (answer == "reset") and abs(_wall(entry) - wall) <= near
            for entry in noted
        ):
            continue
        yield Entry(
            entry_time(wall), line, trip.device, trip.profile, trip.code, 0, None, "",
            trip.raw or 0, trip.name, answer, None, RECORD_SHOWS_IT, kind="fault",
            within=round(within or 0.0, 3),
        )  # fmt: skip


def _wall(entry: Entry) -> float:
    """Return the time of an entry in seconds since 1970; 0 if it is not valid."""
    when = time_of(entry)
    return 0.0 if when is None else when.timestamp()


def _is_within(loss: LostLink, losses: Iterable[LostLink]) -> bool:
    """Return True if the whole line was lost when a drive's link was."""
    return any(
        other.begun <= loss.begun <= (loss.begun if other.ended is None else other.ended)
        for other in losses
    )


def time_of_change(change: Change) -> datetime | None:
    """Return the local time of an entry, or the begin of a run or loss; None for an invalid one."""
    match change:
        case LineRun(run=run):
            return local_time(run.begun)
        case LineLoss(loss=loss):
            return local_time(loss.begun)
        case _:
            return time_of(change)


def device_of(change: Change) -> int | None:
    """Return the address of the drive; None for the whole line."""
    match change:
        case LineRun(run=run):
            return run.device
        case LineLoss(loss=loss):
            return loss.device
        case _:
            return change.device


# Texts


def entry_text(entry: Entry) -> str:
    """Return an entry without its time and drive: old and new value, answer, reason."""
    match entry.kind:
        case "fault":
            text = f"{f'FAULT {entry.code} {entry.new}'.rstrip()}: {entry.answer}"
            is_exact = entry.within <= EXACT_WITHIN
            return text if is_exact else f"{text} (time to {entry.within:.0f} s)"
        case "proof":
            return f"{entry.why}: {entry.new}  {entry.answer}"
        case "reset":
            return f"{entry.code}: {entry.why} set to {entry.new}  {entry.answer}"
        case "read-back":
            return f"{entry.code}: {entry.answer}"
        case _:
            change = f"{entry.old} -> {entry.new}" if entry.old else f"-> {entry.new}"
            why = f"  ({entry.why})" if entry.why else ""
            return f"{entry.code}: {change}  {entry.answer}{why}"


def run_text(run: RecordedRun) -> str:
    """Return a run without its begin and drive: direction, end, reference, program."""
    begun, ended = local_time(run.begun), local_time(run.ended)
    at = f"{ended:%H:%M:%S}" if ended.date() == begun.date() else f"{ended:%Y-%m-%d %H:%M:%S}"
    parts = [f"RUN {run.direction}".rstrip()]
    parts += [f"at {run.reference}"] if run.reference else []
    parts += [f"({run.least} to {run.most})"] if run.least else []
    seen = f"until {at}" if run.end_within is not None else f"last seen running at {at}"
    parts.append(seen)
    if run.who:
        parts.append(f"by {run.who}")
    elif run.begin_within is not None:
        parts.append("by another source")
    notes = [] if run.begin_within is not None else ["it ran when first read"]
    within = max(run.begin_within or 0, run.end_within or 0)
    notes += [f"times to {within:.0f} s"] if within > EXACT_WITHIN else []
    return " ".join(parts) + (f" ({', '.join(notes)})" if notes else "")


def loss_text(loss: LostLink) -> str:
    """Return a lost link without its begin: its end, its length, the reason."""
    what = "LINE LOST" if loss.device is None else "NO ANSWER"
    reason = f": {loss.reason}" if loss.reason and loss.reason != "no reply" else ""
    if loss.ended is None:
        return f"{what} since then{reason}"
    seconds = loss.ended - loss.begun
    return f"{what} until {local_time(loss.ended):%H:%M:%S} ({seconds:.0f} s){reason}"


def change_text(change: Change) -> str:
    """Return a change without its time and its drive."""
    match change:
        case LineRun(run=run):
            return run_text(run)
        case LineLoss(loss=loss):
            return loss_text(loss)
        case _:
            return entry_text(change)


def local_time(seconds: float) -> datetime:
    """Return a time of a record in the local zone."""
    return datetime.fromtimestamp(seconds).astimezone()
