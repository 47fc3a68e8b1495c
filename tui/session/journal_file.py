"""The files of the journal: each line is flushed to the disk before the next one is begun."""

from __future__ import annotations

import os
from itertools import pairwise
from pathlib import Path

from .starts.files import sync_folder

JOURNAL_NAME = "journal.jsonl"
LARGEST_FILE = 1_000_000
"""Bytes of one file; then the next one is begun."""
FILES_KEPT = 9
"""Older files beside the one that is written."""


class JournalFile:
    """Appends lines to the file of a folder; several programs may do so at a time."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / JOURNAL_NAME
        self._tried = b""
        """The line that could not be written, or not flushed."""

    @property
    def all(self) -> list[Path]:
        """Every file that there may be, the oldest first."""
        return [*(self._older(number) for number in range(FILES_KEPT, 0, -1)), self.path]

    def append(self, text: str) -> None:
        """Put a line down, flushed to the disk. Raises OSError; the line may stand there even so.

        Tried again, it is written over what the first try has left.
        """
        line = text.encode("utf-8", "backslashreplace") + b"\n"
        tried, self._tried = self._tried, line
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._rotate(len(line))
        # opened for each line: another program may have begun the next file meanwhile
        with self.path.open("ab+", buffering=0) as file:
            start = max(0, file.seek(0, os.SEEK_END) - len(line))
            file.seek(start)
            end = file.read()
        if end == line == tried:
            self._put(line, "rb+", start)
        else:
            # a line that was cut off damages no other
            self._put(line if end[-1:] in (b"", b"\n") else b"\n" + line, "ab")
        if start == 0:  # the file is new, or was when this line was first tried
            sync_folder(self.path.parent)
        self._tried = b""

    def _put(self, data: bytes, mode: str, start: int = 0) -> None:
        with self.path.open(mode, buffering=0) as file:
            file.seek(start)
            while data:
                data = data[file.write(data) :]
            os.fsync(file.fileno())

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
