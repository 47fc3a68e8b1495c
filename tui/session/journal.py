"""Record of all writes to drives: JSON lines in the state folder, in rotated files.

No caller waits for the disk. A thread writes the entries one by one, in their order, so a kill -9
or a power cut loses at most those that were not flushed yet. A program that ends waits for its last
ones, `JOURNAL_PATIENCE` at most.
"""

from __future__ import annotations

import atexit
import json
import logging
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Literal

from tui.drive.plain import escaped_json
from tui.drive.sentences import counted

from .connect.line_key import SIMULATED_PREFIX
from .eeprom_counts import EepromCounts, EepromWrite
from .journal_file import JournalFile
from .paths import state_folder

ENTRIES_KEPT = 500
"""Entries kept in memory."""
JOURNAL_BACKLOG = 10_000
"""Entries that wait for a disk that accepts none; then the oldest is dropped."""
RETRY_DISK_AFTER = 1.0
"""Seconds after which a disk that refused an entry is tried again."""
IDLE_ENDS_AFTER = 10.0
"""Seconds without an entry after which the thread ends; the next entry begins another."""
SLOW = 5.0
"""Seconds in which a disk must accept an entry, else it counts as hanging."""
COUNTED_AT_ONCE = 50
"""EEPROM writes that are added to their file at once, while more entries wait."""
JOURNAL_PATIENCE = 3.0
"""Seconds that a reader or the end of the program waits for the disk."""

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Entry:
    """One word that was written, or refused before its frame; or a trip that was seen."""

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
    """`ok`, or the error of the drive or the line."""
    read_back: int | None
    why: str
    """The command or edit of which it is a part."""
    kind: Literal["write", "fault", "read-back", "proof", "reset"] = "write"
    """`fault`: `code` and `new` are the fault's, nothing was written. `answer` is `tripped` for a
    trip that was seen, `seen` for a fault that was there at the first sight, `reset` for its end.
    `read-back` completes a write whose answer was lost: `read_back` is what the drive held then.
    `proof` is a proof of communication loss, whose words are in `new`.
    `reset` set the drive's own counters to 0, by the function that `code` names."""
    of: str = ""
    """The time of the write that a `read-back` completes."""
    drive: str = ""
    """Identity that the drive reported, if the write is counted."""
    eeprom: Literal["", "write", "save"] = ""
    """`write` if the drive may have stored the value in its EEPROM, `save` if all settings."""
    within: float = 0.0
    """Seconds by which the time of a `fault` entry may differ; 0 if it was noted at once."""


FAULT_WHYS = {
    "tripped": "the trip was seen",
    "seen": "in fault when first seen",
    "reset": "the end was seen",
    "code read": "the code was read after the state",
}
"""Reason by the answer of a `fault` entry. Older files have `seen from here` for each."""
RECORD_SHOWS_IT = "the record of the line shows it"
"""Reason of a `fault` entry that is not in the journal."""


