"""The first start on a terminal offers to test F12, and shows the received keys."""

from __future__ import annotations

import sys
from collections.abc import Callable

from .terminal import Terminal

Start = Callable[[list[str]], Terminal]
PANEL = [sys.executable, "-m", "tui"]


def test_f12_is_tested_once_while_no_line_is_open(
    terminal_with: Start, second_terminal: Start
) -> None:
    terminal = terminal_with(PANEL)
    terminal.wait_for("First start on this terminal", "press F12")
    terminal.press("F12")
    terminal.wait_for("F12 arrived")
    again = second_terminal(PANEL)
    again.wait_for("Choose a line and press Enter")
    assert "First start" not in again.text()


def test_unknown_key_sequence_is_reported(terminal_with: Start) -> None:
    terminal = terminal_with(PANEL)
    terminal.wait_for("press F12")
    # as raw bytes: a sequence of no terminal
    terminal.run("send-keys", "-H", "1b", "5b", "39", "39", "39", "7e")
    terminal.wait_for("An unknown key arrived", "ESC [999~")


def test_f12_is_not_tested_with_an_open_line(terminal_with: Start) -> None:
    """It would stop motors that run."""
    terminal = terminal_with([*PANEL, "sim:atv71@2"])
    terminal.wait_for("ATV71", "1 drive: ")
    assert "press F12" not in terminal.text()
