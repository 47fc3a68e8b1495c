"""One file of the record: created, written, reduced, kept small and closed. One thread uses it.

It is in WAL mode while it is written, without a flush for each commit: a killed program loses
nothing that was committed. `flush` is called often enough that a power cut loses little. Closed,
it has a rollback journal, so that it opens read-only in any folder.
"""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from itertools import takewhile
from pathlib import Path

import tui
from tui.drive.small_file import read_small_text

from ..stored import make_folder
from .disk_trouble import from_sqlite
from .reduction import REDUCED_OVER, ReducedRow, ReductionWindow
from .schema import (
    QUALITIES,
    RECORD_ID,
    RECORD_VERSION,
    RECORDED_READS,
    TABLES,
    EventRow,
    RecordDamaged,
    RecordHeld,
    ReplyRow,
    to_microseconds,
)

RAW_KEPT = 3600 * 1_000_000
"""Microseconds for which the rows of reads are kept as they were."""
EXPIRED_AT_A_TIME = 1000
"""Rows that are removed in one transaction."""
SHED_AT_A_TIME = 5000
PAGES_GIVEN_BACK = 1000
"""Pages (4 KiB) that are returned to the disk in one transaction."""
MOST_WAL = 8 << 20
"""Bytes of the file's log; beyond, nothing is written until no reader holds it."""
USUAL_WAL = 2 << 20
"""Bytes of the log at which it is flushed into the file."""
LOCK_PATIENCE = 1.0
"""Seconds to wait for another program that uses the file."""
FILE_MODE = 0o600
_DAMAGED = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)
_BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
_INSERT_REPLY = f"INSERT INTO reply VALUES (NULL{',?' * 14})"
_INSERT_REDUCED = f"INSERT INTO reduced VALUES (NULL{',?' * 11})"
_INSERT_EVENT = f"INSERT OR IGNORE INTO event VALUES (NULL{',?' * 8})"


_BEFORE_REDUCED = (
    f"AND utc <= (SELECT coalesce(min(utc) + {REDUCED_OVER}, {1 << 62}) FROM"
    " (SELECT utc FROM reduced ORDER BY id LIMIT 1))"
)


