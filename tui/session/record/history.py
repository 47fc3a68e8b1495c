"""Values of one parameter over a time, from the records of a line: raw rows joined to reduced ones.

It reads files, for up to a second: call it in a thread of its own, never in an event loop or the
line's thread. Each value is decoded with the profile that the record names for its time.
"""

from __future__ import annotations

import json
import sqlite3
from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import TypeVar

from msgspec import structs

from tui.drive.errors import ProfileError, UnknownProfile
from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile, digest_of
from tui.drive.profile.schema import Parameter
from tui.drive.shown import depends_on
from tui.drive.values import from_words, is_field, is_signed_type, word_count

from .block_times import BlockTimes
from .decoding import (
    NO_GOOD_REPLY,
    NOT_KEPT,
    WITHOUT_VALUE,
    HistoryPoint,
    PointDecoder,
    RawPoint,
    ScaleWords,
)
from .reader import RecordReader, ReducedWords
from .reduction import REDUCED_OVER, Extent, extent_of
from .ring import SECONDS_A_DAY, day_of_record
from .schema import QUALITIES, REFUSED, EventRow, RecordDamaged

SOURCES_BEFORE = 3600.0
"""Seconds before the time in which a word that determines a scale is searched."""
_GOOD = QUALITIES[0]
_WORD = 0x10000
Row = TypeVar("Row")


@dataclass(frozen=True, slots=True)
class History:
    """Values of one parameter of one drive; `points` are in the order of their times."""

    points: Sequence[HistoryPoint]
    unit: str = ""
    entry: Parameter | None = None
    """The parameter, as the last profile describes it."""
    troubles: Sequence[str] = ()
    """Reasons why files were not read or values not decoded, as sentences."""


@dataclass(slots=True)
class _Reading:
    """Files of one call, and its troubles."""

    files: Sequence[Path]
    device: int
    own: Profile | None
    troubles: dict[str, None] = field(default_factory=dict)
    blocks: BlockTimes = field(default_factory=lambda: BlockTimes(()))

    def note(self, text: str) -> None:
        self.troubles.setdefault(text)

    def rows(
        self, since: float, until: float, read: Callable[[RecordReader], Iterable[Row]]
    ) -> list[Row]:
        """Return the rows of each file that may have some of a time; note what cannot be read."""
        days = since // SECONDS_A_DAY, until // SECONDS_A_DAY
        found: list[Row] = []
        for path in self.files:
            day = day_of_record(path)
            if day is not None and not days[0] <= day <= days[1]:
                continue
            try:
                with closing(RecordReader(path)) as reader:
                    found += read(reader)
            except (sqlite3.Error, RecordDamaged, OSError) as error:
                if path.exists():  # else it was removed to make room
                    self.note(f"{path.name} cannot be read: {error}.")
        return found


def read_history(
    files: Sequence[Path],
    device: int,
    code: str,
    since: float,
    until: float,
    *,
    own: Profile | None = None,
) -> History:
    """Return the values of a parameter of a drive from `since` to before `until`.

    Times are in seconds since 1970; a reduced point may begin up to 10 s before `since`. `own` is
    the profile that this program uses for the drive: it has the learned scales, and is not loaded.
    """
    work = _Reading(files, device, own)
    periods = _profiles(work, since, until)
    before = since - SOURCES_BEFORE
    work.blocks = BlockTimes(work.rows(before, until, lambda it: it.notes_of(device, "block")))
    profiles = {id(profile): profile for _, profile in periods if profile is not None}
    points: list[HistoryPoint] = []
    last: tuple[Parameter, str] | None = None
    for profile in profiles.values():
        if (entry := profile.get(code)) is None:
            work.note(f"The profile {profile.id} has no parameter {code!r}.")
            continue
        sources = {
            source: _source(work, profile, source, since, until) for source in depends_on(entry)
        }
        decoder = PointDecoder(profile, entry, sources)
        own_time = partial(_in_force, periods, profile)
        raws = _raw_points(work, profile, entry, since, until)
        found = [decoder.point(raw) for raw in raws if own_time(raw.time)]
        if found or last is None:
            last = entry, decoder.unit
        points += found
    points.sort(key=attrgetter("time"))
    entry, unit = last if last is not None else (None, "")
    return History(points, unit, entry, tuple(work.troubles))


