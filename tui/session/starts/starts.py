"""Records of motor starts, by which the next program knows the motors that this one left running.

Call begin() before the run frame, sent() after it, end() at standstill, note_stop() at a stop.
Only begin() and the methods that read files wait for the disk.
"""

from __future__ import annotations

import logging
import math
import os
import threading
from collections import deque
from collections.abc import Collection, Iterable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tui.bus.program import pid_namespace
from tui.safety import START_PATIENCE

from ..clock import REAL_CLOCK, Clock
from ..connect.known_lines import remembered_text
from ..connect.line_key import line_key
from .files import records_in, start_records
from .processes import Processes
from .record import OVERTAKEN, StartNotRecorded, StartOvertaken, StartRecord

if TYPE_CHECKING:
    from ..connect.identify import DriveIdentity
from dataclasses import dataclass, field

from tui.bus.program import ProcessKey

log = logging.getLogger(__name__)


class Starts:
    """Records of motor starts; one object per program, for any thread.

    A thread does the disk work in order, and ends when there is none. At most one removal per
    drive waits, so a disk that hangs accumulates no work.
    """

    def __init__(
        self,
        folder: Path | None = None,
        processes: Processes | None = None,
        clock: Clock = REAL_CLOCK,
    ) -> None:
        self._clock = clock
        self._files = start_records(folder)
        self.processes = processes or Processes()
        self._changed = threading.Condition()
        """Guards the fields below; never held during disk work."""
        self._waiting: deque[StartTask] = deque()
        self._current: StartTask | None = None
        self._thread: threading.Thread | None = None
        self._sent: dict[DriveKey, float] = {}
        """By drive, the time after which a standstill ends the start (monotonic); infinite until
        the run frame was sent."""

    @property
    def folder(self) -> Path:
        """Folder of the records."""
        return self._files.folder

    def record(
        self,
        line: str,
        identity: DriveIdentity,
        profile: str,
        order: Literal["forward", "reverse"],
        *,
        program: str,
        left_running: bool = False,
        guessed: bool = False,
        acts_after: float | None = None,
    ) -> StartRecord:
        """Make the record of a start by this program now; begin() writes it to the disk."""
        return StartRecord(
            line=line,
            device=identity.device,
            profile=profile,
            vendor=identity.vendor,
            reference=identity.reference,
            version=identity.version,
            name=identity.name,
            order=order,
            boot_id=self.processes.boot_id(),
            pid=os.getpid(),
            started=self.processes.started(os.getpid()) or "",
            program=program,
            left_running=left_running,
            wall=datetime.now().astimezone().isoformat(timespec="milliseconds"),
            guessed=guessed,
            acts_after=acts_after,
            space=pid_namespace(),
        )

    def taken_over(
        self, found: StartRecord, line: str, *, program: str, left_running: bool = False
    ) -> StartRecord:
        """Make the record of a motor that this program takes over; begin() writes it."""
        boot_id, pid = self.processes.boot_id(), os.getpid()
        started = self.processes.started(pid) or ""
        return replace(
            found, line=line, boot_id=boot_id, pid=pid, started=started, program=program,
            space=pid_namespace(),
            left_running=left_running,
        )  # fmt: skip

    def begin(self, record: StartRecord, patience: float = START_PATIENCE) -> None:
        """Write a start to the disk, flushed, before its run frame is sent.

        Waits at most `patience` seconds for the disk. Raises StartNotRecorded if the run must be
        refused, StartOvertaken if a stop came in that time.
        """
        task = StartTask((record.line, record.device), record)
        with self._changed:
            before = self._sent.get(task.drive, -math.inf)
            self._sent[task.drive] = math.inf
            self._add(task)
        in_time = task.done.wait(patience)
        with self._changed:
            if not in_time and not task.done.is_set():
                task.void, task.trouble = True, f"the disk did not answer within {patience:g} s"
                if task in self._waiting:
                    self._waiting.remove(task)
            if not task.trouble:
                return
            if task.trouble != OVERTAKEN:
                self._sent[task.drive] = before
        if task.trouble == OVERTAKEN:
            raise StartOvertaken(record.device, self.folder)
        raise StartNotRecorded(record.device, self.folder, task.trouble)

    def sent(self, line: str, device: int) -> None:
        """Let a standstill that is seen from now on end the start: its run frame was sent."""
        with self._changed:
            if (line, device) in self._sent:
                self._sent[line, device] = self._clock.monotonic()

    def end(self, line: str, device: int, seen: float | None = None) -> None:
        """Remove the record of a motor that is at standstill. Never waits or raises.

        `seen` is the time of the standstill (monotonic; default: now). A standstill before the
        run frame was sent is the one before the start, and changes nothing.
        """
        with self._changed:
            if (self._clock.monotonic() if seen is None else seen) > self._sent.get(
                (line, device), -math.inf
            ):
                self._take_away((line, device))

    def note_stop(self, line: str, device: int) -> None:
        """Remove a record after a stop, or if the start was never sent. Never waits or raises.

        A start that is being recorded at this moment is refused.
        """
        drive = (line, device)
        with self._changed:
            mine = [self._current] if self._current else []
            for task in [*mine, *self._waiting]:
                if task.drive == drive and task.record is not None and not task.done.is_set():
                    task.void, task.trouble = True, OVERTAKEN
                    task.done.set()
            self._take_away(drive)

    def found(
        self, line: str, device: int, absent: Collection[ProcessKey] = ()
    ) -> StartRecord | None:
        """Return the last start of a drive if its program has ended. Reads files.

        None if a living program, or this one, has a record of the drive.
        """
        return next(
            (record for record in self.all_found(line, absent) if record.device == device), None
        )

    def all_found(self, line: str, absent: Collection[ProcessKey] = ()) -> list[StartRecord]:
        """Return the starts on a line by programs that have ended, by device. Reads files.

        `absent` are processes that count as ended: they have left the line, or are frozen.
        """
        key = line_key(line)
        going = self._going(key)
        here = self._of(line)
        here = [record for record in here if record.device not in going]
        living = [
            record for record in here if record.process not in absent and self.is_alive(record)
        ]
        alive = {record.device for record in living if not record.is_foreign}
        newest = {record.device: record for record in here if record.device not in alive}
        # in another container a program may have ended unnoticed, so a later start counts
        return [newest[device] for device in sorted(newest) if newest[device] not in living]

    def is_on_record(self, line: str, device: int, process: ProcessKey) -> bool:
        """Return True if a process has recorded a start of a drive. Reads files."""
        return any(
            record.device == device and record.process == process for record in self._of(line)
        )

    def own(self, line: str, device: int) -> StartRecord | None:
        """Return the start of a drive that this program has recorded. Reads files."""
        if device in self._going(line_key(line)):
            return None
        here = (record for record in self._of(line) if record.device == device)
        return next((record for record in here if self._own(record)), None)

    def _going(self, key: str) -> set[int]:
        """Return the drives of a line whose records are being removed."""
        with self._changed:
            tasks = [*self._waiting, *([self._current] if self._current else [])]
        return {
            task.drive[1]
            for task in tasks
            if task.record is None and line_key(task.drive[0]) == key
        }

    def _of(self, line: str, removed: Iterable[StartRecord] = ()) -> list[StartRecord]:
        """Return the starts of a line, the newest last."""
        key = line_key(line)
        every = [*removed, *self._files.records()]
        here = [record for record in every if line_key(record.line) == key]
        return sorted(here, key=lambda item: item.begun.timestamp() if item.begun else 0.0)

    def newest(self, line: str, texts: Iterable[str] = ()) -> dict[int, StartRecord]:
        """Return the last start by device, even if its program has ended. Reads files.

        `texts` are records that may have been removed since they were read.
        """
        return {record.device: record for record in self._of(line, records_in(texts))}

    def close(self, timeout: float = 1.0) -> bool:
        """Wait at most so many seconds for the disk work; return False if it is not done."""
        with self._changed:
            return self._changed.wait_for(
                lambda: not self._waiting and self._current is None, timeout
            )

    def _take_away(self, drive: DriveKey) -> None:
        self._sent.pop(drive, None)
        for task in [task for task in self._waiting if task.drive == drive]:
            if task.record is None:
                self._waiting.remove(task)  # the new one does its work
        self._add(StartTask(drive, None))

    def _add(self, task: StartTask) -> None:
        self._waiting.append(task)
        if self._thread is not None:
            return
        try:
            thread = threading.Thread(target=self._work, name="starts", daemon=True)
            thread.start()
            self._thread = thread
        except RuntimeError as error:
            # the system has no thread: a start is refused, and the next call tries again
            log.error("starts cannot be recorded: %s", error)
            if task.record is not None:
                self._waiting.remove(task)
                task.trouble = str(error)
                task.done.set()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._current = self._waiting.popleft() if self._waiting else None
                if self._current is None:
                    self._thread = None
                    self._changed.notify_all()
                    return
                task = self._current
            trouble = self._trouble_with(task)
            with self._changed:
                task.trouble = task.trouble or trouble
                task.done.set()

    def _trouble_with(self, task: StartTask) -> str:
        """Do a task; return its error as text, or an empty string."""
        try:
            if task.record is None:
                self._remove(*task.drive)
            elif not task.void:
                # by the adapter's name, because its port may get another number
                record = replace(task.record, line=remembered_text(task.record.line))
                self._files.write_record(record, lambda: not task.void)
        except OSError as error:
            return error.strerror or str(error)
        except Exception as error:
            log.exception("the starts of drive %s", task.drive)
            return str(error)
        return ""

    def _remove(self, line: str, device: int) -> None:
        """Remove a drive's records, except those of other living programs.

        Such a program sees the standstill itself. This one may have seen the one before its start.
        """
        key = line_key(line)
        self._files.remove(
            lambda record: (
                record.device == device
                and line_key(record.line) == key
                and (self._own(record) or not self.is_alive(record))
            )
        )

    def _own(self, record: StartRecord) -> bool:
        return record.process == (pid_namespace(), os.getpid()) and self.is_alive(record)

    def is_alive(self, record: StartRecord) -> bool:
        """Return True if the program of a start may live; one in another container may."""
        if record.is_foreign:
            return self.processes.is_same_boot(record.boot_id)
        return self.processes.lives(record.boot_id, record.pid, record.started)


DriveKey = tuple[str, int]
"""A line's text and a device; within a program, a line has one text."""


@dataclass(eq=False, slots=True)
class StartTask:
    """Disk work: a record to write, or None to remove those of a drive."""

    drive: DriveKey
    record: StartRecord | None
    done: threading.Event = field(default_factory=threading.Event)
    trouble: str = ""
    void: bool = False
    """True if it is canceled by a stop or a timeout; then its file does not become valid."""
