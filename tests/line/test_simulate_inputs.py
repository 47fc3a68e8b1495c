"""`drivepanel simulate` from outside: inputs by lines on its standard input, line settings."""

from __future__ import annotations

import fcntl
import json
import subprocess
import termios
from array import array
from pathlib import Path
from typing import IO

import pytest

from tests.programs import PATIENCE, Served, drivepanel, port_of, simulated, wait_until

NEARLY_FULL = 60_000
"""Bytes in a pipe that takes 64 KiB."""


def typed(simulation: Served, line: str) -> str:
    """Reply of the program to a typed line."""
    process = simulation.process
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(f"{line}\n")
    process.stdin.flush()
    return process.stdout.readline().strip()


def frequency(line: str) -> float:
    done = drivepanel("read", line, "-d", "2", "-p", "atv312", "--json", "RFR")
    assert done.returncode == 0, done.stderr
    return float(json.loads(done.stdout)["values"]["rFr"]["value"])


def test_standard_input_sets_inputs_and_runs_the_motor() -> None:
    way = ("atv312@2", "--set", "FR1=1", "--tcp", "0")
    with simulated(*way, stdin=subprocess.PIPE) as simulation:
        line = f"tcp:127.0.0.1:{port_of(simulation.ready)}"
        assert typed(simulation, "2: LI1=1, AI1=8V") == "2: LI1 = 1, AI1 = 80 %"
        wait_until(lambda: frequency(line) > 10, "the motor turns")
        assert typed(simulation, "2: LI1=0") == "2: LI1 = 0"
        wait_until(lambda: frequency(line) == 0, "the motor stands")
        assert simulation.process.stdin is not None
        simulation.process.stdin.write("2: LI9=1\n")
        simulation.process.stdin.close()
        simulation.process.stdin = None
        status, output = simulation.end()
        assert status == 0
        assert "No input is called 'LI9'" in output


@pytest.mark.parametrize(("more", "status"), [((), 3), (("--any-settings",), 0)])
def test_other_baud_is_ignored_unless_any_settings_is_given(
    more: tuple[str, ...], status: int, tmp_path: Path
) -> None:
    link = str(tmp_path / "line")
    with simulated("atv312@2", "--pty", link, *more):
        own = drivepanel("read", f"serial:{link},19200,8E1", "-d", "2", "-p", "atv312", "ETA")
        assert own.returncode == 0, own.stderr
        other = drivepanel("read", f"serial:{link},9600,8E1", "-d", "2", "-p", "atv312", "ETA")
        assert other.returncode == status, other.stderr


def test_simulate_ends_normally_with_unread_output() -> None:
    """A thread that waits for its reader in a buffer of Python aborted the program at its end."""
    with simulated("atv312@2", "--tcp", "0", stdin=subprocess.PIPE) as simulation:
        process = simulation.process
        assert process.stdin is not None
        process.stdin.write("2: LI9=1\n" * 3000)  # its replies exceed the capacity of a pipe
        process.stdin.flush()
        assert process.stderr is not None
        pipe = process.stderr
        wait_until(lambda: waiting(pipe) > NEARLY_FULL, "its thread waits for a reader")
        process.terminate()
        process.wait(PATIENCE)
        assert process.returncode == 0


def waiting(pipe: IO[str]) -> int:
    """Unread bytes in a pipe."""
    count = array("i", [0])
    fcntl.ioctl(pipe, termios.FIONREAD, count)
    return count[0]
