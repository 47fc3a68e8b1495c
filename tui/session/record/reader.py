"""Reads a record, while it is written too: raw replies, reduced ones, and events by time."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple
from urllib.parse import quote

from tui.wire.frames import BIT_READS, at_place

from .reduction import Extent, extent_of
from .schema import (
    DAMAGED,
    GOOD,
    QUALITIES,
    RECORD_ID,
    RECORD_VERSION,
    RECORDED_READS,
    REFUSED,
    SILENT,
    WRONG,
    EventRow,
    RecordDamaged,
    ReplyRow,
)
from .unfolding import unfold

MOST_FILES = 11
"""Files that are read as one: SQLite joins no more."""
_BAD = SILENT, DAMAGED, WRONG
"""Qualities of a request that the device did not answer."""
FIRST_ROWS = 2000
"""Rows among which the oldest one is searched."""
ROWS_AT_A_TIME = 1000
"""Rows of one query: a longer one would keep the writer from emptying the file's log."""

OTHER = "it is not a record of version {1}"
NEWER = "it has version {0}, and this Drive Panel reads version {1}: install a newer one"


class RecordedWord(NamedTuple):
    """One register of one reply; times in microseconds, see the schema."""

    utc: int
    mono: int
    took: int
    """From the request to the end of the reply."""
    quality: str
    word: int | None
    """None if the reply is not good."""


class RecordedWords(NamedTuple):
    """Some registers of one reply; times in microseconds, see the schema."""

    session: int
    utc: int
    mono: int
    took: int
    quality: str
    words: tuple[int, ...] | None
    """None if the reply is not good."""
    registers: int
    """Registers that the request read."""


class ReducedWords(NamedTuple):
    """Some registers over up to 10 s; times in microseconds, see the schema."""

    session: int
    utc: int
    mono: int
    took: int
    good: int
    bad: int
    blob: bytes | None
    """For `extent_of`; None if no reply was good."""
    place: int
    """Place of the first register among those of the row."""
    registers: int


class ReducedWord(NamedTuple):
    """One register over up to 10 s; times in microseconds, see the schema."""

    utc: int
    mono: int
    took: int
    """From the first request to the end of the last reply."""
    good: int
    bad: int
    """Numbers of good replies and of others."""
    extent: Extent | None
    """None if no reply was good."""


