"""A recording of named codes: rows from the cycles of monitors, written to one file."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tui.drive.profile.profile import digest_of
from tui.drive.values import to_words, word_count

from ..reading import Reading
from ..record.clock_jumps import ClockJumps
from ..record.disk_trouble import disk_words
from ..record.recorder import FLUSHED_EVERY
from ..record.schema import GOOD, REFUSED, SILENT, EventRow, ReplyRow, to_microseconds
from ..shown import Quality

if TYPE_CHECKING:
    from tui.drive.profile.schema import Parameter

    from ..drive import DriveSession
    from ..record.record_file import RecordFile

ROWS_KEPT = 100_000
"""Rows that wait for a disk that accepts none; then the oldest are lost."""
CLOSED_WITHIN = 5.0
"""Seconds in which the disk must accept the last rows."""
_LAST = 1 << 62
RecordingRow = ReplyRow | EventRow


def rows_of_cycle(device: int, readings: Sequence[Reading], wall: float) -> list[ReplyRow]:
    """Return the rows of the values of a cycle; `wall` is its end in seconds since 1970.

    They have the time of the reply, as that of the request is not known here. A value that was not
    read in the cycle has no words.
    """
    now = time.monotonic()
    return [_row(device, reading, wall, now) for reading in readings]


def _row(device: int, reading: Reading, wall: float, now: float) -> ReplyRow:
    parameter = reading.parameter
    words, mono = None, now
    if reading.quality is Quality.GOOD and reading.raw is not None:
        registers = to_words(parameter, reading.raw, 0)
        words = b"".join(word.to_bytes(2, "big") for word in registers)
        mono = reading.time
    quality = GOOD if words is not None else REFUSED if reading.absent else SILENT
    at = to_microseconds(wall - (now - mono)), to_microseconds(mono)
    count = word_count(parameter)
    return ReplyRow(
        *at, 0, device, parameter.function, parameter.address, count, quality, words,
        None, None, 0, "",
    )  # fmt: skip


def parameter_events(session: DriveSession, codes: Sequence[str]) -> list[EventRow]:
    """Return the events that say how to read the rows of a drive."""
    profile = session.profile
    now = to_microseconds(time.time()), to_microseconds(time.monotonic())
    about = {"profile": profile.id, "hash": digest_of(profile)}
    events = [EventRow(*now, session.device, "profile", json.dumps(about))]
    for code in codes:
        parameter = profile[code]
        form = {
            "code": code, "name": parameter.name, "address": parameter.address,
            "function": parameter.function, "type": parameter.type, "unit": parameter.unit,
            "scale": parameter.scale, "offset": parameter.offset,
            "low_word_first": parameter.low_word_first,
            "words": parameter.words, "low_byte_first": parameter.low_byte_first,
        }  # fmt: skip
        events.append(EventRow(*now, session.device, "parameter", json.dumps(form)))
    return events


def trigger_event(device: int, text: str, wall: float) -> EventRow:
    """Return the event of a trigger that fired at `wall` (seconds since 1970)."""
    mono = time.monotonic() - (time.time() - wall)
    return EventRow(to_microseconds(wall), to_microseconds(mono), device, "trigger", text)


def values_in(path: Path, places: Sequence[tuple[int, Parameter]]) -> int:
    """Return the number of values in a recording, of each device and parameter; 0 if it is damaged.

    It reads them all: what a program reports as recorded is there. Failed reads are not counted.
    """
    import sqlite3

    from ..record.reader import RecordReader

    each = {(device, item.function, item.address) for device, item in places}
    try:
        with closing(RecordReader(path)) as reader:
            return sum(
                sum(
                    found.word is not None
                    for found in reader.words(device, address, 0, _LAST, function=function)
                )
                for device, function, address in each
            )
    except (OSError, sqlite3.Error):
        return 0


class RecordingFile:
    """Writes rows to one file in a thread of its own: a slow disk delays no poll.

    For one thread. Rows that the disk refuses are written later, with the next ones.
    """

    def __init__(
        self, path: Path, line: str, program: str, report: Callable[[str], object] = len
    ) -> None:
        """Create the file; `report` gets a text for each jump of the clock. Raises OSError."""
        self.path = path
        self.written = self.lost = 0
        """Numbers of values that were written, and of rows that were lost."""
        self.trouble = ""
        """Why the last rows were not written; empty if they were."""
        self._create = partial(_created, path, line, program)
        self._jumps = ClockJumps(report)
        self._waiting: list[RecordingRow] = []
        self._flushed = time.monotonic()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="recording")
        self._writing: Future[list[RecordingRow]] | None = None
        try:
            self._file: RecordFile | None = self._thread.submit(self._create).result()
        except BaseException:
            self._thread.shutdown(wait=False)
            raise

    def add(self, rows: Sequence[RecordingRow]) -> None:
        """Add rows, which `write` writes."""
        self._waiting += self._jumps.noted(rows)
        if (excess := len(self._waiting) - ROWS_KEPT) > 0:
            del self._waiting[:excess]
            self.lost += excess

    def write(self) -> None:
        """Have the thread write what waits, unless it is still writing."""
        if self._writing is not None:
            if not self._writing.done():
                return
            self._waiting[:0] = self._writing.result()
        rows, self._waiting = self._waiting, []
        self._writing = self._thread.submit(self._write, rows)

    def _write(self, rows: list[RecordingRow]) -> list[RecordingRow]:
        """Write rows, and return those that were not written."""
        values = [row for row in rows if isinstance(row, ReplyRow)]
        try:
            if self._file is None:
                self._file = self._create()
            if (now := time.monotonic()) - self._flushed > FLUSHED_EVERY:
                self._flushed = now
                self._file.flush()
            self._file.write(values, [row for row in rows if isinstance(row, EventRow)])
        except OSError as error:
            self.trouble = disk_words(error)
            if self._file is not None:
                self._file.abandon()
                self._file = None
            return rows
        self.trouble = ""
        self.written += sum(row.words is not None for row in values)
        return []

    def close(self) -> None:
        """Write the rest and close the file, within CLOSED_WITHIN seconds."""
        with suppress(OSError, TimeoutError):
            if self._writing is not None:
                self._waiting[:0] = self._writing.result(CLOSED_WITHIN)
                self._writing = None
            self.write()
            self._thread.submit(self._close).result(CLOSED_WITHIN)
        self._thread.shutdown(wait=False)

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()


def _created(path: Path, line: str, program: str) -> RecordFile:
    from ..record.record_file import RecordFile

    return RecordFile(path, line, program)
