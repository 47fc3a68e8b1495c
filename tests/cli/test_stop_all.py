"""`drivepanel stop --all` beside other programs on the line."""

from __future__ import annotations

from tui.session.connect.open_line import open_line

from .commands import run, tcp_line


def test_a_drive_that_another_program_leaves_alone_is_stopped_too() -> None:
    """As in a proof of its communication loss, perhaps with its motor turning."""
    with tcp_line("atv71@1", "atv312@2") as line:
        opened = open_line(line, wait=5, program="prove")
        try:
            opened.line.facts.hush(2, "Its communication time-out is being proved.")
            told = run(0, "stop", line, "--all", "--addresses", "1-2")
        finally:
            opened.close()
        assert "Device 1, Altivar 71: stopped" in told
        assert "Device 2, Altivar 312: stopped" in told
        assert opened.line.facts.stops.totals == {1: 1, 2: 1}
