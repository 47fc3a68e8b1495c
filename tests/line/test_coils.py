"""Coils and discrete inputs with other people's programs at the other end: mbpoll and libmodbus."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

from tests.programs import (
    DRIVEPANEL,
    PATIENCE,
    drivepanel,
    end_keepers,
    port_of,
    pty_pair,
    rtu_tcp,
    served,
    simulated,
    wait_until,
)
from tui.drive.profile import library
from tui.simulator import DriveSpec, Simulation

from .conftest import HERE, Peer

FILE = HERE.parent / "drive" / "coils.toml"


@pytest.fixture(autouse=True)
def installed() -> None:
    folder = library.user_folder()
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(FILE, folder)


def raws(line: str, device: int, *codes: str) -> dict[str, int]:
    done = drivepanel("read", line, *codes, "-d", str(device), "-p", "example-coils", "--json")
    assert done.returncode == 0, done.stderr
    return {code: item["raw"] for code, item in json.loads(done.stdout)["values"].items()}


@pytest.mark.parametrize("kind", ["tcp", "rtu"])
def test_libmodbus_server_is_read_written_and_stopped(libmodbus_server: Path, kind: str) -> None:
    with pty_pair() as (near, far):
        command = [str(libmodbus_server), kind, *([far] if kind == "rtu" else [])]
        with served(command, ready="ready") as server:
            tcp = kind == "tcp"
            line = f"tcp:127.0.0.1:{port_of(server.ready)}" if tcp else f"serial:{near},19200,8N1"
            assert raws(line, 2, "STAT", "CTRL", "FAN") == {"STAT": 5, "CTRL": 3, "FAN": 0}
            there = ("-d", "2", "-p", "example-coils")
            done = drivepanel("write", line, "FAN=On", "--arm", *there)
            assert done.returncode == 0, done.stderr
            stopped = drivepanel("stop", line, *there)
            # its inputs say that the motor runs, whatever the coils are
            assert stopped.returncode != 0
            assert raws(line, 2, "STAT", "CTRL", "FAN") == {"STAT": 5, "CTRL": 0, "FAN": 1}


def mbpoll(peer: Peer, port: int, kind: str, address: int, *values: str, count: int = 1) -> str:
    """Read bits, or write the values, of the drive 1; returns what it prints."""
    options = ["-a", "1", "-0", "-1", "-t", kind, "-r", str(address), "-m", "tcp", "-p", str(port)]
    options += [] if values else ["-c", str(count)]
    done = subprocess.run(
        [peer("mbpoll", "mbpoll"), *options, "127.0.0.1", *values],
        capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    return done.stdout + done.stderr


def test_mbpoll_commands_a_simulated_drive(peer: Peer) -> None:
    def bits(kind: str, address: int, count: int) -> list[int]:
        printed = mbpoll(peer, port, kind, address, count=count)
        return [int(bit) for bit in re.findall(r"^\[\d+\]:\s+(\d)", printed, re.MULTILINE)]

    with simulated("--tcp", "127.0.0.1:0", "example-coils@1", "--set", "REF=200") as drive:
        port = port_of(drive.ready)
        assert bits("1", 0, 3) == [0, 0, 0]
        assert "Written 4 references" in mbpoll(peer, port, "0", 1, "1", "1", "0", "0")
        assert (bits("0", 1, 4), bits("1", 0, 2)) == ([1, 1, 0, 0], [1, 0])
        assert "Written 1 references" in mbpoll(peer, port, "0", 16, "1")
        assert bits("0", 16, 1) == [1]
        assert "Illegal data address" in mbpoll(peer, port, "0", 5, "1")
        assert "Illegal data address" in mbpoll(peer, port, "1", 0, count=4)
        assert "Written 4 references" in mbpoll(peer, port, "0", 1, "0", "0", "0", "0")
        assert raws(f"tcp:127.0.0.1:{port}", 1, "CTRL", "FAN") == {"CTRL": 0, "FAN": 1}


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_motor_of_a_program_that_is_ended_is_stopped_by_its_coils(number: signal.Signals) -> None:
    """If it is killed, the keeper of the line stops the motor."""
    simulation = Simulation([DriveSpec("example-coils", 1)])
    simulation.start()
    drive, line = simulation.drive(1), rtu_tcp(simulation)
    wish = ("-d", "1", "-p", "example-coils", "--arm", "--reference", "20Hz", "--for", "50")
    command = [*DRIVEPANEL, "run", line, *wish]
    try:
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as program:
            wait_until(lambda: drive.motor.frequency > 10, "the motor runs")
            assert drive.raw("CTRL") == 1
            os.kill(program.pid, number)
            wait_until(lambda: not drive.motor.energised, "the motor is stopped")
        assert drive.raw("CTRL") == 0
    finally:
        end_keepers()
        simulation.stop()
