"""Newest reply to each read of a device at a time of a record: the state that a replay shows."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    ExchangeError,
    NoAnswer,
    NotRecorded,
    WrongReply,
)
from tui.bus.expectation import IDENTIFY
from tui.bus.model import IdentificationObjects
from tui.bus.requests import REFERENCE, Objects, own_words_of

from .reader import RecordReader
from .reduction import extent_of
from .schema import (
    DAMAGED,
    GOOD,
    QUALITIES,
    RECORDED_READS,
    REFUSED,
    SILENT,
    WRONG,
    EventRow,
    RecordDamaged,
    ReplyRow,
)

ROWS_AHEAD = 500
"""Rows that are read in one query while a replay goes on."""
PASSED_OVER = 120_000_000
"""Microseconds beyond which only the newest replies are read, not those in between."""
SOUGHT_AGAIN = 1_000_000
"""Microseconds after which the end of a file is read again: it may still be written."""
REPEATED_WITHIN = 2_000_000
"""Microseconds within which a repeated request replaces the failed one before it."""
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
            "SELECT utc FROM reply WHERE device = ? AND function IN (3, 4) ORDER BY utc LIMIT 1",
            (device,),
        ).fetchone()
        return int(row[0]) if row else _NEVER

    def newest(self, device: int, until: int) -> list[RecordedReply]:
        """Return the last result of each read that had ended by a time."""
        known = self._known.newest.setdefault(device, [])
        begin, before = max(
            (item for item in known if item[0] <= until), key=itemgetter(0), default=(-_NEVER, [])
        )
        form = (
            "SELECT {}, max(utc) FROM {} WHERE device = ? AND utc > ? AND utc <= ?"
            " AND utc + took <= ? AND function IN (3, 4) GROUP BY function, address, registers"
        )
        where = device, begin - LONGEST_EXCHANGE, until, until
        rows = self._base.execute(form.format(_REPLY, "reply"), where).fetchall()
        old = self._base.execute(form.format(_REDUCED, "reduced"), where).fetchall()
        later = [*map(_reply_in, rows), *map(_reduced_in, old)]
        newest = {
            (reply.function, reply.address, reply.registers, reply.reduced): reply
            for reply in (*before, *later)
        }
        found = list(newest.values())
        known.append((until, found))
        del known[:-MOST_KNOWN]
        return found

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
        return [_reply_in(row) for row in self.following("reply", device, (at, -1))]

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
        rows = self._base.execute(
            f"SELECT sent, received FROM reply WHERE device = ? AND quality = {GOOD}"
            " AND function = ? ORDER BY utc, id",
            (device, function),
        ).fetchall()
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


def _reply_in(row: tuple[Any, ...]) -> RecordedReply:
    sent, ended, _, function, address, registers, quality, words, received, repeat, *_ = row
    return RecordedReply(
        sent, ended, function, address, registers, quality, words, received, repeat
    )


def _reduced_in(row: tuple[Any, ...]) -> RecordedReply:
    sent, ended, _, function, address, registers, good, words, *_ = row
    quality = GOOD if good else SILENT
    return RecordedReply(sent, ended, function, address, registers, quality, words, reduced=True)


class NewestReplies:
    """Follows the replies of one device through a record."""

    def __init__(
        self, reader: ReplayReader, device: int, ended: Callable[[RecordedReply], None]
    ) -> None:
        """`ended` is called with each exchange that ends while time goes on."""
        self._reader = reader
        self._device = device
        self._ended = ended
        self._at: int | None = None
        self._raw_since = reader.raw_since(device)
        self._by_register: dict[tuple[int, int], RecordedReply] = {}
        self._refused: dict[tuple[int, int, int], RecordedReply] = {}
        self._tables: dict[str, _Following] = {}
        self.heard: int | None = None
        """When its last reply ended, in microseconds; None before the first."""
        self.failures = 0
        """Number of exchanges without a reply since."""
        self.mean_of: MeanOf = lambda place: None

    def move(self, at: int) -> None:
        """Go to a later time in microseconds, or begin there."""
        if self._at is None or at - self._at > PASSED_OVER:
            newest = self._reader.newest(self._device, self._before_repeat(at))
            for reply in sorted(newest, key=lambda reply: (reply.ended, reply.reduced)):
                self._take(reply)
            # exchanges that had begun by then may end later
            begin = at - 2 * REPEATED_WITHIN
            self._tables = {name: _Following(begin, at) for name in ("reply", "reduced")}
        self._at = at
        for table, following in self._tables.items():
            for reply, repeated in following.until(at, partial(self._read, table)):
                if repeated or self._take(reply):
                    self._ended(reply)

    def _before_repeat(self, at: int) -> int:
        """Return a time before the last try, if that failed and is repeated soon."""
        replies = self._reader.replies_from(self._device, at - REPEATED_WITHIN)
        for reply, following in reversed(list(pairwise(replies))):
            if reply.ended <= at < following.ended and is_repeated(reply, following):
                return self._before_repeat(reply.sent - 1)
        return at

    def _read(self, table: str, last: tuple[int, int]) -> tuple[list[RecordedReply], Any]:
        rows = self._reader.following(table, self._device, last)
        form = _reply_in if table == "reply" else _reduced_in
        return [form(row) for row in rows], (rows[-1][0], rows[-1][2]) if rows else last

    def _take(self, reply: RecordedReply) -> bool:
        """Take a reply; return False for reduced ones whose replies are recorded as well."""
        if reply.reduced and reply.sent >= self._raw_since:
            return False
        if reply.quality in (GOOD, REFUSED):
            self.heard, self.failures = max(self.heard or 0, reply.ended), 0
        else:
            self.failures += 1
        if reply.function not in RECORDED_READS:
            return True
        if reply.quality == REFUSED:
            # a refused long read does not concern its registers one by one
            key = reply.function, reply.address, reply.registers
            self._refused[key] = _later(self._refused.get(key), reply)
            return True
        for register in range(reply.address, reply.address + reply.registers):
            place = reply.function, register
            self._by_register[place] = _later(self._by_register.get(place), reply)
        return True

    def words(self, function: int, address: int, count: int) -> tuple[tuple[int, ...], int]:
        """Return registers and when they were read (microseconds); raise the recorded error.

        Raises NotRecorded for registers that were not read, or not by one request.
        """
        places = range(address, address + count)
        found = [self._by_register.get((function, register)) for register in places]
        newest = max((reply.ended for reply in found if reply is not None), default=0)
        refused = self._refused.get((function, address, count))
        if refused is not None and refused.ended >= newest:
            raise refused.error(self._device)
        first = found[0]
        for reply in found:
            if reply is not None and reply.quality != GOOD and reply.ended == newest:
                if reply.reduced:  # how they failed is not known any more
                    raise NotRecorded(self._device, function, address)
                raise reply.error(self._device)
        if first is None or any(reply is not first for reply in found):
            raise NotRecorded(self._device, function, address)
        words = [first.word(register, self.mean_of) for register in places]
        known = tuple(word for word in words if word is not None)
        if len(known) < count:
            raise NotRecorded(self._device, function, address)
        return known, first.ended


def _later(before: RecordedReply | None, reply: RecordedReply) -> RecordedReply:
    return reply if before is None or reply.ended >= before.ended else before


class _Following:
    """Rows of one table in the order of their time, some read ahead."""

    def __init__(self, begin: int, known_to: int) -> None:
        self.last = (begin, -1)
        self.skip = known_to
        """Time up to which replies are known already."""
        self._ahead: deque[RecordedReply] = deque()
        self._sought = 0

    def until(
        self, at: int, read: Callable[[tuple[int, int]], tuple[list[RecordedReply], Any]]
    ) -> list[tuple[RecordedReply, bool]]:
        """Return the replies that have ended since the last call; True for a repeated request."""
        found: list[tuple[RecordedReply, bool]] = []
        while True:
            if not self._ahead and at >= self._sought:
                rows, self.last = read(self.last)
                self._ahead.extend(rows)
                if len(rows) < ROWS_AHEAD:
                    self._sought = at + SOUGHT_AGAIN
            if not self._ahead or self._ahead[0].ended > at:
                return found
            reply = self._ahead.popleft()
            repeated = bool(self._ahead) and is_repeated(reply, self._ahead[0])
            if reply.ended > self.skip:
                found.append((reply, repeated))


def is_repeated(reply: RecordedReply, following: RecordedReply) -> bool:
    """Return True if a failed request was repeated at once: only its last try counts."""
    if reply.quality in (GOOD, REFUSED):
        return False
    same = (reply.function, reply.address) == (following.function, following.address)
    soon = following.sent - reply.ended < REPEATED_WITHIN
    return same and soon and following.repeat == reply.repeat + 1
