"""Lines of standard input, read beside what the program does."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

BYTES_AT_ONCE = 4096
BACKGROUND_PAUSE = 1.0
"""Seconds between two tries while the terminal belongs to another program."""


def typed_lines(handle: int = 0) -> Iterator[str]:
    """Lines without their ends, until the input ends; for a thread of its own.

    Reads the handle itself: a buffered stream that waits would hold up the end of the program. In
    the background of a shell it waits until the program is in the foreground.
    """
    rest = b""
    while (data := _read(handle)) != b"":
        *lines, rest = (rest + data).split(b"\n")
        for line in lines:
            yield line.decode("utf-8", "replace").rstrip("\r")
    if rest:
        yield rest.decode("utf-8", "replace")


def _read(handle: int) -> bytes:
    while True:
        try:
            return os.read(handle, BYTES_AT_ONCE)
        except OSError:
            if not os.isatty(handle):
                return b""
            time.sleep(BACKGROUND_PAUSE)
