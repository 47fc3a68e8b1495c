"""End of the panel by a signal, also if stopping its motors raises an error."""

from __future__ import annotations

import os
import signal
import threading

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
