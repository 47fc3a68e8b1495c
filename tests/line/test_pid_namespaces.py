"""Programs in separate PID namespaces, like containers, on one line."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from functools import cache
from pathlib import Path

import pytest

from tests.programs import Served, is_running, served, wait_until

from .test_commands import bench, turns
from .test_keeper import keeper, read, times_of_good_values
from .test_shared_programs import records, runs_a_motor, stopped_by_commands

OF_ITS_OWN = ("unshare", "--fork", "--pid", "--mount-proc", "--kill-child")
HIGH = 'echo 30000 > /proc/sys/kernel/ns_last_pid; "$@"; exit $?'
"""Gives the next process a number that the namespace outside surely has not."""


@cache
def has_namespaces() -> bool:
    """True if this user may make them."""
    try:
        return not subprocess.run([*OF_ITS_OWN, "true"], capture_output=True).returncode
    except OSError:
        return False


@pytest.fixture
def programs() -> Iterator[ExitStack]:
    """Programs that end with the test."""
    if not has_namespaces():
        pytest.skip("needs root, to make PID namespaces")
    with ExitStack() as stack:
        yield stack


def inside(program: Served) -> int:
    """Process id, outside, of the program that `unshare` has started."""
    pid = program.process.pid
    return int(Path(f"/proc/{pid}/task/{pid}/children").read_text().split()[0])


def test_motor_of_a_killed_program_is_stopped_although_its_pid_is_in_use(
    programs: ExitStack,
) -> None:
    with bench() as (simulation, line):
        recorder = programs.enter_context(served([*OF_ITS_OWN, *records(line)], ready="{"))
        command = [*OF_ITS_OWN, *runs_a_motor(line)]
        runner = programs.enter_context(served(command, ready="running forward"))
        wait_until(lambda: turns(simulation), "the motor turns")
        os.kill(inside(runner), signal.SIGKILL)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops", 10.0)
        times_of_good_values(recorder, 1.0)


def test_motor_of_a_container_runs_on_when_the_keeper_dies(programs: ExitStack) -> None:
    with bench() as (simulation, line):
        recorder = programs.enter_context(served(records(line), ready="{"))
        command = [*OF_ITS_OWN, "sh", "-c", HIGH, "sh", *runs_a_motor(line)]
        programs.enter_context(served(command, ready="running forward"))
        wait_until(lambda: turns(simulation), "the motor turns")
        os.kill(keeper(), signal.SIGKILL)
        times_of_good_values(recorder, 4.0)
        assert turns(simulation)
        assert simulation.drive(1).fault is None


def test_frozen_keeper_outside_the_container_is_named(programs: ExitStack) -> None:
    with bench() as (simulation, line):
        assert read(line).returncode == 0
        command = [*OF_ITS_OWN, *runs_a_motor(line)]
        runner = programs.enter_context(served(command, ready="running forward"))
        wait_until(lambda: turns(simulation), "the motor turns")
        pid = keeper()
        os.kill(pid, signal.SIGSTOP)
        time.sleep(0.5)
        os.kill(inside(runner), signal.SIGINT)
        time.sleep(4.0)
        assert is_running(pid), "it cannot be killed from there"
        os.kill(pid, signal.SIGCONT)
        wait_until(lambda: not is_running(pid), "its alarm ends it")
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops", 10.0)
