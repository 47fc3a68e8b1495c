"""Standard output and error that never end what a command does: closed ones, and full disks.

An error in the last output of a stop must not make the stop look failed. Lost output is recorded,
and reported at the end of the command.
"""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from typing import Any, TextIO

STANDARD = Path("-")
"""In place of a file: standard input, or standard output."""


class ForgivingFile(io.FileIO):
    """A stream's file that takes what the disk does not, and keeps why.

    With `pipes` a reader that has exited still raises BrokenPipeError.
    """

    def __init__(self, number: int, *, pipes: bool) -> None:
        super().__init__(number, "w", closefd=False)
        self._pipes = pipes
        self.lost: OSError | None = None

    def write(self, data: Any, /) -> int:
        """Write, or keep what went wrong."""
        try:
            return super().write(data)
        except BlockingIOError:
            raise
        except OSError as error:
            if self._pipes and isinstance(error, BrokenPipeError):
                raise
            self.lost = self.lost or error
            return len(memoryview(data).cast("B"))


def keep_streams() -> None:
    """Make standard output and error forgiving; streams that are closed lead nowhere."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # else a port or a file that is opened later would be taken for it
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = _forgiving(sys.stdout, 1, pipes=True)
    sys.stderr = _forgiving(sys.stderr, 2, pipes=False)


def _forgiving(stream: TextIO | None, number: int, *, pipes: bool) -> TextIO:
    file = ForgivingFile(number, pipes=pipes)
    return io.TextIOWrapper(
        io.BufferedWriter(file),
        encoding=stream.encoding if stream is not None else "utf-8",
        errors=stream.errors if stream is not None else "replace",
        line_buffering=number == 2 or file.isatty(),
    )


def output_lost() -> str:
    """Why standard output cannot be written; empty while it can."""
    file = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    lost = file.lost if isinstance(file, ForgivingFile) else None
    return "" if lost is None else lost.strerror or str(lost)


NO_RECORD_FROM_INPUT = (
    "A record is a database, which is read at any place: it needs a FILE, not standard input."
)


def given_file(path: Path) -> Path:
    """Return the path of a file to read; with `-`, standard input is read now."""
    from tui.drive.small_file import LONGEST_TEXT, supplied

    if path == STANDARD and path not in supplied:
        supplied[path] = sys.stdin.buffer.read(LONGEST_TEXT + 1)
    return path
