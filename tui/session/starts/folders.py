"""Places of start records: the user's own state folder, and the folder for users of a group.

The own one outlives the machine. By that of the group another user's program, which owns the line,
knows whose motor it is to stop when the program that started it is gone.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from pathlib import Path

from ..connect.share_place import group_folder
from ..paths import state_folder
from .files import StartFiles
from .record import StartRecord

log = logging.getLogger(__name__)


def start_records(folder: Path | None) -> StartFiles | StartFolders:
    """The records below a folder alone, or those of this user with those of the group."""
    if folder is not None:
        return StartFiles(folder / "starts")
    return StartFolders(state_folder() / "starts")


class StartFolders:
    """The records of this user with those of the group, as one store."""

    def __init__(self, folder: Path) -> None:
        self._own = StartFiles(folder)

    @property
    def folder(self) -> Path:
        """Folder of this user's own records."""
        return self._own.folder

    def write_record(self, record: StartRecord, wanted: Callable[[], bool]) -> None:
        """Put a record on the disk, flushed, then where the group sees it.

        Raises OSError where the first fails; what the group is not told is logged.
        """
        self._own.write_record(record, wanted)
        for shared in self._shared():
            try:
                shared.write_record(record, wanted)
            except OSError as error:
                log.error("the start of drive %s is not told the group: %s", record.device, error)

    def remove(self, unwanted: Callable[[StartRecord], bool]) -> None:
        """Take away records; what cannot be removed is logged."""
        for files in (self._own, *self._shared()):
            files.remove(unwanted)

    def records(self) -> list[StartRecord]:
        """All records, each once."""
        every = [record for files in (self._own, *self._shared()) for record in files.records()]
        return list(dict.fromkeys(every))

    @staticmethod
    def _shared() -> tuple[StartFiles, ...]:
        """That of the group, found again: a service makes its folder when it starts."""
        folder = group_folder()
        if os.name != "posix" or not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            return ()
        return (StartFiles(folder / "starts", shared=True),)
