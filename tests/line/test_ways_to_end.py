"""Every way in which the panel can end while a motor runs by its order, in a real terminal."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import pytest

from tests.programs import is_running, wait_until
from tui.simulator import DriveSpec, Simulation

from .terminal import Terminal

Start = Callable[[list[str]], Terminal]


class Running(NamedTuple):
    """A panel in its terminal, whose motor turns."""

    simulation: Simulation
    terminal: Terminal
    pid: int
    line: str

    @property
    def speed(self) -> float:
        return self.simulation.drive(1).motor.frequency

    def ended(self) -> None:
        wait_until(lambda: not is_running(self.pid), "the panel ended")

    def stopped(self) -> None:
        wait_until(lambda: self.speed == 0, "the motor stopped")


@contextmanager
def running(start: Start, *options: str, family: str = "atv71") -> Iterator[Running]:
    """The panel on a simulated drive of this process, its motor running by keys."""
    # the drive's own watch acts after a minute, long after everything that is looked at here
    simulation = Simulation([DriveSpec(family, 1, sets={"TTO": 300} if family == "atv71" else {})])
    simulation.start()
    try:
        line = f"serial:{simulation.serve_pty()},19200,8N1"
        terminal = start([sys.executable, "-m", "tui", line, "-d", "1", *options])
        terminal.wait_for("STANDBY")
        # one after another: keys that arrive together are ignored
        terminal.press("a")
        wait_until(lambda: "ARMED" in terminal.text().replace("NOT ARMED", ""), "it is armed")
        terminal.press("r")
        terminal.wait_for("RUN FORWARD at")
        terminal.press("3")
        terminal.press("0")
        terminal.wait_for("30  Hz")
        terminal.answer("Enter")
        wait_until(lambda: simulation.drive(1).motor.frequency > 2, "the motor runs")
        terminal.wait_for("FORWARD")
        yield Running(simulation, terminal, terminal.client(), line)
    finally:
        simulation.stop()


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM])
@pytest.mark.parametrize("family", ["atv71", "atv21"])
def test_signal_stops_the_motor_first(
    terminal_with: Start, number: signal.Signals, family: str
) -> None:
    with running(terminal_with, family=family) as made:
        os.kill(made.pid, number)
        made.stopped()
        assert made.simulation.drive(1).fault is None
        made.ended()


def test_closed_terminal_stops_the_motor_first(terminal_with: Start) -> None:
    with running(terminal_with) as made:
        made.terminal.run("kill-session")
        made.stopped()
        assert made.simulation.drive(1).fault is None
        made.ended()


def test_hangup_option_leaves_the_motor_running(terminal_with: Start) -> None:
    with running(terminal_with, "--on-hangup", "leave-running") as made:
        os.kill(made.pid, signal.SIGHUP)
        made.ended()
        assert made.speed > 2


def test_ctrl_c_does_not_end_the_panel(terminal_with: Start) -> None:
    with running(terminal_with) as made:
        made.terminal.press("C-c")
        made.terminal.wait_for("FORWARD")
        assert made.speed > 2
        made.terminal.press("Space")
        made.stopped()


def test_exit_key_asks_and_stops(terminal_with: Start) -> None:
    with running(terminal_with) as made:
        made.terminal.press("q")
        made.terminal.wait_for("A motor is running on your command", "s or Enter")
        made.terminal.answer("s")
        made.ended()
        assert made.speed == 0


def test_motor_of_a_killed_panel_is_stopped_by_the_drive_timeout(terminal_with: Start) -> None:
    with running(terminal_with) as made:
        made.simulation.drive(1).set("TTO", 10)
        os.kill(made.pid, signal.SIGKILL)
        wait_until(lambda: made.simulation.drive(1).fault is not None, "the drive's own timeout")
        made.stopped()
