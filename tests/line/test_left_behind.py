"""A motor whose program was killed: the next one knows it, says so, and takes it over by a key."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable

from tests.programs import wait_until
from tui.simulator import DriveSpec, Simulation

from .terminal import Terminal, runs
from .test_ways_to_end import running

Start = Callable[[list[str]], Terminal]
PANEL = [sys.executable, "-m", "tui"]


def again(start: Start, simulation_line: str) -> Terminal:
    """Another panel on the same line, its own terminal replaced."""
    return start([*PANEL, simulation_line, "-d", "1"])


def frames(simulation: Simulation) -> int:
    """How often the drive's command word was written so far."""
    return simulation.drive(1).raw("CMD")


def test_the_next_panel_knows_the_motor_and_takes_it_over(
    terminal_with: Start, second_terminal: Start
) -> None:
    with running(terminal_with) as made:
        made.simulation.drive(1).set("TTO", 300)
        os.kill(made.pid, signal.SIGKILL)
        wait_until(lambda: not runs(made.pid), "the panel is gone")
        assert made.speed > 2
        terminal = again(second_terminal, made.line)
        terminal.wait_for("FORWARD", "Runs since", "that program ended", "T takes over")
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
        terminal.wait_for("A motor runs by your command")
        terminal.answer("s")
        made.stopped()
        wait_until(lambda: not runs(terminal.client()), "the second panel ended")


def test_a_motor_that_is_disowned_is_not_left_without_a_question(
    terminal_with: Start, second_terminal: Start
) -> None:
    """Its polls feed the drive's time-out: one q alone would let the motor coast later."""
    with running(terminal_with) as made:
        os.kill(made.pid, signal.SIGKILL)
        wait_until(lambda: not runs(made.pid), "the panel is gone")
        terminal = again(second_terminal, made.line)
        terminal.wait_for("FORWARD", "Runs since")
        terminal.press("q")
        terminal.wait_for("Leave the panel?", "30 s after")
        terminal.press("Escape")
        terminal.wait_for("FORWARD")
        assert made.speed > 2


def test_a_stop_that_was_seen_withdraws_the_offer(
    terminal_with: Start, second_terminal: Start
) -> None:
    with running(terminal_with) as made:
        os.kill(made.pid, signal.SIGKILL)
        wait_until(lambda: not runs(made.pid), "the panel is gone")
        terminal = again(second_terminal, made.line)
        terminal.wait_for("FORWARD", "Runs since")
        terminal.press("Space")
        made.stopped()
        terminal.wait_for("STOPPED")
        made.simulation.drive(1).run(30.0)
        terminal.wait_for("FORWARD")
        assert "Runs since" not in terminal.text()


def test_a_motor_left_running_on_purpose_is_told_of(
    terminal_with: Start, second_terminal: Start
) -> None:
    with running(terminal_with) as made:
        terminal = made.terminal
        terminal.press("q")
        terminal.wait_for("A motor runs by your command")
        terminal.answer("l")
        made.ended()
        assert made.speed > 2
        again(second_terminal, made.line).wait_for("Runs since", "left running on purpose")


def test_where_a_start_cannot_be_recorded_the_panel_asks(
    terminal_with: Start, tmp_path: object
) -> None:
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
        terminal.wait_for("unrecorded?")
        assert simulation.drive(1).motor.frequency == 0
        terminal.press("Escape")
        terminal.wait_for("was not recorded")
        assert simulation.drive(1).raw("CMD") == 0
    finally:
        simulation.stop()
