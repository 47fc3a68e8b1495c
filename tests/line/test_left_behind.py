"""A motor whose program was killed: the next program reports it, and takes it over by a key."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import pytest

from tests.programs import DRIVEPANEL, drivepanel, is_running, served, wait_until
from tui.simulator import DriveSpec, Simulation

from .terminal import Terminal
from .test_ways_to_end import running

INSIDE = pytest.mark.usefixtures("held_inside")
"""A keeper would stop the motor: see test_keeper for its own death."""

Start = Callable[[list[str]], Terminal]
PANEL = [sys.executable, "-m", "tui"]


def again(start: Start, simulation_line: str) -> Terminal:
    """Another panel on the same line, its own terminal replaced."""
    return start([*PANEL, simulation_line, "-d", "1"])


def frames(simulation: Simulation) -> int:
    """Count the writes of the drive's command word so far."""
    return simulation.drive(1).raw("CMD")


@INSIDE
def test_next_panel_reports_the_motor_and_takes_it_over(
    terminal_with: Start, second_terminal: Start
) -> None:
    with running(terminal_with) as made:
        made.simulation.drive(1).set("TTO", 300)
        os.kill(made.pid, signal.SIGKILL)
        wait_until(lambda: not is_running(made.pid), "the panel is gone")
        assert made.speed > 2
        terminal = again(second_terminal, made.line)
        terminal.wait_for("FORWARD", "Running since", "has exited", "T takes it over")
        # not armed: nothing is taken over
        terminal.press("T")
        terminal.wait_for("Not armed")
        terminal.press("a")
        wait_until(lambda: "ARMED" in terminal.text().replace("NOT ARMED", ""), "it is armed")
        before = frames(made.simulation)
        terminal.press("T")
        terminal.wait_for("Taken over")
        assert frames(made.simulation) == before
        terminal.press("q")
        question = "A motor is running on your command"
        terminal.wait_for(question)
        terminal.answer("s", question)
        made.stopped()
        wait_until(lambda: not is_running(terminal.client()), "the second panel ended")


@INSIDE
def test_leaving_a_disowned_motor_asks_first(terminal_with: Start, second_terminal: Start) -> None:
    """Its polls keep the drive alive: one q alone would let the motor coast later."""
    with running(terminal_with) as made:
        os.kill(made.pid, signal.SIGKILL)
        wait_until(lambda: not is_running(made.pid), "the panel is gone")
        terminal = again(second_terminal, made.line)
        terminal.wait_for("FORWARD", "Running since")
        terminal.press_for("q", "Quit the panel?", "30 s after")
        terminal.press("Escape")
        terminal.wait_for("FORWARD")
        assert made.speed > 2


@INSIDE
def test_observed_standstill_withdraws_the_offer(
    terminal_with: Start, second_terminal: Start
) -> None:
    with running(terminal_with) as made:
        os.kill(made.pid, signal.SIGKILL)
        wait_until(lambda: not is_running(made.pid), "the panel is gone")
        terminal = again(second_terminal, made.line)
        terminal.wait_for("FORWARD", "Running since")
        terminal.press("Space")
        made.stopped()
        terminal.wait_for("STOPPED")
        made.simulation.drive(1).run(30.0)
        terminal.wait_for("FORWARD")
        assert "Running since" not in terminal.text()


@pytest.mark.usefixtures("holder")
def test_motor_left_running_on_purpose_is_reported(
    terminal_with: Start, second_terminal: Start
) -> None:
    with running(terminal_with) as made:
        terminal = made.terminal
        terminal.press("q")
        terminal.wait_for("A motor is running on your command")
        terminal.answer("l")
        made.ended()
        time.sleep(3)
        assert made.speed > 2
        again(second_terminal, made.line).wait_for(
            "Running since", "Left running on purpose", "T takes it over"
        )


def test_panel_asks_if_start_cannot_be_recorded(terminal_with: Start, tmp_path: object) -> None:
    simulation = Simulation([DriveSpec("atv71", 1)])
    simulation.start()
    try:
        line = f"serial:{simulation.serve_pty()},19200,8N1"
        state = os.environ["DRIVEPANEL_STATE"]
        os.makedirs(state, exist_ok=True)
        # a file where the folder of the records should be
        with open(os.path.join(state, "starts"), "w") as file:
            file.write("")
        terminal = terminal_with([*PANEL, line, "-d", "1"])
        terminal.wait_for("STANDBY")
        terminal.press("a")
        wait_until(lambda: "ARMED" in terminal.text().replace("NOT ARMED", ""), "it is armed")
        terminal.press("r")
        terminal.wait_for("RUN FORWARD at")
        terminal.press("3", "0")
        terminal.wait_for("30  Hz")
        terminal.answer("Enter")
        terminal.wait_for("without a record")
        assert simulation.drive(1).motor.frequency == 0
        terminal.press("Escape")
        terminal.wait_for("was not recorded")
        assert simulation.drive(1).raw("CMD") == 0
    finally:
        simulation.stop()


