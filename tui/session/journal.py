"""The record of everything that was written to a drive: JSON lines in the state folder, rotated."""

from __future__ import annotations

import json
import logging
from collections import deque
from dataclasses import asdict, dataclass
from datetime import datetime
from logging.handlers import RotatingFileHandler
from pathlib import Path
from threading import Lock

from .state import state_folder

NAME = "journal.jsonl"
LARGEST = 1_000_000
"""Bytes of one file; then the next one is begun."""
KEPT = 9
SHOWN = 500

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Entry:
    """One word that was written, or refused on the way."""

    time: str
    """Local time with its zone, to the millisecond."""
    line: str
    device: int
    profile: str
    code: str
    address: int
    old_raw: int | None
    old: str
    new_raw: int
    new: str
    answer: str
    """`ok`, or what the drive or the line said instead."""
    read_back: int | None
    why: str
    """The order or edit that it belongs to."""


class Journal:
    """Appends entries; keeps the last ones at hand. May be used from any thread."""

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder or state_folder()
        self._handler: RotatingFileHandler | None = None
        self._lock = Lock()
        self._recent: deque[Entry] = deque(maxlen=SHOWN)
        self.trouble = ""
        """Why entries cannot be kept, for the person; empty while they can."""

    @property
    def path(self) -> Path:
        """The file that is written now."""
        return self._folder / NAME

    @property
    def recent(self) -> tuple[Entry, ...]:
        """The entries since the start, oldest first."""
        return tuple(self._recent)

    def add(self, entry: Entry) -> None:
        """Keep an entry; a folder that cannot be written stops no command."""
        with self._lock:
            self._recent.append(entry)
            try:
                if self._handler is None:
                    self._folder.mkdir(parents=True, exist_ok=True)
                    self._handler = RotatingFileHandler(
                        self.path, maxBytes=LARGEST, backupCount=KEPT, encoding="utf-8"
                    )
                text = json.dumps(asdict(entry), ensure_ascii=False)
                self._handler.emit(logging.makeLogRecord({"msg": text}))
            except OSError as error:
                if not self.trouble:
                    log.error("the journal cannot be written: %s", error)
                self.trouble = f"The journal cannot be written: {error.strerror or error}."

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._handler is not None:
                self._handler.close()
                self._handler = None


def now_text() -> str:
    """The local time of an entry."""
    return datetime.now().astimezone().isoformat(timespec="milliseconds")
