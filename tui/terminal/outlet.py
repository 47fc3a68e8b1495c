"""Writing to a terminal that may disappear."""

from __future__ import annotations

import logging
import os
import signal
from typing import IO

log = logging.getLogger(__name__)


class Outlet:
    """The file of a terminal that discards all output after the terminal has disappeared.

    Textual writes to it in a thread. An error there would end the thread, and the panel would then
    wait for it forever: no motor would be stopped.
    """

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._lost = False

    def write(self, text: str) -> None:
        """Write text; send the panel SIGHUP if the terminal has disappeared."""
        if not self._lost:
            try:
                self._file.write(text)
            except OSError as error:
                self._lose(error)

    def flush(self) -> None:
        """Flush what was written."""
        if not self._lost:
            try:
                self._file.flush()
            except OSError as error:
                self._lose(error)

    def fileno(self) -> int:
        """The file's descriptor."""
        return self._file.fileno()

    def isatty(self) -> bool:
        """True if it is a terminal."""
        return self._file.isatty()

    def _lose(self, error: OSError) -> None:
        log.error("the terminal no longer accepts output: %s", error)
        self._lost = True
        os.kill(os.getpid(), signal.SIGHUP)
