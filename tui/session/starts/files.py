"""Files of start records: written completely or not at all, and renamed if damaged.

They are in the user's state folder, and in the folder of a group of users. The user's files survive
a restart of the computer. The files of the group show a keeper of another user which motors to stop
after their program has ended.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path

import msgspec

from tui.drive.small_file import read_small, sync_folder

from ..connect.share_place import group_folder
from ..paths import state_folder
from ..stored import make_folder
from .record import StartRecord

log = logging.getLogger(__name__)

ENDING = ".json"
LONGEST_RECORD = 100_000
"""Bytes of a file that may be a record."""
SHARED_RECORD, SHARED_RECORDS = 0o660, 0o770
"""Modes of a file and a folder that users of a group share; the group is that of the parent
folder."""


class StartFiles:
    """One file for each start; two programs never share a file.

    So no program overwrites or removes the record of another.
    """

    def __init__(self, folder: Path, *, shared: bool = False) -> None:
        self.folder = folder
        self._shared = shared
        """True if the group of the parent folder may read, write and remove the files."""

    def write_record(self, record: StartRecord, wanted: Callable[[], bool]) -> None:
        """Write a record and flush it, unless it is no longer `wanted` at the last moment.

        Raises OSError; an older record of the same start then remains unchanged.
        """
        self._make_folder()
        path = self.folder / _name(record)
        part = path.with_suffix(".part")
        try:
            with part.open("wb") as file:
                file.write(msgspec.json.format(msgspec.json.encode(record), indent=1))
                file.flush()
                os.fsync(file.fileno())
                if self._shared:
                    os.fchmod(file.fileno(), SHARED_RECORD)
            if not wanted():
                return
            part.replace(path)
            sync_folder(self.folder)
        finally:
            with suppress(OSError):
                part.unlink(missing_ok=True)

    def remove(self, unwanted: Callable[[StartRecord], bool]) -> None:
        """Remove records, flushed; errors are logged."""
        removed = False
        for path, record in self._stored():
            if not unwanted(record):
                continue
            try:
                path.unlink(missing_ok=True)
                removed = True
            except OSError as error:
                log.error("the start record %s cannot be removed: %s", path, error)
        if removed:
            with suppress(OSError):
                sync_folder(self.folder)

    def records(self) -> list[StartRecord]:
        """Return all records; damaged files are renamed and logged."""
        return [record for _, record in self._stored()]

    def _stored(self) -> Iterator[tuple[Path, StartRecord]]:
        try:
            paths = [path for path in self.folder.iterdir() if path.suffix == ENDING]
        except FileNotFoundError:
            return
        except OSError as error:
            log.error("the start records in %s cannot be read: %s", self.folder, error)
            return
        for path in sorted(paths):
            if (record := _read(path)) is not None:
                yield path, record

    def _make_folder(self) -> None:
        if not self.folder.is_dir():
            if self._shared:
                _make_shared(self.folder)
            else:
                make_folder(self.folder)
            sync_folder(self.folder.parent)


def _make_shared(folder: Path) -> None:
    """Create a folder with the group and mode bits of its parent."""
    folder.mkdir(mode=SHARED_RECORDS, exist_ok=True)
    mode = stat.S_IMODE(folder.stat().st_mode)
    if mode & SHARED_RECORDS != SHARED_RECORDS:
        # the umask removed bits; a hardened service may not set the group bit
        folder.chmod(mode | SHARED_RECORDS)


def _name(record: StartRecord) -> str:
    """Return a file name that is unique for each program's start of a drive, and readable."""
    origin = (record.line, record.device, record.boot_id, *record.process, record.started)
    digest = hashlib.sha256(repr(origin).encode()).hexdigest()[:12]
    readable = re.sub(r"[^A-Za-z0-9]+", "-", record.line).strip("-")[:40]
    return f"{readable}-{record.device}-{digest}{ENDING}"


def _read(path: Path) -> StartRecord | None:
    try:
        return msgspec.json.decode(read_small(path, LONGEST_RECORD), type=StartRecord)
    except FileNotFoundError:
        return None  # its program has just removed it
    except OSError as error:
        log.error("the start record %s cannot be read: %s", path, error)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        log.error("the start record %s is damaged and was renamed: %s", path, error)
        with suppress(OSError):
            path.replace(path.with_suffix(".damaged"))
    return None


def records_in(texts: Iterable[str]) -> list[StartRecord]:
    """Return the records in the texts of files; those that are damaged are left out."""
    found = []
    for text in texts:
        with suppress(msgspec.MsgspecError):
            found.append(msgspec.json.decode(text, type=StartRecord))
    return found


def start_records(folder: Path | None) -> StartFiles | StartFolders:
    """Return the records of one folder, or those of this user and the group."""
    if folder is not None:
        return StartFiles(folder / "starts")
    return StartFolders(state_folder() / "starts")


class StartFolders:
    """The records of this user and of the group, as one store."""

    def __init__(self, folder: Path) -> None:
        self._own = StartFiles(folder)

    @property
    def folder(self) -> Path:
        """Folder of this user's own records."""
        return self._own.folder

    def write_record(self, record: StartRecord, wanted: Callable[[], bool]) -> None:
        """Write a record and flush it, then write it for the group.

        Raises OSError if the first fails; an error of the second is logged.
        """
        self._own.write_record(record, wanted)
        for shared in self._shared():
            try:
                shared.write_record(record, wanted)
            except OSError as error:
                log.error(
                    "the group has no record of the start of drive %s: %s", record.device, error
                )

    def remove(self, unwanted: Callable[[StartRecord], bool]) -> None:
        """Remove records; errors are logged."""
        for files in (self._own, *self._shared()):
            files.remove(unwanted)

    def records(self) -> list[StartRecord]:
        """Return all records, each once."""
        every = [record for files in (self._own, *self._shared()) for record in files.records()]
        return list(dict.fromkeys(every))

    @staticmethod
    def _shared() -> tuple[StartFiles, ...]:
        """Return the folder of the group, searched each time: a service creates it when it
        starts."""
        folder = group_folder()
        if os.name != "posix" or not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            return ()
        return (StartFiles(folder / "starts", shared=True),)
