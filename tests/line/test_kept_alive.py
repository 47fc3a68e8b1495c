"""The keeper of a line reads drives so that they do not trip, as long as their program lives."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from contextlib import closing

import pytest

from tests.programs import DRIVEPANEL, served, wait_until
from tui.session.api import open_drives
from tui.session.connect.open_line import open_line
from tui.simulator import DriveSpec, Simulation

from .test_commands import bench, turns
from .test_shared_programs import runs_a_motor, stopped_by_commands

TIMEOUT = 1.0
"""Seconds without a request after which the drive trips."""
STRICT = DriveSpec("atv71", 1, sets={"TTO": round(10 * TIMEOUT)})


async def busy() -> None:
    """Hold the loop of the line up."""
    time.sleep(1.5 * TIMEOUT)  # noqa: ASYNC251


def tripped(simulation: Simulation) -> bool:
    return simulation.drive(1).fault is not None


@pytest.mark.usefixtures("with_keepers")
def test_drive_does_not_trip_while_its_program_is_busy() -> None:
    with bench(STRICT) as (simulation, line):
        with open_drives(line) as drives:
            drives.drive(profile="atv71")
            shared = drives._calls.line
            alive = shared.facts.keep_alives
            wait_until(
                lambda: [keep_alive.timeout for keep_alive in alive.kept.values()] == [TIMEOUT],
                "it is kept",
            )
            simulation.drive(1).run(20.0)
            wait_until(lambda: turns(simulation), "the motor turns")
            shared.spawn(busy, "busy")
            time.sleep(2 * TIMEOUT)
            assert not tripped(simulation)
            assert turns(simulation)
        # and no longer than its program is there
        wait_until(lambda: tripped(simulation), "the drive trips")


def test_motor_of_a_frozen_program_is_kept_alive_until_it_is_stopped() -> None:
    with (
        bench(STRICT) as (simulation, line),
        served(runs_a_motor(line), ready="running forward") as runner,
    ):
        wait_until(lambda: turns(simulation), "the motor turns")
        runner.process.send_signal(signal.SIGSTOP)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops on its ramp", 10.0)
        # no program reads it from then on
        wait_until(lambda: tripped(simulation), "the drive trips")
        runner.process.kill()


HANGS = """
import gc, sys, threading, time
from tui.bus.schedule.engine import Engine
from tui.cli.main import main

def hang():
    sys.stdin.readline()
    for engine in [one for one in gc.get_objects() if isinstance(one, Engine)]:
        engine._loop.call_soon_threadsafe(time.sleep, 600)

threading.Thread(target=hang, daemon=True).start()
main()
"""
"""A command whose loop hangs once it reads a line."""


def test_motor_of_a_program_whose_loop_hangs_is_stopped() -> None:
    with bench(STRICT) as (simulation, line):
        command = [sys.executable, "-c", HANGS, *runs_a_motor(line)[len(DRIVEPANEL) :]]
        with served(command, ready="running forward", stdin=subprocess.PIPE) as runner:
            wait_until(lambda: turns(simulation), "the motor turns")
            assert runner.process.stdin is not None
            print(file=runner.process.stdin, flush=True)
            wait_until(lambda: stopped_by_commands(simulation), "it stops on its ramp", 15.0)
            assert runner.process.poll() is None


@pytest.mark.usefixtures("with_keepers")
def test_drive_left_running_on_purpose_is_not_kept_alive() -> None:
    with bench(STRICT) as (simulation, line), closing(open_line(line, program="panel")):
        with served(runs_a_motor(line, "--leave-running"), ready="running forward") as runner:
            wait_until(lambda: turns(simulation), "the motor turns")
            runner.process.kill()
        wait_until(lambda: tripped(simulation), "the drive trips", 10.0)
