"""`drivepanel counters` and a running panel as separate processes on one line."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable

from tests.programs import drivepanel

from .terminal import Terminal
from .test_commands import bench

Start = Callable[[list[str]], Terminal]


def test_counters_include_a_panel_and_their_reset_is_shown_there(
    terminal_with: Start,
) -> None:
    with bench() as (_, line):
        panel = terminal_with([sys.executable, "-m", "tui", line, "-d", "1"])
        panel.wait_for("STANDBY")
        panel.press("7")
        panel.wait_for("Frames on the line")
        panel.press("Tab")
        panel.press("Tab")
        panel.wait_for("function 8")
        # the keeper of the line counts for both; nothing is lost, and that is said
        done = drivepanel("counters", line, "-d", "1", "--frames", "20", "--for", "1", "--json")
        assert done.returncode == 0, done.stdout + done.stderr
        reported = json.loads(done.stdout)
        assert reported["counted_by"].startswith("keeper")
        assert reported["test"] == {"frames": 20, "answered": 20}
        assert reported["ours"]["frames"] > 20, "what the panel sends meanwhile belongs to it"
        assert reported["differences"] == []
        # programs that compare the counters report who reset them
        again = drivepanel("counters", line, "-d", "1", "--reset-drive", "--arm", "--frames", "3")
        assert again.returncode == 0, again.stdout + again.stderr
        panel.wait_for("restarted its counters")
        assert "STANDBY" in panel.text()