class RecordFile:
    """Writes one file. All methods raise OSError; after that, the transaction has no effect."""

    def __init__(self, path: Path, line: str, program: str) -> None:
        """Open the file, or create it with the name of its line. Raises RecordDamaged, OSError."""
        self.path = path
        self._who: dict[str, int] = {}
        self._window = ReductionWindow()
        self._expired_to = 0
        self._boot = boot_id()
        self._begun = to_microseconds(time.monotonic())
        self._program = program
        self._session: int | None = None
        make_folder(path.parent)
        os.close(os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), FILE_MODE))
        with _as_os_errors(self.path):
            self._base = sqlite3.connect(path, timeout=LOCK_PATIENCE, isolation_level=None)
            try:
                self._prepare(line)
                self._reduce_rest()
            except BaseException:
                self._base.close()
                raise

    def _prepare(self, line: str) -> None:
        base = self._base
        base.execute("PRAGMA auto_vacuum = INCREMENTAL")
        base.execute("PRAGMA synchronous = NORMAL")
        base.execute("PRAGMA wal_autocheckpoint = 0")
        base.execute(f"PRAGMA journal_size_limit = {USUAL_WAL}")
        empty = not base.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if not empty and self._pragma("application_id") != RECORD_ID:
            raise RecordDamaged("it is not a record of Drive Panel", self.path)
        if not empty and self._pragma("user_version") != RECORD_VERSION:
            raise RecordDamaged(f"it has version {self._pragma('user_version')}", self.path)
        base.execute("PRAGMA journal_mode = WAL")
        if empty:
            base.executescript(
                f"BEGIN;{TABLES}PRAGMA application_id = {RECORD_ID};"
                f"PRAGMA user_version = {RECORD_VERSION};COMMIT"
            )
            base.executemany("INSERT INTO quality VALUES (?,?)", QUALITIES.items())
            base.execute("INSERT INTO about VALUES ('line', ?)", (line,))
            base.execute("INSERT INTO about VALUES ('reduced to', 0)")

    def _reduce_rest(self) -> None:
        """Reduce what a killed program has left."""
        with self._transaction():
            done = self._base.execute("SELECT value FROM about WHERE name = 'reduced to'")
            columns = ", ".join(ReplyRow._fields[:-1])
            left = self._base.execute(
                f"SELECT session, {columns} FROM reply WHERE id > ? ORDER BY id", done.fetchone()
            )
            sessions: dict[int, ReductionWindow] = {}
            for session, *values in left:
                window = sessions.setdefault(session, ReductionWindow())
                self._reduce(window.add(ReplyRow._make((*values, ""))), session)
            for session, window in sessions.items():
                self._reduce(window.end(), session)
            if sessions:
                self._note_reduced()

    def _session_id(self) -> int:
        """The number of this session, which begins with its first row."""
        if self._session is None:
            now = to_microseconds(time.time()), to_microseconds(time.monotonic())
            self._session = self._base.execute(
                "INSERT INTO session VALUES (NULL,?,?,?,?,?)",
                (*now, self._boot, self._program, tui.__version__),
            ).lastrowid
        assert self._session is not None
        return self._session

    @property
    def size(self) -> int:
        """Bytes of the file that are in use, without its log."""
        with _as_os_errors(self.path):
            pages = self._pragma("page_count") - self._pragma("freelist_count")
            return pages * self._pragma("page_size")

    @property
    def spare(self) -> int:
        """Bytes on the disk that are not in use, its log included: new rows take them first."""
        return self.path.stat().st_size - self.size + self._wal_size()

    @property
    def has_raw(self) -> bool:
        """True while the file has rows that are to be reduced later."""
        with _as_os_errors(self.path):
            found = self._base.execute(
                f"SELECT 1 FROM reply WHERE id > ? AND function IN {RECORDED_READS} LIMIT 1",
                (self._expired_to,),
            )
            return found.fetchone() is not None

    def write(self, replies: Sequence[ReplyRow], events: Sequence[EventRow]) -> None:
        """Write rows in one transaction, which is not flushed. Raises RecordHeld, OSError."""
        with _as_os_errors(self.path):
            if self._wal_size() > USUAL_WAL:
                self._checkpoint()
                if self._wal_size() > MOST_WAL:
                    raise RecordHeld("another program reads it without a pause")
        with self._transaction():
            self._write(replies, events)

    def _write(self, replies: Sequence[ReplyRow], events: Sequence[EventRow]) -> None:
        session, program = self._session_id(), self._id_of
        self._base.executemany(
            _INSERT_EVENT,
            [(session, *row[:5], program(row.who), row.data) for row in events],
        )
        start = 0
        for at, row in enumerate(replies):
            if ended := self._window.add(row):
                self._insert(replies[start:at])
                start = at
                self._reduce(ended, session)
                self._note_reduced()
        self._insert(replies[start:])

    def _insert(self, replies: Sequence[ReplyRow]) -> None:
        session, program = self._session_id(), self._id_of
        self._base.executemany(
            _INSERT_REPLY, [(session, *row[:-1], program(row.who)) for row in replies]
        )

    def end_window(self, mono: int) -> None:
        """Reduce what is older than the window of a time, although no reply has followed."""
        if ended := self._window.end(mono):
            with self._transaction():
                self._reduce(ended, self._session_id())
                self._note_reduced()

    def _reduce(self, rows: Sequence[ReducedRow], session: int) -> None:
        self._base.executemany(_INSERT_REDUCED, [(session, *row) for row in rows])

    def _note_reduced(self) -> None:
        self._base.execute(
            "UPDATE about SET value = (SELECT coalesce(max(id), 0) FROM reply)"
            " WHERE name = 'reduced to'"
        )

    def _id_of(self, who: str) -> int | None:
        """The number of a program's name; None for none."""
        if not who:
            return None
        if (number := self._who.get(who)) is None:
            self._base.execute("INSERT OR IGNORE INTO who (name) VALUES (?)", (who,))
            found = self._base.execute("SELECT id FROM who WHERE name = ?", (who,))
            number = self._who[who] = found.fetchone()[0]
        return number

    def expire(self, wall: float, mono: float) -> bool:
        """Remove some rows of reads older than an hour, which are reduced; True if more may be."""
        columns = "reply.id, function, reply.mono, reply.utc, boot"
        with self._transaction():
            rows = self._base.execute(
                f"SELECT {columns} FROM reply JOIN session ON session.id = session"
                " WHERE reply.id > ? ORDER BY reply.id LIMIT ?",
                (self._expired_to, EXPIRED_AT_A_TIME),
            ).fetchall()
            now = to_microseconds(wall), to_microseconds(mono)
            old = list(takewhile(lambda row: self._is_old(row, *now), rows))
            if old:
                last = old[-1][0]
                self._base.execute(
                    f"DELETE FROM reply WHERE id > ? AND id <= ? AND function IN {RECORDED_READS}",
                    (self._expired_to, last),
                )
                self._expired_to = last
        return len(old) == EXPIRED_AT_A_TIME

    def _is_old(self, row: tuple[int, int, int, int, str], wall: int, mono: int) -> bool:
        """True if a row is older than an hour: since this boot by a clock that does not jump."""
        _, _, then, utc, boot = row
        if boot == self._boot:
            return mono - then > RAW_KEPT
        # the time of day may have jumped since
        return wall - utc > RAW_KEPT or mono - self._begun > RAW_KEPT

    def shed(self) -> bool:
        """Remove some of the oldest rows; False if there are none.

        Whole replies go before reduced rows of their time, and events last: they name the profiles.
        """
        removed = 0
        for table, older in (("reply", _BEFORE_REDUCED), ("reduced", ""), ("event", "")):
            if removed:
                break
            with self._transaction():
                removed = self._base.execute(
                    f"DELETE FROM {table} WHERE id IN"
                    f" (SELECT id FROM {table} ORDER BY id LIMIT ?) {older}",
                    (SHED_AT_A_TIME,),
                ).rowcount
        if self._wal_size() > USUAL_WAL:
            self.flush()
        return removed > 0

    def trim(self, excess: int) -> None:
        """Remove the oldest rows, until so many bytes are free or no row is left."""
        least = self.size - excess
        while self.size > least and self.shed():
            pass

    def give_back(self) -> None:
        """Return some room of removed rows to the disk."""
        with _as_os_errors(self.path):
            self._give_back()

    def _give_back(self) -> bool:
        """Return room to the disk, a few MB at a time, as the log has it too; True if it did."""
        spare = self._pragma("freelist_count")
        if spare:
            # by a script: a statement ends after its first page
            self._base.executescript(f"PRAGMA incremental_vacuum({PAGES_GIVEN_BACK})")
            if self._wal_size() > USUAL_WAL:
                self._checkpoint()
        return self._pragma("freelist_count") < spare

    def flush(self) -> None:
        """Have the disk hold what was written; waits for the disk."""
        with _as_os_errors(self.path):
            self._checkpoint()

    def close(self, *, shrink: bool = False) -> None:
        """Reduce the rest, and close the file with a rollback journal unless it is being read.

        `shrink` returns the room of removed rows to the disk.
        """
        try:
            with _as_os_errors(self.path):
                if ended := self._window.end():
                    with self._transaction():
                        self._reduce(ended, self._session_id())
                        self._note_reduced()
                while shrink and self._give_back():
                    pass
                with suppress(sqlite3.OperationalError):  # read by another program at the moment
                    self._base.execute("PRAGMA journal_mode = DELETE")
        finally:
            self._base.close()

    def abandon(self) -> None:
        """Close the file as it is."""
        with suppress(sqlite3.Error):
            self._base.close()

    def _checkpoint(self) -> None:
        self._base.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()

    def _wal_size(self) -> int:
        try:
            return os.stat(f"{self.path}-wal").st_size
        except OSError:
            return 0

    def _pragma(self, name: str) -> int:
        number: int = self._base.execute(f"PRAGMA {name}").fetchone()[0]
        return number

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """One transaction, taken back if it fails. Raises OSError."""
        with _as_os_errors(self.path):
            self._base.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._base.execute("COMMIT")
            except BaseException:
                with suppress(sqlite3.Error):  # a full disk has taken it back
                    self._base.execute("ROLLBACK")
                raise


@contextmanager
def _as_os_errors(path: Path) -> Iterator[None]:
    """Raise errors of SQLite as RecordDamaged, RecordHeld or OSError."""
    try:
        yield
    except sqlite3.Error as error:
        number = getattr(error, "sqlite_errorcode", 0) & 0xFF
        if number in _DAMAGED:
            raise RecordDamaged(str(error), path) from error
        if number in _BUSY:
            raise RecordHeld(str(error)) from error
        raise from_sqlite(error, path) from error


@cache
def boot_id() -> str:
    """An id of the time since the computer was started; empty if the system has none."""
    try:
        return read_small_text(Path("/proc/sys/kernel/random/boot_id")).strip()
    except OSError:
        return ""
