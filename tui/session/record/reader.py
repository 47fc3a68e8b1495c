"""Reads a record, while it is written too: raw replies, reduced ones, and events by time."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from .reduction import Extent, extent_of
from .schema import GOOD, QUALITIES, RECORD_ID, RECORD_VERSION, EventRow, RecordDamaged

ROWS_AT_A_TIME = 1000
"""Rows of one query: a longer one would keep the writer from emptying the file's log."""


class RecordedWord(NamedTuple):
    """One register of one reply; times in microseconds, see the schema."""

    utc: int
    mono: int
    took: int
    """From the request to the end of the reply."""
    quality: str
    word: int | None
    """None if the reply is not good."""


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
    """One file, opened read-only. Its methods raise sqlite3.Error."""

    def __init__(self, path: Path) -> None:
        """Open a record. Raises RecordDamaged if it is not one of this version, sqlite3.Error."""
        self._base = sqlite3.connect(f"file:{quote(str(path))}?mode=ro", uri=True)
        number = [self._base.execute(f"PRAGMA {name}").fetchone()[0] for name in _MARKS]
        if number != list(_MARKS.values()):
            self._base.close()
            raise RecordDamaged(f"it is not a record of version {RECORD_VERSION}", path)

    def close(self) -> None:
        """Close the file."""
        self._base.close()

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

    def _rows(
        self, table: str, columns: str, device: int, register: int, since: int, until: int,
        function: int,
    ) -> Iterator[tuple[Any, ...]]:  # fmt: skip
        last = since, -1
        while True:
            rows = self._base.execute(
                f"SELECT {columns} FROM {table} WHERE device = ? AND utc >= ? AND utc < ?"
                " AND (utc, id) > (?, ?) AND function = ? AND address <= ?"
                " AND address + registers > ? ORDER BY utc, id LIMIT ?",
                (device, last[0], until, *last, function, register, register, ROWS_AT_A_TIME),
            ).fetchall()
            yield from rows
            if len(rows) < ROWS_AT_A_TIME:
                return
            last = rows[-1][:2]

    def events(self, since: int, until: int) -> list[EventRow]:
        """Return the events of a time, in their order."""
        found = self._base.execute(
            "SELECT utc, mono, device, kind, text, coalesce(who.name, ''), data FROM event"
            " LEFT JOIN who ON who.id = event.who WHERE utc >= ? AND utc < ? ORDER BY event.id",
            (since, until),
        )
        return [EventRow(*row) for row in found]


_MARKS = {"application_id": RECORD_ID, "user_version": RECORD_VERSION}
