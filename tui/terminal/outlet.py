"""Writing to a terminal that may go away."""

from __future__ import annotations

import logging
import os
import signal
from typing import IO

log = logging.getLogger(__name__)


class Outlet:
    """The file of a terminal, which takes everything once the terminal is gone.

    Textual writes to it in a thread. An error there would end the thread, and the panel would
    then wait for it without end: no motor would be stopped.
    """

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._gone = False

    def write(self, text: str) -> None:
        """Write text; give the panel SIGHUP if the terminal is gone."""
        if not self._gone:
            try:
                self._file.write(text)
            except OSError as error:
                self._lose(error)

    def flush(self) -> None:
        """Hand over what was written."""
        if not self._gone:
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
        log.error("the terminal takes nothing any more: %s", error)
        self._gone = True
        os.kill(os.getpid(), signal.SIGHUP)
