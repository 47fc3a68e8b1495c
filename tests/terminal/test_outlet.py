"""A terminal that disappears while the panel writes to it."""

from __future__ import annotations

import os
import signal
from queue import Queue
from typing import IO, cast

import pytest
from textual.drivers._writer_thread import WriterThread

from tui.terminal.driver import Outlet


class LostTerminal:
    """Accepts nothing: its other end is closed."""

    def write(self, text: str) -> int:
        return len(text)

    def flush(self) -> None:
        raise OSError(5, "Input/output error")


def test_lost_terminal_ends_no_thread_and_is_a_hangup(monkeypatch: pytest.MonkeyPatch) -> None:
    signals: Queue[int] = Queue()
    monkeypatch.setattr(os, "kill", lambda _, number: signals.put(number))
    writer = WriterThread(cast("IO[str]", Outlet(cast("IO[str]", LostTerminal()))))
    writer.start()
    for _ in range(200):
        writer.write("x")  # more than Textual's queue holds
    writer.stop()
    assert signals.get(timeout=20) is signal.SIGHUP
    assert signals.empty()
