"""Bundles while other programs use the line: with their frames, motor running, read by tshark."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
import zipfile
from pathlib import Path

import pytest

from tests.bus.peer import PtyPeer, silent
from tests.programs import (
    DRIVEPANEL,
    PATIENCE,
    drivepanel,
    own_interrupts,
    rtu_tcp,
    served,
    wait_until,
)
from tui.simulator import DriveSpec, Simulation
from tui.wire.capture.forms import READ_RAW

from .conftest import Peer
from .test_commands import turns


def unzipped(file: Path, folder: Path) -> Path:
    """The folder of a bundle."""
    with zipfile.ZipFile(file) as opened:
        opened.extractall(folder)
    (found,) = folder.iterdir()
    return found


def bundle(line: str, file: Path, *words: str) -> None:
    done = drivepanel("bundle", line, "--output", str(file), *words)
    assert done.returncode == 0, done.stderr


def fields(tshark: str, capture: Path, *names: str) -> list[list[str]]:
    """Fields of each packet as tshark decodes it."""
    words = [part for name in names for part in ("-e", name)]
    done = subprocess.run(
        [tshark, "-r", str(capture), "-T", "fields", *words],
        capture_output=True, text=True, check=True, timeout=PATIENCE,
    )  # fmt: skip
    return [line.split("\t") for line in done.stdout.splitlines()]


def test_tshark_reads_earlier_frames_of_another_program(peer: Peer, tmp_path: Path) -> None:
    tshark = peer("tshark", "tshark")
    with Simulation([DriveSpec("atv71", 1)]) as simulation:
        line = rtu_tcp(simulation)
        watch = [*DRIVEPANEL, "watch", line, "RFR", "LCR", "--every", "0.2", "--json"]
        with served(watch, ready='"good"'):
            begun = time.time()
            bundle(line, tmp_path / "a.zip", "-d", "1")
        found = unzipped(tmp_path / "a.zip", tmp_path / "x")
    packets = fields(tshark, found / "frames.pcapng", "frame.time_epoch", "mbtcp.unit_id")
    assert {unit for _, unit in packets} == {"1"}
    assert float(packets[0][0]) < begun < float(packets[-1][0])
    command = READ_RAW.replace("FILE", str(found / "frames.raw.pcapng"))
    done = subprocess.run(
        command, shell=True, capture_output=True, text=True, check=True, timeout=PATIENCE
    )
    assert "Modbus RTU" in done.stdout
    assert "checksum incorrect" not in done.stdout.lower()
    programs = json.loads((found / "line.json").read_text())["programs"]
    assert {"watch", "bundle", "keeper"} == {program["program"] for program in programs}


def test_bundle_writes_nothing_and_keeps_the_motor_running(tmp_path: Path) -> None:
    with Simulation([DriveSpec("atv71", 1)]) as simulation:
        writes: list[bytes] = []
        side = simulation.drive(1).line_side
        honest = side.answer

        def answer(address: int, pdu: bytes) -> bytes | None:
            if pdu[0] in (5, 6, 15, 16, 22, 23):
                writes.append(pdu)
            return honest(address, pdu)

        side.answer = answer  # type: ignore[method-assign]
        line = rtu_tcp(simulation)
        run = [*DRIVEPANEL, "run", line, "--reference", "20Hz", "--arm", "-p", "atv71"]
        with served(run):
            wait_until(lambda: turns(simulation), "the motor runs")
            before = len(writes)
            bundle(line, tmp_path / "a.zip", "-d", "1")
            assert turns(simulation)
            assert simulation.drive(1).fault is None
            assert len(writes) == before
        found = unzipped(tmp_path / "a.zip", tmp_path / "x")
        assert (found / "drive-1" / "settings.toml").exists()


@pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here")
def test_ctrl_c_leaves_no_file(tmp_path: Path) -> None:
    file = tmp_path / "a.zip"
    with PtyPeer(silent) as silence:
        words = ["bundle", silence.path, "-d", "1", "-d", "2", "--output", str(file)]
        with subprocess.Popen(
            [*DRIVEPANEL, *words], stderr=subprocess.PIPE, text=True, preexec_fn=own_interrupts
        ) as program:
            wait_until(lambda: bool(silence.requests), "the drive is requested")
            program.send_signal(signal.SIGINT)
            _, output = program.communicate(timeout=PATIENCE)
    assert program.returncode == 130, output
    assert "Traceback" not in output
    assert [path.name for path in tmp_path.iterdir() if "zip" in path.name] == []
