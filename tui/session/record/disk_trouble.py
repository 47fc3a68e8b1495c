"""Errors of the disk in plain words."""

from __future__ import annotations

import errno
import sqlite3
import tempfile
from pathlib import Path

_WORDS = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "this user's share of the disk is full",
    errno.EROFS: "the disk is read-only",
    errno.EACCES: "this user may not write there",
    errno.EPERM: "this user may not write there",
    errno.EIO: "the disk reports an error",
    errno.ENOENT: "the folder does not exist",
    errno.ENOTDIR: "a file is in the place of a folder",
}
_NUMBERS = {
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_READONLY: errno.EROFS,
    sqlite3.SQLITE_IOERR: errno.EIO,
    sqlite3.SQLITE_CANTOPEN: errno.EIO,
}
_VAGUE = (sqlite3.SQLITE_IOERR, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY)
_TRIED_BYTES = 1 << 16


class InternalFault(OSError):
    """Internal error of the recorder, not an error of the disk."""


def disk_words(error: OSError) -> str:
    """Return an error in plain words; unchanged if there are none for it."""
    if isinstance(error, InternalFault):
        return "internal error (see the log)"
    return _WORDS.get(error.errno or 0) or error.strerror or str(error)


def unrecorded_text(error: OSError, folder: Path, rows: int) -> str:
    """Return the message that nothing is recorded; `rows` is how many wait in memory at most."""
    why, internal = disk_words(error), isinstance(error, InternalFault)
    text = (
        f"Nothing is recorded: {why if internal else f'{why}: {folder}'}."
        f" Up to {rows:,} rows wait in memory, further ones are lost."
        " Drives are polled and stopped as before."
    )
    if internal:
        return f"{text} Recording is tried again automatically."
    return f"{text} Recording goes on when the folder can be written."


def from_sqlite(error: sqlite3.Error, path: Path) -> OSError:
    """Return an error of SQLite as OSError with the number of its cause, if that is known.

    SQLite reports a disk that has become read-only as "disk I/O error". So a file without a name
    is written beside `path`, and its error is the cause.
    """
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF
    if code in _VAGUE:
        try:
            with tempfile.TemporaryFile(dir=path.parent) as file:
                file.write(bytes(_TRIED_BYTES))
        except OSError as cause:
            return cause
    number = _NUMBERS.get(code)
    return OSError(str(error)) if number is None else OSError(number, str(error))
