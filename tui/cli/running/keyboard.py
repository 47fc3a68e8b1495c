"""The person at the keyboard during a test that moves a motor."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from tui.session.running.ending import Ending

from ..shared.asking import may_ask


def person_is_here() -> bool:
    """Return True if this program has a terminal, in its foreground, so that a key reaches it."""
    if not may_ask():
        return False
    if os.name != "posix":
        return True
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except OSError:
        return False


@contextmanager
def ended_by_typing(ending: Ending) -> Iterator[None]:
    """While inside, a typed line, or a terminal that is closed, ends the test.

    A terminal passes on what is typed at Enter. On Windows only Ctrl-C ends it.
    """
    if os.name != "posix":
        yield
        return
    loop, handle = asyncio.get_running_loop(), sys.stdin.fileno()

    def typed() -> None:
        data = b""
        with suppress(OSError):
            data = os.read(handle, 1024)
        ending.end("ended at the keyboard" if data else "its terminal was closed")
        loop.remove_reader(handle)

    loop.add_reader(handle, typed)
    try:
        yield
    finally:
        loop.remove_reader(handle)
