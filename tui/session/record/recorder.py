"""Records what happens on a line, in a thread of its own: no request ever waits for the disk."""

from __future__ import annotations

import itertools
import json
import logging
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tui.bus.model import EndedExchange
from tui.drive.sentences import counted

from .clock_jumps import ClockJumps
from .disk_trouble import InternalFault, disk_words, unrecorded_text
from .ring import (
    DAMAGED_MARK,
    MOST_RECORDED,
    SECONDS_A_DAY,
    files_of_line,
    is_open_or_left,
    make_room,
    record_path,
)
from .schema import (
    EventRow,
    RecordDamaged,
    RecordHeld,
    ReplyRow,
    reply_row,
    stray_row,
    to_microseconds,
)

WRITTEN_EVERY = 0.5
"""Seconds from one transaction to the next: a killed program loses no more."""
FLUSHED_EVERY = 15.0
"""Seconds from one flush to the next: a power cut loses no more, and what the disk needs for it."""
RECORD_BACKLOG = 20_000
"""Rows that wait for the disk; further ones are lost, and counted."""
EVENTS_BEFORE = 100
"""Events that are kept before the first exchange; a program that sends none records nothing."""
WRITTEN_AT_A_TIME = 1000
"""Rows of one transaction."""
REDUCED_EVERY = 10.0
"""Seconds from one removal of reduced rows to the next."""
ROOM_MADE_EVERY = 10.0
TRIMMED_MORE = 4 << 20
"""Bytes beyond those needed by which a closed file is made smaller."""
RETRIED_AFTER = 2.0
"""Seconds after which a disk that refused is tried again."""
HELD_PATIENCE = 10.0
"""Seconds for which another program may hold the file before that is reported."""
SETTLED_AFTER = 20.0
"""Seconds without a failure after which that is reported: a full disk has room for a moment."""
RECORD_ENDS_WITHIN = 2.0
"""Seconds for which the end of the program waits for the disk."""
STANDING_EVENTS = ("profile", "block", "line settings")
"""Kinds of events that say how to read the rows that follow: each file has the last of them."""

if TYPE_CHECKING:
    from .record_file import RecordFile

log = logging.getLogger(__name__)

Recorded = EndedExchange | ReplyRow | EventRow


