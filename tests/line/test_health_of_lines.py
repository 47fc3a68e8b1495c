"""Last minute of a line held by a keeper, in programs as separate processes."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable

import pytest

from tests.programs import drivepanel
from tui.simulator import DriveSpec, Simulation
from tui.simulator.troubles import troubles_of

from .terminal import Terminal
from .test_commands import bench

Start = Callable[[list[str]], Terminal]
FIGURES = re.compile(r"Line 60 s +(\d+) % of +\d+ good .* (\d+) foreign +(\d+) strays")


def panel_on(start: Start, line: str) -> Terminal:
    return start([sys.executable, "-m", "tui", line, "-d", "1"])


@pytest.mark.parametrize(
    ("kind", "value", "sign", "meaning"),
    [
        ("master", 0.1, "▲ foreign frames", "Another master is on this line"),
        ("duplicated", 0.9, "▲ stray replies", "Two drives have one address"),
        ("lost", 0.2, "% good", "replies were good in the last minute"),
    ],
)
def test_line_trouble_is_shown_on_every_screen(
    terminal_with: Start, kind: str, value: float, sign: str, meaning: str
) -> None:
    rates, habits = troubles_of({kind: value})
    with Simulation([DriveSpec("atv71", 1)], faults=rates, habits=habits, seed=3) as simulation:
        panel = panel_on(terminal_with, f"serial:{simulation.serve_pty()},19200,8N1")
        panel.wait_for(sign)
        panel.press("m")
        panel.wait_for(" ".join(meaning.split()[:3]))
        panel.press("Escape")
        panel.press("1")
        panel.wait_for("1▲Line")


def test_healthy_line_with_two_programs_raises_no_alert(terminal_with: Start) -> None:
    with bench(DriveSpec("atv71", 1), DriveSpec("atv312", 2)) as (_, line):
        panel = panel_on(terminal_with, line)
        panel.wait_for("STANDBY")
        arguments = ("counters", line, "-d", "2", "--frames", "60", "--for", "2", "--json")
        done = drivepanel(*arguments)
        minute = json.loads(done.stdout)["last_minute"]
        assert (minute["line"]["foreign"], minute["line"]["strays"]) == (0, 0)
        assert minute["device"]["good"] >= 50
        assert minute["line"]["good"] > minute["device"]["good"], "the panel's are counted, too"
        panel.press("1")
        panel.wait_for("Line 60 s")
        found = FIGURES.search(panel.text())
        assert found is not None, panel.text()
        assert found.group(2, 3) == ("0", "0")
        assert "foreign frames" not in panel.text()
