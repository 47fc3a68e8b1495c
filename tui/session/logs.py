"""The log file in the state folder."""

from __future__ import annotations

import atexit
import logging
import os
import signal
from contextlib import suppress
from io import TextIOWrapper
from logging.handlers import QueueHandler, RotatingFileHandler
from pathlib import Path
from queue import Full, Queue
from threading import Thread

from tui.drive.plain import plain

from .paths import state_folder
from .stored import make_folder

PANEL = "tui"
"""The logger above all others of the panel: each module logs to one by its own name."""
LEVELS = (logging.INFO, logging.DEBUG)
LOG_BACKLOG = 10_000
"""Entries that wait for a disk which takes none; later ones are lost."""
LOG_PATIENCE = 2.0
"""Seconds that who closes the log waits for the disk."""


class Later(QueueHandler):
    """Hands entries to a thread: a disk that hangs holds up no stop."""

    def __init__(self, to: logging.Handler) -> None:
        self._entries: Queue[logging.LogRecord | None] = Queue(LOG_BACKLOG)
        super().__init__(self._entries)
        self._to = to
        self._thread = Thread(target=self._work, name="log", daemon=True)
        self._thread.start()
        atexit.register(self.close)

    def enqueue(self, record: logging.LogRecord) -> None:
        """Give an entry to the thread; with too many waiting it is lost."""
        with suppress(Full):
            self._entries.put_nowait(record)

    def handleError(self, record: logging.LogRecord) -> None:
        """Lose the entry: logging's own way is a traceback on standard error."""

    def close(self) -> None:
        """Wait a moment for what is not on the disk yet."""
        atexit.unregister(self.close)
        with suppress(Full):
            self._entries.put_nowait(None)
        self._thread.join(LOG_PATIENCE)
        super().close()

    def _work(self) -> None:
        if hasattr(signal, "pthread_sigmask"):
            # it may start before the threads that wait for signals
            signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        while (entry := self._entries.get()) is not None:
            self._to.handle(entry)
        self._to.close()


class LogFile(RotatingFileHandler):
    """The file, for its owner alone; a disk that takes nothing is not an error of the command."""

    def createLock(self) -> None:
        """Have none: one thread writes, and the end of the program must not wait for it."""
        self.lock = None

    def _open(self) -> TextIOWrapper:
        def opener(path: str, flags: int) -> int:
            return os.open(path, flags, 0o600)

        return open(self.baseFilename, self.mode, encoding=self.encoding, opener=opener)  # type: ignore[return-value]

    def handleError(self, record: logging.LogRecord) -> None:
        """Lose the entry: logging's own way is a traceback on standard error."""

    def close(self) -> None:
        """Close the file, whatever of it the disk does not take."""
        with suppress(OSError, ValueError):
            super().close()


class PlainFormatter(logging.Formatter):
    """Lines that command no terminal on which somebody reads the log."""

    def format(self, record: logging.LogRecord) -> str:
        """The entry as text."""
        return plain(super().format(record), lines=True)


def log_file() -> Path:
    """The path of the log."""
    return state_folder() / "drivepanel.log"


def start_logging(verbose: int) -> None:
    """Log to the file; with more `-v` in more detail. Without a writable folder, not at all."""
    logger = logging.getLogger(PANEL)
    logger.setLevel(LEVELS[min(verbose, len(LEVELS) - 1)])
    try:
        make_folder(log_file().parent)
        file = LogFile(log_file(), maxBytes=1_000_000, backupCount=3, encoding="utf-8", delay=True)
    except OSError:
        handler: logging.Handler = logging.NullHandler()
    else:
        file.setFormatter(PlainFormatter("%(asctime)s %(levelname)s %(message)s"))
        handler = Later(file)
    stop_logging()
    logger.addHandler(handler)
    logger.propagate = False


def stop_logging() -> None:
    """Close the log."""
    logger = logging.getLogger(PANEL)
    for handler in list(logger.handlers):
        logger.removeHandler(handler)
        handler.close()
    logger.propagate = True