class LineRecorder:
    """Writes exchanges and events of one line into its files. For any thread.

    The thread starts with the first exchange. `note` never waits, and raises nothing.
    """

    def __init__(
        self,
        folder: Path,
        line: str,
        name: str,
        *,
        program: str = "",
        name_of: Callable[[str], str] = str,
        report: Callable[[str], None] = lambda _: None,
        is_on: Callable[[], bool] = lambda: True,
        most: int = MOST_RECORDED,
    ) -> None:
        """`line` is the line as text, `name` that of its files. `name_of` returns a program by id.

        `is_on` is called in the recorder's thread: it may read a file.

        `report` gets texts for people, in the recorder's thread: once when nothing can be recorded,
        once when it can be again, and for each jump of the computer's clock.
        """
        self._folder, self._line, self._name, self._program = folder, line, name, program
        self._name_of = name_of
        self._report = report
        self._is_on = is_on
        self._off = False
        self._most = most
        self._waiting: deque[Recorded] = deque()
        self._batch: list[ReplyRow | EventRow] = []
        self._lost = self._lost_reported = 0
        self._lost_since: tuple[float, float] | None = None
        self._lock = threading.Lock()
        self._files: dict[Path, RecordFile] = {}
        self._standing: dict[tuple[str, int | None], EventRow] = {}
        """The last events that each file begins with, by kind and device."""
        self._jumps = ClockJumps(self._tell)
        self._why = ""
        self._retry_at = self._failed = self._failing_since = 0.0
        self._reported = False
        """True after a failure was reported, until the end of it is."""
        self._lost_then = 0
        self._flushed = self._reduced = self._roomed = 0.0
        self._thread: threading.Thread | None = None
        self._wake = threading.Event()
        self._closed = False

    # For the line's thread

    def note(self, item: Recorded) -> None:
        """Record an exchange or an event."""
        if self._off:
            return
        if len(self._waiting) >= RECORD_BACKLOG:
            self._lose(1)
            return
        self._waiting.append(item)
        if self._thread is not None:
            return
        if not isinstance(item, EventRow):
            self._begin()
        elif len(self._waiting) > EVENTS_BEFORE:
            self._waiting.popleft()

    def close(self, timeout: float = RECORD_ENDS_WITHIN) -> bool:
        """Write the rest and close the files; False if the disk needs longer than `timeout`."""
        self._closed = True
        self._wake.set()
        if (thread := self._thread) is None:
            return True
        thread.join(timeout)
        return not thread.is_alive()

    def files(self) -> list[Path]:
        """Return the files of this line, the oldest day first; raises OSError.

        Another process may have written them, such as the keeper of the line.
        """
        return files_of_line(self._folder, self._name)

    @property
    def waiting(self) -> int:
        """Number of items that wait for the disk."""
        return len(self._waiting) + len(self._batch)

    @property
    def lost(self) -> int:
        """Number of rows that were not recorded."""
        return self._lost

    @property
    def trouble(self) -> str:
        """Why nothing can be recorded now; empty if it can."""
        return self._why

    def _lose(self, rows: int) -> None:
        if not rows:
            return
        with self._lock:
            self._lost += rows
            if self._lost_since is None:
                self._lost_since = time.time(), time.monotonic()

    def _begin(self) -> None:
        with self._lock:  # a prepared stop may be sent by another thread
            if self._closed or self._thread is not None:
                return
            self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
            try:
                self._thread.start()
            except RuntimeError as error:
                self._thread = None  # no thread to be had: the next row tries again
                log.error("the recorder has no thread: %s", error)

    # The recorder's thread

    def _work(self) -> None:
        if hasattr(signal, "pthread_sigmask"):
            # it may start before the threads that wait for signals
            signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        if not self._is_on():
            self._off = True
            self._waiting.clear()
            return
        while not self._closed:
            self._wake.wait(WRITTEN_EVERY)
            self._turn()
        self._turn()
        self._lose(self.waiting)
        self._close_files()

    def _turn(self) -> None:
        """Write what waits, and look after the files; report what goes wrong."""
        now = time.monotonic()
        if self._why and now < self._retry_at and not self._closed:
            return
        try:
            self._write_waiting()
            self._look_after(now)
            self._settle(now)
        except OSError as error:
            self._fail(error, now)
        except Exception as error:
            log.exception("the recorder")
            self._fail(InternalFault(str(error)), now)

    def _write_waiting(self) -> None:
        while self._waiting or self._batch:
            if not self._batch:
                count = min(len(self._waiting), WRITTEN_AT_A_TIME)
                items = [self._waiting.popleft() for _ in range(count)]
                rows = [row for item in items for row in self._rows(item)]
                self._batch = self._jumps.noted(rows)
            day, rows_of_day = next(itertools.groupby(self._batch, _day))
            part = list(rows_of_day)
            self._file(day).write(
                [row for row in part if isinstance(row, ReplyRow)],
                [row for row in part if isinstance(row, EventRow)],
            )
            self._batch = self._batch[len(part) :]
            self._recover()

    def _rows(self, item: Recorded) -> Sequence[ReplyRow | EventRow]:
        """The rows of an item: of an exchange, with the frames that belong to no request."""
        if isinstance(item, EndedExchange):
            strays = [stray_row(item, data) for data in item.strays]
            if not item.request:
                return strays
            who = self._name_of(item.program) if item.program else ""
            return (*strays, reply_row(item, who))
        if isinstance(item, EventRow) and item.kind in STANDING_EVENTS:
            self._standing[item.kind, item.device] = item
        return (item,)

    def _file(self, day: int) -> RecordFile:
        path = record_path(self._folder, self._name, day)
        if (file := self._files.get(path)) is None:
            if not self._files:
                self._adopt_left(path)
            file = self._files[path] = self._opened(path)
            file.write((), tuple(self._standing.values()))
        return file

    def _opened(self, path: Path) -> RecordFile:
        """Open a file; a damaged one is renamed, and a new one begins."""
        from .record_file import RecordFile  # most programs need no SQLite

        try:
            return RecordFile(path, self._line, self._program)
        except RecordDamaged as error:
            self._set_aside(error)
            return RecordFile(path, self._line, self._program)

    def _set_aside(self, error: RecordDamaged) -> None:
        path = error.path
        aside = path.with_stem(f"{path.stem}{DAMAGED_MARK}{time.time():.0f}")
        path.replace(aside)
        for side in ("-wal", "-shm"):
            with suppress(OSError):
                path.with_name(path.name + side).unlink()
        self._tell(f"The record {path} was damaged ({error}). It is now {aside.name}.")

    def _adopt_left(self, current: Path) -> None:
        """Open files of earlier days that are not reduced, or were left by a killed program."""
        files = [path for path in files_of_line(self._folder, self._name) if path != current]
        for path in files:
            if path in files[-2:] or is_open_or_left(path):  # a day ended within the last hour
                self._files[path] = self._opened(path)

    def _look_after(self, now: float) -> None:
        if now - self._flushed > FLUSHED_EVERY:
            self._flushed = now
            for file in self._files.values():
                file.flush()
        if now - self._reduced > REDUCED_EVERY:
            self._reduced = now
            self._reduce(now)
        if now - self._roomed > ROOM_MADE_EVERY and self._files:
            self._roomed = now
            self._make_room(now)

    def _reduce(self, now: float) -> None:
        """Remove reads older than an hour, for a moment at most; close files without any."""
        wall = time.time()
        today = record_path(self._folder, self._name, int(wall // SECONDS_A_DAY))
        for path, file in list(self._files.items()):
            file.end_window(to_microseconds(now))
            while file.expire(wall, now):
                if time.monotonic() - now > WRITTEN_EVERY / 2:
                    self._reduced = 0.0  # the rest in the next turn
                    return
            if path == today:
                continue
            file.give_back()  # the new day needs that room
            if not file.has_raw:
                del self._files[path]
                file.close(shrink=True)

    def _make_room(self, now: float) -> None:
        """Remove the oldest data if there is too much, for a moment at most."""
        spare = sum(file.spare for file in self._files.values())
        excess, closed = make_room(self._folder, self._files, self._most + spare)
        if closed is not None:
            self._trim(closed, excess)
            return
        for _, file in sorted(self._files.items()):
            while excess > 0:
                before = file.size
                if not file.shed():
                    break
                excess -= before - file.size
                if time.monotonic() - now > WRITTEN_EVERY / 2:
                    self._roomed = 0.0
                    return

    def _trim(self, path: Path, excess: int) -> None:
        """Remove the oldest rows of a closed file, some more than needed: it is done seldom."""
        with suppress(RecordHeld):  # a program reads it: later
            file = self._opened(path)
            try:
                file.trim(excess + min(TRIMMED_MORE, self._most // 32))
            finally:
                file.close(shrink=True)

    def _recover(self) -> None:
        """Record what was lost until now."""
        why, self._why, self._failing_since = self._why, "", 0.0
        with self._lock:
            lost, since = self._lost - self._lost_reported, self._lost_since
            self._lost_reported, self._lost_since = self._lost, None
        text = counted(lost, "1 row was not recorded.", "{count} rows were not recorded.")
        if since is not None:
            wall, mono = since
            data = json.dumps({"rows": lost, "utc": wall, "mono": mono, "why": why}).encode()
            now = to_microseconds(time.time()), to_microseconds(time.monotonic())
            self._waiting.appendleft(EventRow(*now, None, "lost", text, data=data))

    def _settle(self, now: float) -> None:
        """Report that recording goes on, once nothing has failed for a while."""
        if not self._reported or now - self._failed < SETTLED_AFTER:
            return
        self._reported, before, self._lost_then = False, self._lost_then, self._lost
        lost = self._lost - before
        text = counted(lost, "1 row was not recorded.", "{count} rows were not recorded.")
        self._tell(f"Recording again. {text}" if lost else "Recording again.")

    def _fail(self, error: OSError, now: float) -> None:
        """Give the files up until the disk is tried again, and report it once."""
        self._failing_since = self._failing_since or now
        self._why, self._failed = disk_words(error), now
        self._retry_at = now + RETRIED_AFTER
        patience = HELD_PATIENCE if isinstance(error, RecordHeld) else 0.0
        first = not self._reported and now - self._failing_since >= patience
        self._reported = self._reported or first
        if not isinstance(error, RecordHeld):
            for file in self._files.values():
                file.abandon()
            self._files.clear()
        if isinstance(error, RecordDamaged):
            with suppress(OSError):
                self._set_aside(error)
        if first:
            self._tell(unrecorded_text(error, self._folder, RECORD_BACKLOG))

    def _tell(self, text: str) -> None:
        log.warning("%s", text)
        try:
            self._report(text)
        except Exception:
            log.exception("a listener of the recorder failed")

    def _close_files(self) -> None:
        for file in self._files.values():
            try:
                file.close()
            except OSError as error:
                log.error("the record was not closed: %s", error)
        self._files.clear()


def _day(row: ReplyRow | EventRow) -> int:
    """The day of a row in UTC, by the clock as it was then."""
    return row.utc // (SECONDS_A_DAY * 1_000_000)