class Killed(NamedTuple):
    """The line to a drive whose motor turns although its `run` was killed."""

    simulation: Simulation
    line: str
    pid: int

    @property
    def clause(self) -> str:
        return f"Started by run, process {self.pid}, which has exited. No program commands it."


@pytest.fixture
def killed(held_inside: None) -> Iterator[Killed]:
    """A `run` that was killed; the drive itself acts after 30 s without a request."""
    with Simulation(
        [DriveSpec("atv71", 1, sets={"TTO": 300}), DriveSpec("atv71", 2)]
    ) as simulation:
        host, port = simulation.serve_tcp()
        line = f"tcp:{host}:{port}"
        command = [*DRIVEPANEL, "run", line, "-d", "1", "--reference", "20Hz", "--arm"]
        with served(command, ready="Run forward") as program:
            wait_until(lambda: simulation.drive(1).motor.frequency > 2, "the motor runs")
            program.process.kill()
            program.process.wait()
        yield Killed(simulation, line, program.process.pid)


def documents(*words: str) -> Any:
    return json.loads(drivepanel(*words, "--json").stdout)


def test_commands_show_a_motor_that_no_program_commands(killed: Killed) -> None:
    line = killed.line
    ways = f"Stop it: drivepanel stop {line} -d 1. Take it over: drivepanel {line} -d 1,"
    assert f" {killed.clause} {ways}" in drivepanel("status", line, "-d", "1").stdout
    assert f" {killed.clause} {ways}" in drivepanel("status", line, "--all").stdout
    left = documents("status", line, "-d", "1")["left_behind"]
    facts = (left["program"], left["pid"], left["exited"], left["left_running"])
    assert facts == ("run", killed.pid, True, False)
    assert killed.clause in left["text"]
    assert documents("status", line, "-d", "2")["left_behind"] is None
    printed = drivepanel("lines").stdout
    assert f"{line} device 1: May be running since" in printed
    assert f" {killed.clause}\n  {ways}" in printed
    (known,) = documents("lines")["left_behind"]
    assert (known["line"], known["device"], known["pid"]) == (line, 1, killed.pid)
    # stopped from the shell, it is a motor like any other again
    assert drivepanel("stop", line, "-d", "1").returncode == 0
    assert killed.simulation.drive(1).motor.frequency == 0
    assert documents("lines")["left_behind"] == []
    killed.simulation.drive(1).run(30.0)
    assert documents("status", line, "-d", "1")["left_behind"] is None


def test_commands_drop_a_motor_that_its_drive_has_stopped(killed: Killed) -> None:
    assert documents("lines")["left_behind"] != []
    killed.simulation.drive(1).set("TTO", 10)
    wait_until(lambda: killed.simulation.drive(1).fault is not None, "the drive's own timeout")
    assert documents("status", killed.line, "-d", "1")["left_behind"] is None
    assert documents("lines")["left_behind"] == []


def test_each_screen_shows_a_motor_that_no_program_commands(
    killed: Killed, terminal_with: Start
) -> None:
    terminal = terminal_with([*PANEL, killed.line, "-d", "1"])

    def shows(*words: str) -> None:
        """The words, however the terminal breaks them at its edge or a dialog's."""
        wanted = [" ".join(word.split()) for word in (killed.clause, *words)]

        def there() -> bool:
            lines = terminal.text().replace("│", " ").splitlines()
            return all(item in " ".join(" ".join(lines).split()) for item in wanted)

        wait_until(there, f"{wanted} in\n{terminal.text()}")

    def disappears(text: str) -> None:
        """The newest message takes more lines for a while; then only the screen says it."""
        wait_until(lambda: text not in terminal.text(), f"{text} goes away")

    shows("Space stops it, T takes it over.", "Open it, then press Space")
    terminal.press("6")
    terminal.wait_for("REFERENCE")
    shows("Press Space to stop it, or T on Monitor to take it over.")
    terminal.press("m")
    shows("Drive 1: Running since", "Open it, then press Space to stop it or T to take it over.")
    terminal.press("1")
    terminal.wait_for("no comma")
    disappears("Open it,")
    shows("Press Enter to open it, then Space to stop it or T to take it over.")
    terminal.press("q")
    terminal.wait_for("Quit the panel?")
    shows(
        "Device 1, Altivar 71: Running since",
        "Press Space to stop it. To take it over, press Esc, then T",
    )
    terminal.press("Space")
    wait_until(lambda: killed.simulation.drive(1).motor.frequency == 0, "Space stops it there")
    disappears(killed.clause)