class Journal:
    """Appends entries, and keeps the last ones in memory. For any thread.

    Entries that the disk refuses are kept and tried again. `on_trouble` is called with `trouble`,
    in the journal's thread, as soon as the disk refuses.
    """

    def __init__(
        self, folder: Path | None = None, on_trouble: Callable[[str], None] | None = None
    ) -> None:
        folder = folder or state_folder()
        self._file = JournalFile(folder)
        self.eeprom = EepromCounts(folder)
        self._uncounted: list[EepromWrite] = []
        """Writes that are not in `eeprom` yet; of the journal's thread."""
        self._on_trouble = on_trouble
        self._changed = threading.Condition()
        """Guards the fields below; never held during disk work."""
        self._recent: deque[Entry] = deque(maxlen=ENTRIES_KEPT)
        self._sent: deque[Entry] = deque(maxlen=ENTRIES_KEPT)
        self._waiting: deque[Entry] = deque()
        self._begun: float | None = None
        """Since when an entry is being written (monotonic)."""
        self._thread: threading.Thread | None = None
        self._why = ""
        self._failures = 0
        self._lost = 0
        self._closed = False
        self._requested = False
        """True if a caller waits for another attempt that has not begun yet."""
        self._ending: Callable[[], None] | None = None
        """Wait for the last entries if the program ends without close()."""

    @property
    def path(self) -> Path:
        """The file that is written now."""
        return self._file.path

    @property
    def files(self) -> list[Path]:
        """All files that may exist, the oldest first."""
        return self._file.all

    @property
    def recent(self) -> tuple[Entry, ...]:
        """Writes since the start, oldest first; on the disk or not."""
        with self._changed:
            return tuple(entry for entry in self._recent if entry.kind == "write")

    @property
    def proofs(self) -> tuple[Entry, ...]:
        """Tests of a communication loss since the start, oldest first."""
        with self._changed:
            return tuple(entry for entry in self._recent if entry.kind == "proof")

    @property
    def sent(self) -> tuple[Entry, ...]:
        """Writes whose frame was sent, or may have been; oldest first."""
        with self._changed:
            return tuple(self._sent)

    @property
    def lost(self) -> int:
        """Number of entries that were dropped because too many waited for the disk."""
        with self._changed:
            return self._lost

    @property
    def unkept(self) -> int:
        """Number of entries that are not on the disk: waiting for it, or lost."""
        with self._changed:
            return len(self._waiting) + (self._begun is not None) + self._lost

    @property
    def trouble(self) -> str:
        """Why entries cannot be written, for a person; empty if they can."""
        with self._changed:
            why, lost = self._why, self._lost
            if self._begun is not None and (since := time.monotonic() - self._begun) > SLOW:
                why = f"the disk has not answered for {since:.0f} s"
        if not why:
            return ""
        reported = f"The journal cannot be written: {why}: {self.path}."
        if not lost:
            return reported
        return f"{reported} {counted(lost, '1 entry lost.', '{count} entries lost.')}"

    def add(self, entry: Entry, *, sent: bool = True) -> None:
        """Add an entry; return immediately and never raise, whatever the disk does.

        `sent` is False for a write that was refused before its frame.
        """
        if entry.eeprom and not sent:
            entry = replace(entry, eeprom="")
        with self._changed:
            if sent and entry.kind in ("write", "reset"):
                self._sent.append(entry)
            self._recent.append(entry)
            self._waiting.append(entry)
            self._closed = False
            self._drop()
            self._end_with_program()
            self._begin()
            self._changed.notify_all()

    def flush(self, timeout: float = JOURNAL_PATIENCE) -> bool:
        """Wait until all entries are on the disk, at most so many seconds; return False if not.

        A disk that refuses is tried once more, without waiting.
        """
        with self._changed:
            failures = self._failures
            if not self._is_done():
                self._requested = True
                self._begin()
                self._changed.notify_all()
            self._changed.wait_for(lambda: self._is_done() or self._failures > failures, timeout)
            return self._is_done()

    def close(self, timeout: float = JOURNAL_PATIENCE) -> bool:
        """Flush the rest as flush() does; a disk that still refuses is not tried again."""
        with self._changed:
            self._closed = True
            if self._ending is not None:
                atexit.unregister(self._ending)
                self._ending = None
            self._changed.notify_all()
        return self.flush(timeout)

    def _end_with_program(self) -> None:
        if self._ending is not None:
            return
        own = weakref.ref(self)

        def ending() -> None:
            if (journal := own()) is not None:
                journal.flush()

        self._ending = ending
        atexit.register(ending)

    def _is_done(self) -> bool:
        return not self._waiting and self._begun is None

    def _drop(self) -> None:
        while len(self._waiting) > JOURNAL_BACKLOG:
            self._waiting.popleft()
            self._lost += 1

    def _begin(self) -> None:
        if self._thread is not None:
            return
        thread = threading.Thread(target=self._work, name="journal", daemon=True)
        try:
            thread.start()
        except RuntimeError as error:
            # no thread to be had: the next entry tries again
            self._why = str(error)
            self._failures += 1
        else:
            self._thread = thread

    def _work(self) -> None:
        while (entry := self._next()) is not None:
            why = self._trouble_with(entry)
            with self._changed:
                assert self._begun is not None
                took, self._begun = time.monotonic() - self._begun, None
                before, self._why = self._why, why
                if why:
                    self._waiting.appendleft(entry)
                    self._drop()
                lost, left = self._lost, len(self._waiting)
            _tell(before, why, took, left, lost)
            if why and not before:
                self._cry()
            # who waits goes on once the trouble was told
            with self._changed:
                self._failures += bool(why)
                self._changed.notify_all()
            if why and not self._may_go_on():
                return

    def _next(self) -> Entry | None:
        """Return the next entry to write; None if the thread must end."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed, IDLE_ENDS_AFTER)
            if not self._waiting:
                self._thread = None
                return None
            self._begun, self._requested = time.monotonic(), False
            return self._waiting.popleft()

    def _may_go_on(self) -> bool:
        """Wait, then return True if the disk must be tried again."""
        with self._changed:
            if self._closed and not self._requested:
                self._thread = None
                return False
            self._changed.wait_for(lambda: self._requested, RETRY_DISK_AFTER)
            return True

    def _cry(self) -> None:
        try:
            if self._on_trouble is not None:
                self._on_trouble(self.trouble)
        except Exception:
            log.exception("a listener of the journal failed")

    def _trouble_with(self, entry: Entry) -> str:
        """Write an entry; return the error as text, or an empty string."""
        try:
            self._file.append(escaped_json(json.dumps(asdict(entry), ensure_ascii=False)))
        except OSError as error:
            return error.strerror or str(error)
        except Exception as error:
            log.exception("the journal")
            return str(error) or type(error).__name__
        self._count(entry)
        return ""

    def _count(self, entry: Entry) -> None:
        """Count a write to an EEPROM, together with those that follow; never raise.

        A simulated drive is a new one each time: its writes are not counted.
        """
        simulated = entry.line.startswith(SIMULATED_PREFIX)
        if entry.eeprom and entry.kind == "write" and not simulated:
            code = entry.code if entry.eeprom == "write" else ""
            place = (entry.line, entry.device, entry.profile, entry.drive, code)
            self._uncounted.append(EepromWrite(*place, time.time()))
        with self._changed:
            more = any(waiting.eeprom for waiting in self._waiting)
        if not self._uncounted or (more and len(self._uncounted) < COUNTED_AT_ONCE):
            return
        try:
            self.eeprom.add(self._uncounted)
        except Exception as error:
            log.warning("%d EEPROM writes are not counted yet: %s", len(self._uncounted), error)
            del self._uncounted[:-JOURNAL_BACKLOG]
        else:
            self._uncounted.clear()


def _tell(before: str, why: str, took: float, left: int, lost: int) -> None:
    """Log when the journal cannot be written, and when it can again."""
    if why and not before:
        log.error("the journal cannot be written: %s", why)
    elif before and not why:
        log.warning("the journal is written again: %d entries wait, %d lost so far", left, lost)
    elif took > SLOW:
        log.warning("the disk took %.0f s for an entry of the journal", took)


def now_text() -> str:
    """Return the current local time for an entry."""
    return entry_time(None)


def entry_time(wall: float | None) -> str:
    """Return the local time for an entry: `wall` in seconds since 1970 (default: now)."""
    when = datetime.now() if wall is None else datetime.fromtimestamp(wall)
    return when.astimezone().isoformat(timespec="milliseconds")
