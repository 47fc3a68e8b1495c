"""End of the panel by a signal, also if stopping its motors raises an error."""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType
from typing import Any

import pytest

from tui.cli.shared import signals
from tui.cli.shared.signals import ending_by_signal
from tui.session.signals import BY_SIGNAL


class BrokenPanel:
    """A panel whose first steps of its end raise errors."""

    failed = False

    def __init__(self) -> None:
        self.attempts = 0
        self.left = threading.Event()

    def stop_motors(self) -> bool:
        raise RuntimeError("the line is closed")

    def leave_now(self) -> None:
        self.attempts += 1
        if self.attempts == 1:
            raise RuntimeError("the loop has ended")
        self.left.set()


@pytest.mark.internal_errors
def test_error_in_the_stops_does_not_keep_a_panel_alive_without_its_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    exits: list[int] = []
    exited = threading.Event()

    def leave(status: int) -> None:
        exits.append(status)
        exited.set()

    monkeypatch.setattr(signals, "CLEANED_UP", 0.5)
    monkeypatch.setattr(os, "_exit", leave)
    panel = BrokenPanel()
    with ending_by_signal(panel, stop=True) as came:
        signal.raise_signal(signal.SIGHUP)
        assert panel.left.wait(10.0)
        assert exited.wait(10.0), "the last resort ends a panel whose screen does not"
    assert came == [signal.SIGHUP]
    assert exits == [BY_SIGNAL + signal.SIGHUP]


class QuickPanel:
    """A panel that ends at once, and counts how often."""

    failed = False

    def __init__(self) -> None:
        self.stops = 0
        self.left = threading.Event()

    def stop_motors(self) -> bool:
        self.stops += 1
        return True

    def leave_now(self) -> None:
        self.left.set()


@pytest.mark.parametrize("step", range(1, 6))
def test_panel_ends_if_a_second_signal_comes_within_the_handler_of_the_first(
    step: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The end of a terminal may arrive twice at once; a panel then lived on without it."""
    monkeypatch.setattr(signals, "CLEANED_UP", 1e5)  # its last resort would end the tests
    panel, left = QuickPanel(), step

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal left
        if (
            frame.f_code.co_name not in ("handle", "note")
            or "signals" not in frame.f_code.co_filename
        ):
            return None
        if event == "line":
            left -= 1
            if left == 0:
                sys.settrace(None)
                handle(signal.SIGHUP, None)
        return trace

    before = sys.gettrace()
    with ending_by_signal(panel, stop=True) as came:
        handle: Any = signal.getsignal(signal.SIGHUP)
        try:
            sys.settrace(trace)
            handle(signal.SIGHUP, None)
        finally:
            sys.settrace(before)
        assert panel.left.wait(10.0)
    assert came == [signal.SIGHUP] * 2
    assert panel.stops == 1
