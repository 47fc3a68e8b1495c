"""Queries of a replay: the recorded results of a device's reads, and the events."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any, NamedTuple

from tui.bus.errors import ChecksumFault, DeviceException, ExchangeError, NoAnswer, WrongReply
from tui.bus.expectation import IDENTIFY, REPORT_ID
from tui.bus.model import IdentificationObjects
from tui.bus.requests import REFERENCE, Objects, own_words_of

from .reader import RecordReader
from .reduction import extent_of
from .schema import (
    COPY,
    DAMAGED,
    GOOD,
    QUALITIES,
    REFUSED,
    SILENT,
    WRONG,
    EventRow,
    RecordDamaged,
    ReplyRow,
)

ROWS_AHEAD = 500
"""Rows that are read in one query while a replay goes on."""
_FAILED = {
    "reply": f"repeat = 0 AND quality BETWEEN {SILENT} AND {COPY}",
    "reduced": "good = 0",
}
"""Conditions of rows without a good reply, by table."""
LONGEST_EXCHANGE = 60_000_000
"""Microseconds in which any exchange ends."""
MOST_KNOWN = 20
"""Times of a record whose replies are kept, of each device."""
_NEVER = 1 << 62
_REPLY = "utc, utc + took, id, function, address, registers, quality, words, received, repeat"
_REDUCED = "utc, utc + took, id, function, address, registers, good, words"

MeanOf = Callable[[tuple[int, int]], bool | None]
"""By function and register: True for a signed quantity, False for an unsigned one, None for words
that have no mean."""


class RecordedReply(NamedTuple):
    """The last known result of one read; times in microseconds since 1970."""

    sent: int
    ended: int
    function: int
    address: int
    registers: int
    quality: int
    words: bytes | None
    """Registers; of reduced replies see the module `reduction`."""
    received: bytes | None = None
    repeat: int = 0
    reduced: bool = False

    def word(self, register: int, mean_of: MeanOf) -> int | None:
        """Return a register; None if it changed within reduced replies and has no mean."""
        at = register - self.address
        assert self.words is not None
        if not self.reduced:
            return int.from_bytes(self.words[2 * at : 2 * at + 2], "big")
        extent = extent_of(self.words, self.registers, at, signed=False)
        if extent.least == extent.most:
            return extent.least
        if (signed := mean_of((self.function, register))) is None:
            return None
        mean = extent_of(self.words, self.registers, at, signed=signed).mean
        return round(mean) & 0xFFFF

    def error(self, device: int) -> ExchangeError:
        """Return the error of a read that had no good reply."""
        place = device, self.function, self.address
        if self.quality == REFUSED:
            code = self.received[1] if self.received and len(self.received) > 1 else 0
            return DeviceException(*place, code)
        if self.quality == DAMAGED:
            return ChecksumFault(*place, received=self.received or b"")
        if self.quality == SILENT:
            return NoAnswer(*place)
        detail = "" if self.quality == WRONG else QUALITIES[self.quality]
        return WrongReply(*place, detail, self.received or b"")


@dataclass(slots=True)
class _KnownRecord:
    """Replies that were read before: a replay opens its record again for another time."""

    newest: dict[int, list[tuple[int, list[RecordedReply]]]] = field(default_factory=dict)
    """By device, times and the newest replies then; the next time reads on from there."""
    identified: dict[tuple[int, int], IdentificationObjects | None] = field(default_factory=dict)
    """By device and function."""
    answers: dict[tuple[int, int], list[tuple[bytes, bytes]]] | None = None
    """By device and function, requests for an identification with their replies."""


@lru_cache(maxsize=1)
def _known_record(files: tuple[tuple[Path, int], ...], jumps: int) -> _KnownRecord:
    return _KnownRecord()


class ReplayReader(RecordReader):
    """The queries of a replay; for any thread that holds the lock of its line."""

    def __init__(self, *paths: Path) -> None:
        """Open the files of a line, the oldest first. Raises RecordDamaged, sqlite3.Error."""
        super().__init__(*paths, any_thread=True)
        jumps = len(self.events_of(("clock",)))  # each may move the times before it
        self._known = _known_record(tuple((path, path.stat().st_ino) for path in paths), jumps)

    def devices(self) -> tuple[int, ...]:
        """Return the devices that have answered."""
        found: set[int] = set()
        for table, answered in (("reply", f"quality <= {REFUSED}"), ("reduced", "good > 0")):
            numbers = self._base.execute(f"SELECT DISTINCT device FROM {table}").fetchall()
            for (device,) in numbers:
                query = f"SELECT 1 FROM {table} WHERE device = ? AND {answered} LIMIT 1"
                if device and self._base.execute(query, (device,)).fetchone():
                    found.add(device)
        return tuple(sorted(found))

    def span(self, path: Path) -> tuple[int, int]:
        """Return the times of the first request and the last reply. Raises RecordDamaged."""
        ends: list[int] = []
        for table in ("reply", "reduced"):
            for (device,) in self._base.execute(f"SELECT DISTINCT device FROM {table}").fetchall():
                for order in ("", " DESC"):
                    row = self._base.execute(
                        f"SELECT utc, utc + took FROM {table} WHERE device = ?"
                        f" ORDER BY utc{order} LIMIT 1",
                        (device,),
                    ).fetchone()
                    ends += row or ()
        if not ends:
            raise RecordDamaged("no reply of a drive is in it", path)
        return min(ends), max(ends)

    def raw_since(self, device: int) -> int:
        """Return since when the reads of a device are recorded one by one; late if they are not."""
        row = self._base.execute(
            "SELECT utc FROM reply WHERE device = ? AND function BETWEEN 1 AND 4"
            " ORDER BY utc LIMIT 1",
            (device,),
        ).fetchone()
        return int(row[0]) if row else _NEVER

    def newest(self, device: int, until: int) -> list[RecordedReply]:
        """Return the last result of each read that had ended by a time, and its last good one."""
        known = self._known.newest.setdefault(device, [])
        begin, before = max(
            (item for item in known if item[0] <= until), key=itemgetter(0), default=(-_NEVER, [])
        )
        form = (
            "SELECT {}, max(utc) FROM {} WHERE device = ? AND utc > ? AND utc <= ?"
            " AND utc + took <= ? AND function BETWEEN 1 AND 4 {}"
            " GROUP BY function, address, registers"
        )
        where = device, begin - LONGEST_EXCHANGE, until, until
        rows = self._base.execute(form.format(_REPLY, "reply", ""), where).fetchall()
        if any(row[6] > REFUSED for row in rows):  # what they brought before they failed
            good = form.format(_REPLY, "reply", f"AND quality = {GOOD}")
            rows += self._base.execute(good, where).fetchall()
        old = self._base.execute(form.format(_REDUCED, "reduced", ""), where).fetchall()
        later = [*map(reply_in, rows), *map(reduced_in, old)]
        newest = {
            (*reply[2:5], reply.reduced, reply.quality == GOOD): reply
            for reply in (*before, *later)
        }
        found = list(newest.values())
        known.append((until, found))
        del known[:-MOST_KNOWN]
        return found

    def failures(self, device: int, since: int, until: int) -> int:
        """Return how many requests to a device failed in a time, without their repeats."""
        where, most = "device = ? AND utc >= ? AND utc + took <= ?", 0
        for table, failed in _FAILED.items():
            query = f"SELECT count(*) FROM {table} WHERE {where} AND {failed}"
            (count,) = self._base.execute(query, (device, since, until)).fetchone()
            most = max(most, count)
        return most

    def following(self, table: str, device: int, last: tuple[int, int]) -> list[Any]:
        """Return the next rows of a device after a time and a row."""
        columns = _REPLY if table == "reply" else _REDUCED
        return self._base.execute(
            f"SELECT {columns} FROM {table} WHERE device = ? AND utc >= ? AND (utc, id) > (?, ?)"
            f" ORDER BY utc, id LIMIT {ROWS_AHEAD}",
            (device, last[0], *last),
        ).fetchall()

    def replies_from(self, device: int, at: int) -> list[RecordedReply]:
        """Return the replies of a device that follow a time."""
        return [reply_in(row) for row in self.following("reply", device, (at, -1))]

    def last_before(self, device: int, since: int, until: int, most: int) -> list[RecordedReply]:
        """Return the last replies of a device in a time, the newest first."""
        form = (
            "SELECT {} FROM {} WHERE device = ? AND utc BETWEEN ? AND ? AND utc + took <= ?"
            " AND function BETWEEN 1 AND 4 ORDER BY utc DESC LIMIT ?"
        )
        where = device, since, until, until, most
        rows = self._base.execute(form.format(_REPLY, "reply"), where).fetchall()
        if rows:
            found = list(map(reply_in, rows))
        else:
            found = list(
                map(reduced_in, self._base.execute(form.format(_REDUCED, "reduced"), where))
            )
        return sorted(found, key=attrgetter("ended"), reverse=True)

    def last_of_each(self, device: int, since: int, until: int) -> list[RecordedReply]:
        """Return the last replies of each quality to each read in a time, the oldest first."""
        form = (
            "SELECT {}, max(utc) FROM {} WHERE device = ? AND utc BETWEEN ? AND ?"
            " AND utc + took <= ? AND function IN (3, 4)"
            " GROUP BY function, address, registers, {}"
        )
        where = device, since, until, until
        rows = self._base.execute(form.format(_REPLY, "reply", "quality"), where).fetchall()
        if rows:
            found = list(map(reply_in, rows))
        else:
            old = self._base.execute(form.format(_REDUCED, "reduced", "good > 0"), where)
            found = list(map(reduced_in, old))
        return sorted(found, key=attrgetter("ended"))

    def exchanges_of(self, device: int, since: int, until: int) -> list[ReplyRow]:
        """Return the exchanges of a device whose request was sent in a time."""
        found = self._base.execute(
            f"SELECT {', '.join(ReplyRow._fields[:-1])}, '' FROM reply"
            " WHERE device = ? AND utc >= ? AND utc < ? ORDER BY utc",
            (device, since, until),
        )
        return [ReplyRow._make(row) for row in found]

    def identification(self, device: int, function: int) -> IdentificationObjects | None:
        """Return what a device reported by function 43 or 17; None if that is not recorded."""
        known = self._known.identified
        if (device, function) not in known:
            known[device, function] = self._identification(device, function)
        return known[device, function]

    def _identification(self, device: int, function: int) -> IdentificationObjects | None:
        if self._known.answers is None:  # one search for all devices: it reads the whole record
            found_in = self._base.execute(
                f"SELECT device, function, sent, received FROM reply WHERE quality = {GOOD}"
                " AND function IN (?, ?) ORDER BY utc, id",
                (IDENTIFY, REPORT_ID),
            )
            self._known.answers = {}
            for number, kind, *pair in found_in:
                self._known.answers.setdefault((number, kind), []).append((pair[0], pair[1]))
        rows = self._known.answers.get((device, function), [])
        if function != IDENTIFY:
            words = own_words_of(rows[-1][1]) if rows else b""
            return IdentificationObjects(0, {REFERENCE: words}) if rows else None
        found, latest = Objects(), None
        for sent, received in rows:
            if sent[-1] == 0:
                found = Objects()
            with suppress(IndexError):
                found = found.with_more(received)
            if found.next_object is None and not found.trouble:
                latest = IdentificationObjects(found.conformity, found.objects)
        return latest

    def events_of(self, kinds: tuple[str, ...]) -> list[EventRow]:
        """Return the events of these kinds, by time."""
        marks = ",".join("?" * len(kinds))
        found = self._base.execute(
            "SELECT utc, mono, device, kind, text, coalesce(who.name, ''), data FROM event"
            f" LEFT JOIN who ON who.id = event.who WHERE kind IN ({marks}) ORDER BY utc, event.id",
            kinds,
        )
        return [EventRow(*row) for row in found]


def reply_in(row: tuple[Any, ...]) -> RecordedReply:
    """Return a row of `reply`."""
    sent, ended, _, function, address, registers, quality, words, received, repeat, *_ = row
    return RecordedReply(
        sent, ended, function, address, registers, quality, words, received, repeat
    )


def reduced_in(row: tuple[Any, ...]) -> RecordedReply:
    """Return a row of `reduced`."""
    sent, ended, _, function, address, registers, good, words, *_ = row
    quality = GOOD if good else SILENT
    return RecordedReply(sent, ended, function, address, registers, quality, words, reduced=True)
