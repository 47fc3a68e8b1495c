"""Starts of motors on record, so that the next program knows what this one left running.

begin() before the run frame, sent() once it went out, end() at standstill, note_stop() at a stop.
Only begin() and the found ones wait for the disk.
"""

from __future__ import annotations

import logging
import math
import os
import threading
from collections import deque
from collections.abc import Collection
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tui.bus.program import pid_namespace
from tui.safety import START_PATIENCE

from ..clock import REAL_CLOCK, Clock
from ..connect.known_lines import remembered_text
from ..connect.line_key import line_key
from .files import start_records
from .processes import Processes
from .record import OVERTAKEN, StartNotRecorded, StartOvertaken, StartRecord

if TYPE_CHECKING:
    from tui.bus.program import ProcessKey

    from ..connect.identify import DriveIdentity
from dataclasses import dataclass, field

log = logging.getLogger(__name__)


class Starts:
    """The starts on record; one object for each program, used from any thread.

    The disk work is done in order in a thread that lives while there is some. At most one removal
    waits for each drive, so a disk that hangs piles nothing up.
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
        """Guards all below; never held over disk work."""
        self._waiting: deque[StartTask] = deque()
        self._current: StartTask | None = None
        self._thread: threading.Thread | None = None
        self._sent: dict[DriveKey, float] = {}
        """Since when a standstill says that the motor stopped; never while a start is under way."""

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
        """A start by this program, now; begin() puts it on the disk."""
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
        """The start of a program that ended, as this program's; begin() puts it on the disk."""
        boot_id, pid = self.processes.boot_id(), os.getpid()
        started = self.processes.started(pid) or ""
        return replace(
            found, line=line, boot_id=boot_id, pid=pid, started=started, program=program,
            space=pid_namespace(),
            left_running=left_running,
        )  # fmt: skip

    def begin(self, record: StartRecord, patience: float = START_PATIENCE) -> None:
        """Put a start on the disk, flushed, before its run frame goes out.

        Waits for the disk, at most `patience` seconds. Raises StartNotRecorded where the run is
        to be refused, StartOvertaken where a stop came meanwhile.
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
        """The run frame went out, answered or not: a standstill seen from now on counts."""
        with self._changed:
            if (line, device) in self._sent:
                self._sent[line, device] = self._clock.monotonic()

    def end(self, line: str, device: int, seen: float | None = None) -> None:
        """The motor is at standstill: remove its record. Returns at once and never raises.

        `seen` is the monotonic time at which standstill was read, now unless given. One that was
        read before the run frame went out is the rest before the start, and changes nothing.
        """
        with self._changed:
            if (self._clock.monotonic() if seen is None else seen) > self._sent.get(
                (line, device), -math.inf
            ):
                self._take_away((line, device))

    def note_stop(self, line: str, device: int) -> None:
        """A stop went out, or a start never did: its record goes. At once, and never raises.

        A start that is just being recorded is refused.
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
        """The last start of a drive if its program ended, however the line was typed.

        None where a living program, this one too, has a start of this drive on record.
        """
        return next(
            (record for record in self.all_found(line, absent) if record.device == device), None
        )

    def all_found(self, line: str, absent: Collection[ProcessKey] = ()) -> list[StartRecord]:
        """The drives of a line that programs which ended have started, by device. Reads files.

        `absent` are processes of programs that count as ended: they left the line, or are frozen.
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
        # of another container it is not known whether its program lives: a later start counts
        return [newest[device] for device in sorted(newest) if newest[device] not in living]

    def is_on_record(self, line: str, device: int, process: ProcessKey) -> bool:
        """Return True if a program has a start of a drive on record. Reads files."""
        return any(
            record.device == device and record.process == process for record in self._of(line)
        )

    def own(self, line: str, device: int) -> StartRecord | None:
        """The start of a drive that this very program has on record. Reads files."""
        if device in self._going(line_key(line)):
            return None
        here = (record for record in self._of(line) if record.device == device)
        return next((record for record in here if self._own(record)), None)

    def _going(self, key: str) -> set[int]:
        """The drives of a line whose records are being taken away."""
        with self._changed:
            tasks = [*self._waiting, *([self._current] if self._current else [])]
        return {
            task.drive[1]
            for task in tasks
            if task.record is None and line_key(task.drive[0]) == key
        }

    def _of(self, line: str) -> list[StartRecord]:
        """The starts of a line, the newest last."""
        key = line_key(line)
        here = [record for record in self._files.records() if line_key(record.line) == key]
        return sorted(here, key=lambda item: item.begun.timestamp() if item.begun else 0.0)

    def newest(self, line: str) -> dict[int, StartRecord]:
        """By device, the last start on record, whose program lives or not; reads files."""
        return {record.device: record for record in self._of(line)}

    def close(self, timeout: float = 1.0) -> bool:
        """Wait for what is still to be written or removed, so many seconds; False if it was not."""
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
            # no thread to be had: the next call tries again, a start is refused
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
        """Do a task; what went wrong, or nothing."""
        try:
            if task.record is None:
                self._remove(*task.drive)
            elif not task.void:
                # by its adapter's name: whoever looks for it may find that under another number
                record = replace(task.record, line=remembered_text(task.record.line))
                self._files.write_record(record, lambda: not task.void)
        except OSError as error:
            return error.strerror or str(error)
        except Exception as error:
            log.exception("the starts of drive %s", task.drive)
            return str(error)
        return ""

    def _remove(self, line: str, device: int) -> None:
        """Remove a drive's records, but for those of other programs that live.

        Such a program sees the standstill itself; here it may be the rest before its run frame.
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
        """Return True if the program of a start lives; in doubt it does, as in another
        container."""
        if record.is_foreign:
            return self.processes.is_same_boot(record.boot_id)
        return self.processes.lives(record.boot_id, record.pid, record.started)


DriveKey = tuple[str, int]
"""A line's text and a device: one program calls one line by one text."""


@dataclass(eq=False, slots=True)
class StartTask:
    """Work for the disk: a record to write, or with None those of a drive to remove."""

    drive: DriveKey
    record: StartRecord | None
    done: threading.Event = field(default_factory=threading.Event)
    trouble: str = ""
    void: bool = False
    """Nobody waits for it any more, or a stop came first: it is not to be put in its place."""