Periods = Sequence[tuple[int, Profile | None]]
"""Profiles with the time from which they apply, in microseconds since 1970."""


def _profiles(work: _Reading, since: float, until: float) -> Periods:
    """Return the profiles of a drive, the first one from the beginning on."""
    found: dict[int, Profile | None] = {}
    known: dict[str, Profile | None] = {}
    before = since - SOURCES_BEFORE
    for utc, text in work.rows(
        before, until, lambda reader: reader.notes_of(work.device, "profile")
    ):
        if text not in known:
            known[text] = _profile_of(work, text)
        found[utc] = known[text]
    if not found:
        work.note("The record names no profile for this drive.")
    periods = sorted(found.items(), key=lambda item: item[0])
    return [(-_FAR, periods[0][1]), *periods] if periods else []


_FAR = 1 << 62


def _profile_of(work: _Reading, text: str) -> Profile | None:
    """Load the profile that an event names; None, and a note, if that is not possible."""
    try:
        named = json.loads(text)
        name, digest = str(named["profile"]), str(named["hash"])
    except (ValueError, KeyError, TypeError):
        name, digest = text, ""
    if work.own is not None and (name, digest) == (work.own.id, digest_of(work.own)):
        return work.own
    try:
        profile = load(name)
    except (ProfileError, UnknownProfile, OSError) as error:
        work.note(f"The values are not decoded: {error}")
        return None
    if digest != digest_of(profile):
        work.note(f"The profile {name} has changed since the record: values may differ.")
    return profile


def _in_force(periods: Periods, profile: Profile, utc: int) -> bool:
    at = bisect_right(periods, utc, key=lambda period: period[0]) - 1
    return periods[at][1] is profile


def _source(work: _Reading, profile: Profile, code: str, since: float, until: float) -> ScaleWords:
    raws = _raw_points(work, profile, profile[code], since - SOURCES_BEFORE, until)
    found = []
    for point in raws:
        if point.extent is not None:
            steady = point.extent.least == point.extent.most
            found.append((point.time, point.extent.least if steady else None, False))
        elif point.quality == QUALITIES[REFUSED]:
            found.append((point.time, None, True))
    return sorted(found, key=lambda item: item[0])


def _raw_points(
    work: _Reading, profile: Profile, entry: Parameter, since: float, until: float
) -> list[RawPoint]:
    """Return the points of a parameter: each reply once, as it was or reduced."""
    times = round(since * 1e6), round(until * 1e6)

    def read(
        reader: RecordReader, entry: Parameter = entry, times: tuple[int, int] = times
    ) -> Iterable[RawPoint]:
        return _points_of_file(reader, work.device, profile, entry, times)

    begin = since - REDUCED_OVER / 1e6
    found = work.rows(begin, until, read)
    for register, first, last in work.blocks.of(entry.code):
        # a reduced row may begin before the parameter was in the block, or end after
        span = max(first, times[0]), min(last, times[1])
        if span[0] < span[1]:
            moved = structs.replace(entry, address=register, function=3)
            points = work.rows(begin, until, partial(read, entry=moved, times=span))
            found += [point for point in points if first <= point.time and point.end <= last]
    return found


def _points_of_file(
    reader: RecordReader, device: int, profile: Profile, entry: Parameter, times: tuple[int, int]
) -> Iterable[RawPoint]:
    """Yield the points of one file.

    Rows may expire while it is read. So the replies are read first: what expired before its turn,
    or has since, is then taken from the reduced rows.
    """
    count, unknown = word_count(entry), profile.data.reading.unknown_word
    place = device, entry.address, count
    replies = list(reader.replies(*place, *times, function=entry.function))
    first = reader.first_raw()
    covered: dict[int, list[tuple[int, int]]] = {}
    begin = times[0] - REDUCED_OVER, times[1]
    for row in reader.reduced_replies(*place, *begin, function=entry.function):
        ends_before = row.utc + row.took < times[0]
        if not ends_before and (first is None or (row.session, row.mono) < first):
            covered.setdefault(row.session, []).append((row.mono, row.mono + row.took))
            yield _reduced_point(row, entry, profile)
    spans = {session: sorted(rows) for session, rows in covered.items()}
    for reply in replies:
        if _is_covered(spans.get(reply.session, ()), reply.mono):
            continue
        end = reply.utc + reply.took
        if reply.words is None:
            yield RawPoint(end, end, None, reply.quality, 0, 1)
        elif unknown in reply.words and reply.registers != count:
            yield RawPoint(end, end, None, WITHOUT_VALUE, 0, 1)
        else:
            raw = from_words(entry, reply.words)
            yield RawPoint(end, end, Extent(raw, raw, raw), raw=raw)


