"""A ghost of a recorded drive shows what the drive showed: status, read, Monitor."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from itertools import chain, pairwise
from pathlib import Path

import pytest

from tests.programs import (
    DRIVEPANEL,
    drivepanel,
    end_keepers,
    port_of,
    served,
    simulated,
    wait_until,
)

from .terminal import A_MOMENT, Terminal

Start = Callable[[list[str]], Terminal]
COMMANDS = (
    ("status",),
    ("identify",),
    ("read", "ETA", "RFR", "ULN", "ACC"),
    ("read", "NOSUCH"),
)
RECORDED_DRIVE = ("atv71@2", "--set", "ULN=2300", "--set", "THR=20", "--set", "OTR=0")
"""A drive at standstill whose measured values do not change by themselves."""
SHOWN = ("STANDBY", "Speed", "Modbus", "switch on disabled", "Alarms")
TIMES = re.compile(r"\d+/\d+ in \d+ s|\d\d:\d\d:\d\d|\d+(\.\d+)? m?s\b")
DRAWN = re.compile(r"[^\w .,#%:=●-]+|\s{2,}")


@pytest.fixture(autouse=True)
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs of these tests record."""
    monkeypatch.delenv("DRIVEPANEL_RECORD")


def outputs(line: str) -> list[tuple[int, str, str]]:
    """Exit status and output of each command on a line."""
    done = [drivepanel(name, line, "-d", "2", *codes) for name, *codes in COMMANDS]
    return [(item.returncode, item.stdout, item.stderr) for item in done]


def texts(terminal: Terminal) -> list[str]:
    """The texts of Monitor from top to bottom, without times and drawings."""
    plain = TIMES.sub("", terminal.text().partition("Scan done")[0])
    return [part.strip() for part in DRAWN.split(plain) if part.strip()]


def monitor(start: Start, line: str) -> Terminal:
    terminal = start([sys.executable, "-m", "tui", line, "-d", "2"])
    terminal.wait_for(*SHOWN)
    return terminal


def test_ghost_shows_what_the_drive_showed(
    terminal_with: Start, second_terminal: Start, tmp_path: Path
) -> None:
    link = str(tmp_path / "line")
    line = f"serial:{link}"
    with simulated(*RECORDED_DRIVE, "--pty", link):
        first = outputs(line)
        terminal = monitor(terminal_with, line)
        time.sleep(A_MOMENT)
        shown = texts(terminal)
        terminal.run("kill-server")
    end_keepers()
    (found,) = Path(os.environ["DRIVEPANEL_STATE"], "record").glob("*.sqlite")
    record = tmp_path / "kept.sqlite"
    shutil.copy(found, record)
    with simulated("--from", f"{record}@2", "--pty", link) as ghost:
        assert "Altivar 71" in ghost.ready
        assert outputs(line) == first
        again = monitor(second_terminal, line)
        wait_until(lambda: texts(again) == shown, f"{shown} on the ghost")
    end_keepers()


def last_faults(line: str) -> Generator[int]:
    """Raw values of the last fault, one a cycle, until the caller has seen enough."""
    options = ("-d", "2", "-p", "atv71", "--every", "0.3", "--json")
    with served([*DRIVEPANEL, "watch", line, *options, "LFT"], ready='"values"') as watch:
        assert watch.process.stdout is not None
        for row in chain([watch.ready], watch.process.stdout):
            if "values" in (document := json.loads(row)):
                yield int(document["values"]["LFT"]["raw"])


def test_ghost_trips_as_the_drive_did(tmp_path: Path) -> None:
    link = str(tmp_path / "line")
    line = f"serial:{link}"
    with simulated("atv71@2", "--run", "30", "--pty", link, stdin=subprocess.PIPE) as drive:
        typed = drive.process.stdin
        assert typed is not None
        faults = last_faults(line)
        before = next(faults)
        typed.write("in 3s: 2: trip OCF\n")  # time for a ghost whose client starts slowly
        typed.flush()
        after = next(raw for raw in faults if raw != before)
        assert {next(faults) for _ in range(10)} == {after}  # long enough for a slow client
        faults.close()
    end_keepers()
    (record,) = Path(os.environ["DRIVEPANEL_STATE"], "record").glob("*.sqlite")
    with simulated("--from", f"{record}@2", "--tcp", "127.0.0.1:0") as ghost:
        faults = last_faults(f"tcp:127.0.0.1:{port_of(ghost.ready)}")
        # the record begins again if the client has missed the trip
        assert (before, after) in pairwise(faults)
        faults.close()
    end_keepers()
