"""Keepers that hang: they end themselves, or are ended by a program on the line."""

from __future__ import annotations

import os
import signal
import subprocess
import time

from tests.programs import DRIVEPANEL, PATIENCE, is_running, wait_until
from tui.bus.share.keeper_share import ALARM_AFTER

from .test_commands import bench
from .test_keeper import keeper


def test_a_keeper_that_was_frozen_ends_itself_when_it_goes_on() -> None:
    with bench() as (_, line):
        # also where the program that starts it ignores the alarm
        ignoring = ("sh", "-c", "trap '' ALRM; exec \"$@\"", "sh", *DRIVEPANEL)
        command = [*ignoring, "read", line, "ETA", "-d", "1", "-p", "atv71"]
        subprocess.run(command, timeout=PATIENCE, check=True)
        pid = keeper()
        os.kill(pid, signal.SIGSTOP)
        time.sleep(ALARM_AFTER + 0.5)
        assert is_running(pid), "a process that is stopped takes no alarm"
        os.kill(pid, signal.SIGCONT)
        wait_until(lambda: not is_running(pid), "it ends")
