"""Marks in the curve of a panel for what other programs on its line have written."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable

import pytest

from tests.programs import DRIVEPANEL, drivepanel, served, wait_until

from .terminal import Terminal
from .test_commands import bench, turns

Start = Callable[[list[str]], Terminal]
ON_DRIVE = ("-p", "atv71", "-d", "1")


def read_at_mark(terminal: Terminal, cause: str) -> None:
    """Open the cursor, and move it left until the cause of a mark is shown."""
    terminal.answer("=")
    wait_until(lambda: "= read" not in terminal.text(), "the cursor opens")
    for _ in range(40):
        if re.search(cause, terminal.text()):
            break
        terminal.press("Left")
        time.sleep(0.1)
    assert re.search(cause, terminal.text()), terminal.text()
    terminal.answer("=")
    terminal.wait_for("= read")


@pytest.mark.usefixtures("holder")
def test_panel_marks_what_other_programs_write_and_names_them(terminal_with: Start) -> None:
    with bench() as (simulation, line):
        panel = terminal_with([sys.executable, "-m", "tui", line, "-d", "1"])
        panel.wait_for("output", "reference", "= read")
        assert "write" not in panel.text()
        done = drivepanel("write", line, "ACC=4.0", "--arm", *ON_DRIVE)
        assert done.returncode == 0, done.stderr
        panel.wait_for("● write")
        read_at_mark(panel, r"write of ACC by write \(pid \d+\)")
        command = [*DRIVEPANEL, "run", line, "--reference", "20Hz", "--arm", *ON_DRIVE]
        with served(command, ready="running forward") as runner:
            wait_until(lambda: turns(simulation), "the motor turns")
            panel.wait_for("▶ start")
            pid = runner.process.pid
            read_at_mark(panel, rf"start after a command of run \(pid {pid}\)")
            runner.end()
        panel.wait_for("▼")
        read_at_mark(panel, rf"stop after a command of run \(pid {pid}\)")