def _is_covered(spans: Sequence[tuple[int, int]], mono: int) -> bool:
    at = bisect_right(spans, (mono, _FAR)) - 1
    return at >= 0 and mono <= spans[at][1]


def _reduced_point(row: ReducedWords, entry: Parameter, profile: Profile) -> RawPoint:
    point = RawPoint(row.utc, row.utc + row.took, None, "", row.good, row.bad, reduced=True)
    if row.blob is None:
        point.quality = NO_GOOD_REPLY
        return point
    count = word_count(entry)
    words = [
        (_extent(row, index, signed=False), _extent(row, index, signed=True))
        for index in range(count)
    ]
    unknown = profile.data.reading.unknown_word
    if (
        unknown is not None
        and row.registers != count
        and any(_has(word, unknown) for word in words)
    ):
        point.quality = WITHOUT_VALUE
        return point
    taught = profile.taught.get(entry.code)
    signed = is_signed_type(entry) or (taught is not None and taught.signed is True)
    if entry.type == "float32":
        # the ends of two registers are not those of a float
        point.quality = NOT_KEPT
        return point
    if entry.is_bits:
        point.extent = _bits_extent(entry, [word for word, _ in words])
    elif count == 1:
        point.extent = words[0][signed]
        if is_field(entry):
            point.extent = _field_extent(entry, words[0][0])
    else:
        low, high = words if entry.low_word_first else reversed(words)
        point.extent, point.exact = _joined(high[signed], low[0])
    point.quality = _GOOD if point.extent is not None else NOT_KEPT
    return point


def _extent(row: ReducedWords, index: int, *, signed: bool) -> Extent:
    assert row.blob is not None
    return extent_of(row.blob, row.registers, row.place + index, signed=signed)


def _has(word: tuple[Extent, Extent], unknown: int) -> bool:
    """True if an end of a word's extent is the word for "no value"."""
    return any(end % _WORD == unknown for extent in word for end in (extent.least, extent.most))


def _bits_extent(entry: Parameter, bits: Sequence[Extent]) -> Extent | None:
    """Return the extent of a word of coils; None if one of several changed."""
    if len(bits) == 1:
        return bits[0]
    if any(bit.least != bit.most for bit in bits):
        return None
    raw = from_words(entry, [bit.least for bit in bits])
    return Extent(raw, raw, raw)


def _field_extent(entry: Parameter, word: Extent) -> Extent | None:
    """Return the extent of some bits of a word; None if the word changed."""
    if word.least != word.most:
        return None
    raw = from_words(entry, [word.least])
    return Extent(raw, raw, raw)


def _joined(high: Extent, low: Extent) -> tuple[Extent, bool]:
    """Return an extent that includes all values of two registers, and True if it is exact."""
    mean = high.mean * _WORD + low.mean
    joined = Extent(high.least * _WORD + low.least, mean, high.most * _WORD + low.most)
    return joined, high.least == high.most


def recorded_events(files: Sequence[Path], since: float, until: float) -> list[EventRow]:
    """Return the events of a time, from all files that can be read."""
    work = _Reading(files, 0, None)
    times = round(since * 1e6), round(until * 1e6)
    return work.rows(since, until, lambda reader: reader.events(*times))


def oldest_reply(files: Sequence[Path], devices: Collection[int]) -> float | None:
    """Return the time of the oldest recorded read of some drives; None without any."""
    for path in files:
        try:
            with closing(RecordReader(path)) as reader:
                found = [reader.oldest(device) for device in devices]
        except (sqlite3.Error, RecordDamaged, OSError):
            continue
        if times := [utc for utc in found if utc is not None]:
            return min(times) / 1e6
    return None


def number_text(history: History, value: float) -> str:
    """Return a value with the decimals of the parameter's scale; with 6 digits if unknown."""
    entry = history.entry
    if entry is None or entry.scale_source or history.unit == "raw":
        return f"{value:.6g}"
    decimals = -int(Decimal(entry.scale).normalize().as_tuple().exponent)
    return f"{value:.{max(0, decimals)}f}"
