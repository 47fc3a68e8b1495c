"""Lines for standard output that hold up nothing while nobody reads them."""

from __future__ import annotations

import os
import queue
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from ..shared.say import printable

HEARD_POLL_INTERVAL = 0.05
LINES_WAITING = 64
"""Lines kept for a reader that is slower than they come; older ones are dropped."""
HEARD_OUT = 2.0
"""Seconds that the reader has for the last lines."""


class BufferedOutput:
    """Lines for standard output, in a thread: a reader that takes none must not hold up a stop."""

    def __init__(self, gone: Callable[[], None]) -> None:
        self._gone = gone
        self._lines: queue.Queue[bytes] = queue.Queue(LINES_WAITING)
        self._out = sys.stdout.fileno()
        self._encoding = sys.stdout.encoding or "utf-8"
        threading.Thread(target=self._work, name="output", daemon=True).start()

    def say(self, text: str) -> None:
        """Put a line out as soon as the reader takes it."""
        line = f"{printable(text, self._encoding)}{os.linesep}".encode(self._encoding)
        while True:
            try:
                return self._lines.put_nowait(line)
            except queue.Full:
                with suppress(queue.Empty):
                    self._lines.get_nowait()
                    self._lines.task_done()

    def finish(self) -> None:
        """Give the reader time for the last lines."""
        end = time.monotonic() + HEARD_OUT
        while self._lines.unfinished_tasks and time.monotonic() < end:
            time.sleep(HEARD_POLL_INTERVAL)

    def _work(self) -> None:
        broken = False
        while True:
            line = self._lines.get()
            try:
                # past Python's own buffer: its lock would hold up the end of the process
                while line and not broken:
                    line = line[os.write(self._out, line) :]
            except OSError:
                broken = True
                self._gone()
            finally:
                self._lines.task_done()
