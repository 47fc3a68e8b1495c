"""`profiles --prove FILE --line LINE`: refusals before anything is sent, and its test."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.cli.running import confirming
from tui.cli.shared import profile_choice
from tui.drive.profile import library
from tui.drive.site_proof import unproved_commands
from tui.session.acceptance.plan import planned_motions
from tui.session.acceptance.profile_test import PROVED_HZ, profile_test
from tui.session.acceptance.steps import MotionStep, StopStep
from tui.simulator import DriveSpec, Simulation

from .commands import ended, refused
from .test_accept import person

MS300 = library.packaged_folder() / library.PUBLIC / "ms300.toml"
WITH_LINE = ("profiles", "--prove", MS300, "--line", "serial:/dev/none")


def test_drive_is_not_tried_without_arming() -> None:
    assert "Not armed: this runs the output" in refused(5, *WITH_LINE, "--without-motor")


def test_drive_is_not_tried_with_its_motor() -> None:
    output = refused(5, *WITH_LINE, "--arm")
    assert "Disconnect the motor from the drive, then add --without-motor." in output


def test_drive_is_not_tried_without_a_person() -> None:
    output = ended(5, *WITH_LINE, "--arm", "--without-motor").stderr
    assert "It writes no setting, saves nothing" in output
    assert "needs a person at the keyboard" in output


def test_line_needs_a_file_to_prove() -> None:
    assert "--line is for --prove of one file." in refused(
        2, "profiles", "--line", "sim:atv312", "--arm"
    )


def test_file_that_is_not_the_profile_in_use_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.toml"
    path.write_text(MS300.read_text("utf-8").replace('version = "', 'version = "9.'), "utf-8")
    output = refused(2, "profiles", "--prove", path, "--line", "serial:/dev/none", "--arm")
    assert "is not the profile ms300 that Drive Panel uses" in output


def test_file_that_fails_on_the_simulated_drive_is_not_tried(tmp_path: Path) -> None:
    path = tmp_path / "other.toml"
    path.write_text(MS300.read_text("utf-8").replace("2102H = 60.00", "2102H = 6.00"), "utf-8")
    output = refused(1, "profiles", "--prove", path, "--line", "serial:/dev/none", "--arm")
    assert "it does not mean 2102H = 6.00 Hz" in output


@pytest.mark.parametrize("id", ["atv21", "atv312", "ms300", "powerdrive", "v20"])
def test_test_of_a_profile_runs_slowly_and_tries_each_stop(id: str) -> None:
    profile = library.load(id)
    test = profile_test(profile, Path(f"{id}.toml"))
    motions = [step for step in test.steps if isinstance(step, MotionStep)]
    assert all((step.hz or 0) <= PROVED_HZ for step in motions)
    stops = {step.method for step in motions if isinstance(step, StopStep)}
    ids = {order.id for chart in profile.data.charts for order in chart.orders}
    assert stops == ids & {"stop", "quick-stop", "freewheel"}
    assert len(planned_motions(test)) == len(test.steps)


@pytest.mark.sweep
@pytest.mark.parametrize("in_fault", [False, True])
def test_commands_that_worked_are_proved_and_need_no_question(
    in_fault: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    questions = person(monkeypatch, "y")
    for module in (confirming, profile_choice):
        monkeypatch.setattr(module, "may_ask", lambda: True)
    with Simulation([DriveSpec("ms300", 1)]) as simulation:
        line = "tcp:{}:{}".format(*simulation.serve_tcp())
        if in_fault:
            simulation.drive(1).provoke("1")
        words = ("profiles", "--prove", MS300, "--line", line, "--arm", "--without-motor", "--json")
        done = ended(0, *words)
        assert any("Is this a real drive" in question for question in questions)
        library.load.cache_clear()
        left = {"reset"} - ({"reset"} if in_fault else set())
        assert unproved_commands(library.load("ms300")) == left, done.output
        monkeypatch.setattr(profile_choice, "may_ask", lambda: False)
        ended(0, "reference", line, "10Hz", "--arm", "-p", "ms300")
        assert "is unproved" in refused(5, "write", line, "01-00=50", "--arm", "-p", "ms300")
    library.load.cache_clear()
