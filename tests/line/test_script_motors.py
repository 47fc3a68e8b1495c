"""Motors of scripts in `with drive.running(...)`: killed, frozen, signaled, stopped by others."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.programs import PATIENCE, Served, drivepanel, end_keepers, served, wait_until
from tui.simulator import DriveSpec, Simulation

from .test_commands import bench, stands, turns
from .test_shared_programs import on_record, stopped_by_commands

BLOCKING = """
import sys, time
from tui.session.api import open_drives

with open_drives(sys.argv[1]) as line:
    drive = line.drive(profile="atv71")
    with drive.armed(), drive.running("20Hz") as motor:
        print("running", flush=True)
        {body}
    print("left", drive.read("RFR")["RFR"].number, flush=True)
"""
ASYNC = """
import asyncio, sys
from tui.session.api import open_drives_async

async def main():
    async with open_drives_async(sys.argv[1]) as line:
        drive = await line.drive(profile="atv71")
        with drive.armed():
            async with drive.running("20Hz") as motor:
                print("running", flush=True)
                await motor.wait()

asyncio.run(main())
"""
SLEEP, WAIT = "time.sleep(600)", "motor.wait()"
SCRIPTS = {"blocking": BLOCKING.format(body=SLEEP), "async": ASYNC}
KINDS = pytest.mark.parametrize("kind", SCRIPTS)


@contextmanager
def motor_of_a_script(script: str) -> Iterator[tuple[Simulation, str, Served]]:
    """A script inside its block, on a line with a keeper; its motor turns."""
    with bench(DriveSpec("atv71", 1, sets={"TTO": 100})) as (simulation, line):
        with served([sys.executable, "-c", script, line], ready="running") as program:
            wait_until(lambda: turns(simulation), "the motor turns")
            yield simulation, line, program
        end_keepers()


@KINDS
def test_keeper_stops_the_motor_of_a_killed_script(kind: str) -> None:
    with motor_of_a_script(SCRIPTS[kind]) as (simulation, _, program):
        assert on_record() == [False]
        program.process.kill()
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops on its ramp", 10.0)
        wait_until(lambda: on_record() == [], "the record is removed")


def test_motor_of_a_frozen_script_is_stopped_and_not_restarted() -> None:
    with motor_of_a_script(BLOCKING.format(body=WAIT)) as (simulation, _, program):
        program.process.send_signal(signal.SIGSTOP)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops on its ramp", 20.0)
        before = simulation.drive(1).raw("CMD")
        program.process.send_signal(signal.SIGCONT)
        output, error = program.process.communicate(timeout=PATIENCE)
        assert program.process.returncode == 1
        assert "MotorStopped: Device 1" in error
        assert "a stop while this program was suspended" in error
        assert "left" not in output
        assert simulation.drive(1).raw("CMD") == before


@KINDS
@pytest.mark.parametrize(
    ("number", "status"),
    [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, -signal.SIGINT)],
)
def test_signal_stops_the_motor_before_the_script_ends(
    kind: str, number: signal.Signals, status: int
) -> None:
    with motor_of_a_script(SCRIPTS[kind]) as (simulation, _, program):
        for _ in range(2 if (kind, number) == ("async", signal.SIGINT) else 3):
            program.process.send_signal(number)
            time.sleep(0.05)
        program.process.communicate(timeout=PATIENCE)
        assert stopped_by_commands(simulation)
        assert program.process.returncode == status
        wait_until(lambda: on_record() == [], "the record is removed")


def test_third_ctrl_c_ends_an_async_script_and_stops_its_motor() -> None:
    """With that, asyncio no longer waits for its tasks."""
    with motor_of_a_script(ASYNC) as (simulation, _, program):
        for _ in range(5):
            program.process.send_signal(signal.SIGINT)
            time.sleep(0.1)
        program.process.communicate(timeout=PATIENCE)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops on its ramp", 15.0)
        wait_until(lambda: on_record() == [], "the record is removed")


def test_stop_by_another_program_is_reported_at_the_end_of_the_block() -> None:
    with motor_of_a_script(BLOCKING.format(body=WAIT)) as (simulation, line, program):
        done = drivepanel("stop", line, "-d", "1", "-p", "atv71")
        assert done.returncode == 0, done.stderr
        output, error = program.process.communicate(timeout=PATIENCE)
        assert program.process.returncode == 1
        assert "MotorStopped: Device 1" in error
        assert "It was stopped by drivepanel stop, stop (pid" in error
        assert "left" not in output
        assert stands(simulation)


def test_another_program_cannot_command_the_drive_of_a_block() -> None:
    with motor_of_a_script(BLOCKING.format(body=SLEEP)) as (simulation, line, program):
        for words in (["run", line, "--reference", "10Hz"], ["reference", line, "10Hz"]):
            done = drivepanel(*words, "-d", "1", "-p", "atv71", "--arm")
            assert done.returncode == 5, done.stdout
            assert f"script (pid {program.process.pid})" in done.stderr
        assert turns(simulation)


def test_motor_of_a_script_with_an_open_line_in_a_thread_is_stopped() -> None:
    """The interpreter ends while a daemon thread is inside the block."""
    script = """
import sys, threading
from tui.session.api import open_drives

line = open_drives(sys.argv[1])
drive = line.drive(profile="atv71")
inside = threading.Event()

def work():
    with drive.armed(), drive.running("20Hz") as motor:
        inside.set()
        motor.wait()

threading.Thread(target=work, daemon=True).start()
inside.wait()
print("running", flush=True)
sys.stdin.read()
"""
    with bench(DriveSpec("atv71", 1, sets={"TTO": 100})) as (simulation, line):
        command = [sys.executable, "-c", script, line]
        with served(command, ready="running") as program:
            program.process.communicate(timeout=PATIENCE)
            wait_until(lambda: stopped_by_commands(simulation), "the motor stops", 15.0)
        end_keepers()
