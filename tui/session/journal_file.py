"""Files of the journal: each line is one write at the end of the file, flushed to the disk.

Several programs may append at the same time. They take turns by a lock on the folder. Without such
locks, the append mode of the system keeps their lines apart.
"""

from __future__ import annotations

import errno
import json
import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from itertools import pairwise
from pathlib import Path

from tui.drive.small_file import sync_folder

from .stored import make_folder

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

JOURNAL_NAME = "journal.jsonl"
LARGEST_FILE = 1_000_000
"""Bytes of one file; the next line begins a new file."""
FILES_KEPT = 9
"""Number of older files that are kept."""
TURN_PATIENCE = 0.5
"""Seconds that a line waits for other programs; then it is appended anyway."""
TURN_POLL_INTERVAL = 0.01
OWN_MODE = 0o600
CUT_OFF = "the line before this one was cut off: by a crash, a power cut or a full disk"


class JournalFile:
    """Appends lines to the file of a folder; several programs may do so at a time."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / JOURNAL_NAME
        self._tried = b""
        """The line that could not be written, or not flushed."""

    @property
    def all(self) -> list[Path]:
        """All files that may exist, the oldest first."""
        return [*(self._older(number) for number in range(FILES_KEPT, 0, -1)), self.path]

    def append(self, text: str) -> None:
        """Append a line, flushed to the disk. Raises OSError; the line may be written even then.

        Another attempt overwrites what the first has left. An incomplete line of an earlier program
        stays, and is marked as cut off.
        """
        line = text.encode("utf-8", "backslashreplace") + b"\n"
        tried, self._tried = self._tried, line
        make_folder(self.path.parent)
        with folder_turn(self.path.parent) as alone:
            if alone:
                self._rotate(len(line))
            # opened for each line: another program may have begun the next file meanwhile
            handle = _opened(self.path)
            try:
                start = self._put(handle, line, tried, alone=alone)
            except BaseException:
                os.close(handle)
                raise
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
        if start == 0:  # the file is new, or was when this line was first tried
            sync_folder(self.path.parent)
        self._tried = b""

    def _put(self, handle: int, line: bytes, tried: bytes, *, alone: bool) -> int:
        """Write a line at the end; return its offset."""
        size = os.fstat(handle).st_size
        start = max(0, size - len(line))
        os.lseek(handle, start, os.SEEK_SET)
        end = os.read(handle, len(line))
        if end == line == tried:
            # it stands there and was not flushed: written anew, it will be
            with self.path.open("rb+", buffering=0) as file:
                file.seek(start)
                file.write(line)
            return start
        _write(handle, line if end[-1:] in (b"", b"\n") else b"\n" + _mark() + line, size, alone)
        return size

    def _older(self, number: int) -> Path:
        return self.path.with_name(f"{JOURNAL_NAME}.{number}")

    def _rotate(self, length: int) -> None:
        size = self.path.stat().st_size if self.path.exists() else 0
        if not size or size + length <= LARGEST_FILE:
            return
        for older, younger in pairwise(self.all):
            if younger.exists():
                younger.replace(older)
        sync_folder(self.path.parent)


@contextmanager
def folder_turn(folder: Path) -> Iterator[bool]:
    """Make other programs wait for a folder; yield False if one keeps its lock too long."""
    if fcntl is None:
        yield True
        return
    handle = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        yield _locked(handle)
    finally:
        os.close(handle)


def _locked(folder: int) -> bool:
    """Lock a folder against other programs; also True if the system has no such locks."""
    end = time.monotonic() + TURN_PATIENCE
    while True:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > end:
                return False
            time.sleep(TURN_POLL_INTERVAL)
        except OSError:
            return True
        else:
            return True


def _opened(path: Path) -> int:
    """Open a file for appending that only its owner may read. Raises OSError."""
    flags = os.O_RDWR | os.O_APPEND | os.O_CREAT
    # a pipe in its place must not hold up the journal
    flags |= getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    handle = os.open(path, flags, OWN_MODE)
    try:
        reported = os.fstat(handle)
        if not stat.S_ISREG(reported.st_mode):
            raise OSError(errno.EINVAL, "Not a regular file")
        if reported.st_mode & 0o077 and hasattr(os, "fchmod"):
            with suppress(OSError):  # of another owner, or a file system without modes
                os.fchmod(handle, OWN_MODE)
    except BaseException:
        os.close(handle)
        raise
    return handle


def _write(handle: int, data: bytes, start: int, alone: bool) -> None:
    """Append in one write; remove a part that a full disk has accepted. Raises OSError."""
    done = 0
    try:
        while done < len(data):
            done += os.write(handle, data[done:])
    except OSError:
        if done and alone and os.fstat(handle).st_size == start + done:
            with suppress(OSError):
                os.ftruncate(handle, start)
        raise


def _mark() -> bytes:
    """Return the line that marks the previous one as incomplete."""
    when = datetime.now().astimezone().isoformat(timespec="milliseconds")
    return json.dumps({"time": when, "kind": "mended", "why": CUT_OFF}).encode() + b"\n"