class RecordReader:
    """A record of one line, opened read-only. Its methods raise sqlite3.Error.

    After a jump of the clock back, times before it are shown by the clock after it.
    """

    def __init__(self, path: Path, *following: Path, any_thread: bool = False) -> None:
        """Open a file, and those of later days: MOST_FILES at most.

        Raises RecordDamaged if one is not a record of this version, sqlite3.Error. With
        `any_thread`, the caller lets one thread use it at a time.
        """
        self._base = sqlite3.connect(_uri(path), uri=True, check_same_thread=not any_thread)
        try:
            files = ["main"]
            for number, other in enumerate(following):
                self._base.execute(f"ATTACH ? AS day{number}", (_uri(other),))
                files.append(f"day{number}")
            for file, opened in zip(files, (path, *following), strict=True):
                self._check(file, opened)
            unfold(self._base, files)
        except BaseException:
            self._base.close()
            raise

    def _check(self, file: str, path: Path) -> None:
        number = [self._base.execute(f"PRAGMA {file}.{name}").fetchone()[0] for name in _MARKS]
        if number != list(_MARKS.values()):
            text = NEWER if number[0] == RECORD_ID and number[1] > RECORD_VERSION else OTHER
            raise RecordDamaged(text.format(number[1], RECORD_VERSION), path)

    def close(self) -> None:
        """Close the file."""
        self._base.close()

    @property
    def line(self) -> str:
        """The line as text, with its settings when the file was created."""
        found = self._base.execute("SELECT value FROM about WHERE name = 'line'").fetchone()
        return str(found[0]) if found else ""

    def words(
        self, device: int, register: int, since: int, until: int, *, function: int = 3
    ) -> Iterator[RecordedWord]:
        """Yield each reply to a read of a register that was sent from `since` to before `until`."""
        columns = "utc, id, mono, took, quality, words, address"
        for row in self._rows("reply", columns, device, register, since, until, function):
            utc, _, mono, took, quality, words, address = row
            at = 2 * (register - address)
            word = int.from_bytes(words[at : at + 2], "big") if quality == GOOD else None
            yield RecordedWord(utc, mono, took, QUALITIES[quality], word)

    def reduced(
        self, device: int, register: int, since: int, until: int, *, function: int = 3,
        signed: bool = False,
    ) -> Iterator[ReducedWord]:  # fmt: skip
        """Yield the reduced replies to reads of a register, as signed numbers or not."""
        columns = "utc, id, mono, took, good, bad, words, address, registers"
        for row in self._rows("reduced", columns, device, register, since, until, function):
            utc, _, mono, took, good, bad, words, address, registers = row
            at = register - address
            extent = None if words is None else extent_of(words, registers, at, signed=signed)
            yield ReducedWord(utc, mono, took, good, bad, extent)

    def replies(
        self, device: int, register: int, count: int, since: int, until: int, *, function: int
    ) -> Iterator[RecordedWords]:
        """Yield each reply to a read that includes `count` registers, by the time of its request.

        `since` is in the time, `until` is not.
        """
        columns = "utc, id, session, mono, took, quality, words, address, registers"
        rows = self._rows("reply", columns, device, register, since, until, function, count)
        for utc, _, session, mono, took, quality, data, address, registers in rows:
            words = _words(data, register - address, count) if quality == GOOD else None
            yield RecordedWords(session, utc, mono, took, QUALITIES[quality], words, registers)

    def reduced_replies(
        self, device: int, register: int, count: int, since: int, until: int, *, function: int
    ) -> Iterator[ReducedWords]:
        """Yield the reduced rows of reads that include `count` registers."""
        columns = "utc, id, session, mono, took, good, bad, words, address, registers"
        rows = self._rows("reduced", columns, device, register, since, until, function, count)
        for utc, _, session, mono, took, good, bad, blob, address, registers in rows:
            at = register - address
            yield ReducedWords(session, utc, mono, took, good, bad, blob, at, registers)

    def first_raw(self) -> tuple[int, int] | None:
        """Return session and `mono` of the oldest read that is kept as it was; None without any.

        Reads before it are only reduced. A file of `drivepanel record` has the rows of several
        drives in the order of their cycles, so the oldest is among the first rows.
        """
        found = self._base.execute(
            "SELECT session, min(mono) FROM (SELECT session, mono FROM reply"
            f" WHERE function IN {RECORDED_READS} ORDER BY id LIMIT {FIRST_ROWS})"
            " GROUP BY session ORDER BY session LIMIT 1"
        ).fetchone()
        return None if found is None else (found[0], found[1])

    def oldest(self, device: int) -> int | None:
        """Return the `utc` of the oldest read of a drive, as it was or reduced; None without."""
        times = [
            self._base.execute(
                f"SELECT min(utc) FROM {table} WHERE device = ?", (device,)
            ).fetchone()[0]
            for table in ("reply", "reduced")
        ]
        return min((utc for utc in times if utc is not None), default=None)

    def silences(self, device: int) -> Iterator[tuple[int, int, int | None, int]]:
        """Yield each time without an answer to any request of a device, from replies that are kept.

        Its parts are the first and the last bad reply, the next answer, and the number of bad ones.
        """
        answer: int | None = -(1 << 62)
        while answer is not None:
            (begun,) = self._base.execute(
                f"SELECT min(utc) FROM reply WHERE device = ? AND utc > ? AND quality IN {_BAD}",
                (device, answer),
            ).fetchone()
            if begun is None:
                return
            (answer,) = self._base.execute(
                "SELECT min(utc) FROM reply WHERE device = ? AND utc > ? AND quality IN (?, ?)",
                (device, begun, GOOD, REFUSED),
            ).fetchone()
            until = 1 << 62 if answer is None else answer
            last, count = self._base.execute(
                "SELECT max(utc), count(*) FROM reply WHERE device = ? AND utc >= ? AND utc < ?"
                f" AND quality IN {_BAD}",
                (device, begun, until),
            ).fetchone()
            yield begun, last, answer, count

    def notes_of(self, device: int, kind: Literal["profile", "block"]) -> list[tuple[int, str]]:
        """Return the events that name the profile of a drive, or its block, with their `utc`."""
        rows = self._base.execute(
            "SELECT utc, text FROM event WHERE kind = ? AND device = ? ORDER BY utc, id",
            (kind, device),
        )
        return list(rows)

    def _rows(
        self, table: str, columns: str, device: int, register: int, since: int, until: int,
        function: int, count: int = 1,
    ) -> Iterator[tuple[Any, ...]]:  # fmt: skip
        last = since, -1
        covers = function, register, register + count
        while True:
            rows = self._base.execute(
                f"SELECT {columns} FROM {table} WHERE device = ? AND utc >= ? AND utc < ?"
                " AND (utc, id) > (?, ?) AND function = ? AND address <= ?"
                " AND address + registers >= ? ORDER BY utc, id LIMIT ?",
                (device, last[0], until, *last, *covers, ROWS_AT_A_TIME),
            ).fetchall()
            yield from rows
            if len(rows) < ROWS_AT_A_TIME:
                return
            last = rows[-1][:2]

    def all_exchanges(self, since: int, until: int) -> Iterator[ReplyRow]:
        """Yield the exchanges of all devices whose request was sent in a time, in their order."""
        columns = ", ".join(f"reply.{name}" for name in ReplyRow._fields[:-1])
        last = -1
        while True:
            rows = self._base.execute(
                f"SELECT reply.id, {columns}, coalesce(who.name, '') FROM reply"
                " LEFT JOIN who ON who.id = reply.who WHERE reply.id > ? AND utc >= ? AND utc < ?"
                " ORDER BY reply.id LIMIT ?",
                (last, since, until, ROWS_AT_A_TIME),
            ).fetchall()
            yield from (ReplyRow._make(row[1:]) for row in rows)
            if len(rows) < ROWS_AT_A_TIME:
                return
            last = rows[-1][0]

    def last_writer(self, device: int, place: int, since: int, until: int) -> str:
        """Return the program whose write of a register or coil the drive took last.

        `place` is its place, see wire_place().
        """
        function, register = at_place(place)
        writes = (5, 15) if function in BIT_READS else (6, 16)
        found = self._base.execute(
            "SELECT who.name FROM reply JOIN who ON who.id = reply.who WHERE device = ?"
            f" AND utc >= ? AND utc < ? AND function IN {writes} AND quality = ? AND address <= ?"
            " AND address + registers > ? ORDER BY utc DESC, reply.id DESC LIMIT 1",
            (device, since, until, GOOD, register, register),
        ).fetchone()
        return str(found[0]) if found else ""

    def events(self, since: int, until: int) -> list[EventRow]:
        """Return the events of a time, in their order."""
        found = self._base.execute(
            "SELECT utc, mono, device, kind, text, coalesce(who.name, ''), data FROM event"
            " LEFT JOIN who ON who.id = event.who WHERE utc >= ? AND utc < ? ORDER BY event.id",
            (since, until),
        )
        return [EventRow(*row) for row in found]


def _uri(path: Path) -> str:
    return f"file:{quote(str(path))}?mode=ro"


def _words(data: bytes, index: int, count: int) -> tuple[int, ...]:
    """Return `count` registers of a reply's data from a place on."""
    places = range(2 * index, 2 * (index + count), 2)
    return tuple(int.from_bytes(data[at : at + 2], "big") for at in places)


_MARKS = {"application_id": RECORD_ID, "user_version": RECORD_VERSION}
