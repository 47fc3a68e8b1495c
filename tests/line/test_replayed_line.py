"""A keeper records a line; the panel replays its file in a terminal of its own."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from tests.programs import DRIVEPANEL, drivepanel, end_keepers
from tui.simulator import DriveSpec

from .terminal import Terminal
from .test_commands import bench
from .test_recorded_line import record_files

DRIVES = DriveSpec("atv71", 1, run_hz=30), DriveSpec("atv21", 2)


@pytest.fixture(autouse=True)
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs of these tests record."""
    monkeypatch.delenv("DRIVEPANEL_RECORD")


def test_panel_shows_a_recorded_trip_again_and_promises_no_stop(
    terminal_with: Callable[[list[str]], Terminal],
    second_terminal: Callable[[list[str]], Terminal],
) -> None:
    with bench(*DRIVES) as (simulation, line):
        live = terminal_with([*DRIVEPANEL, line, "-d", "1"])
        live.wait_for("Output Hz", "at reference", " 6 s │")  # seconds of its curve
        simulation.drive(1).provoke("ObF")
        live.wait_for("FAULT ObF", "press 5")
        live.press("q")
        live.wait_for("Quit the panel?")
        live.answer("y")
        live.wait_for_end()
        end_keepers()
    (path,) = record_files()
    replay = second_terminal([*DRIVEPANEL, "replay", str(path), "-d", "1"])
    replay.wait_for("REPLAY", "nothing is sent", "no motor to stop", "Output Hz")
    replay.wait_for("Next, in ", "drive 1: Tripped on ObF")
    assert "FAULT" not in replay.text()
    replay.press("#")  # the trip, 2 s before it
    replay.wait_for("at reference")
    replay.wait_for("FAULT ObF", "press 5")
    replay.press("Space")
    replay.wait_for("Nothing was stopped: this is a replay")
    replay.press("a")
    replay.wait_for("This is a replay: nothing is sent to a drive.")
    assert "ARMED" not in replay.text()
    replay.press("5")
    replay.wait_for("REPLAY", "OVERBRAKING", "no motor to stop")
    replay.press("q")
    replay.wait_for_end()


def test_replay_reports_errors_before_it_opens() -> None:
    with bench(*DRIVES) as (_, line):
        assert drivepanel("read", line, "ETA", "-p", "atv71").returncode == 0
        end_keepers()
    (path,) = record_files()
    for arguments, text in (
        ((str(path), "--at", "noon"), "'noon' is not a time"),
        ((str(path), "--at", "2001-01-01T10:00"), "outside the record"),
        ((str(path), "-d", "9"), "Drive 9 is not in the record. Its drives: 1."),
        ((str(path.parent / "none"),), "is not a file"),
    ):
        done = drivepanel("replay", *arguments)
        assert (done.returncode, done.stdout) == (2, "")
        assert text in re.sub(r"\s+", " ", done.stderr)
