"""Stops while the disk with the state folder blocks reads and writes."""

from __future__ import annotations

import subprocess
import sys

from tests.limits import STOP_DISK_WITHIN
from tests.programs import PATIENCE, rtu_tcp
from tui.cli.running.stop_targets import REMEMBERED_WITHIN
from tui.cli.short_stop import _SENT_WITHIN
from tui.session.connect.share_place import share_place
from tui.simulator import DriveSpec, Simulation

WITH_STALLED_DISK = """
import os, sys, threading
events = {"open", "os.mkdir", "os.rename", "os.remove", "os.listdir", "os.scandir", "os.chmod"}
folder = os.environ["DRIVEPANEL_STATE"]
def stall(event, args):
    if event in events and str(args[0]).startswith(folder):
        threading.Event().wait()
sys.addaudithook(stall)
sys.argv = ["drivepanel", *sys.argv[1:]]
from tui.__main__ import main
main()
"""
"""The program; whatever it does with a file in the state folder hangs."""


def test_stop_after_a_killed_keeper_does_not_wait_for_the_disk() -> None:
    with Simulation([DriveSpec("atv71", 2, run_hz=30.0)]) as simulation:
        line = rtu_tcp(simulation)
        place = share_place(line)
        assert place is not None
        place.lock_path.parent.mkdir(parents=True, exist_ok=True)
        place.lock_path.touch()  # the keeper has left it
        command = [sys.executable, "-c", WITH_STALLED_DISK, "stop", line, "-d", "2"]
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
        assert "Device 2, Altivar 71: stopped." in done.stdout
        assert done.returncode == 0
        assert simulation.drive(2).motor.frequency == 0


def test_hung_disk_delays_a_stop_for_less_than_2_s() -> None:
    assert _SENT_WITHIN + STOP_DISK_WITHIN + REMEMBERED_WITHIN < 2.0
