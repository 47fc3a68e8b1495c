"""Check if a program of this computer still runs, even if its process id was reused."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

ENDED = frozenset("ZXx")
"""States of a process that has ended, but whose exit status was not read yet."""
PS_PATIENCE = 5.0
"""Seconds for `ps`, where there is no /proc."""
_STATE, _START = 0, 19
"""Fields 3 and 22 of /proc/PID/stat, counted after the name, which may contain spaces."""


class Processes:
    """Processes of this computer, identified by number and start time.

    From /proc, else from `ps`. On Windows nothing is known, and all count as running.
    """

    def __init__(self, proc: Path = Path("/proc")) -> None:
        self._proc = proc

    def boot_id(self) -> str:
        """Return an id of this run of the computer; empty if it is not known.

        Without it, the start time still distinguishes programs.
        """
        try:
            return (self._proc / "sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        except (OSError, ValueError):
            return ""

    def started(self, pid: int) -> str | None:
        """Return the start time of a process, only for comparison; empty if unknown, None if it
        ended."""
        if os.name != "posix":
            return ""
        if not (self._proc / "self").exists():
            return _by_ps(pid)
        try:
            stat = (self._proc / str(pid) / "stat").read_bytes()
        except (FileNotFoundError, ProcessLookupError):
            return "" if _is_hidden(pid) else None
        except OSError:
            return ""
        fields = stat.rpartition(b")")[2].decode("ascii", errors="replace").split()
        if len(fields) <= _START:
            return ""
        return None if fields[_STATE] in ENDED else fields[_START]

    def is_same_boot(self, boot_id: str) -> bool:
        """Return False if the computer was restarted since; True if that is unknown."""
        here = self.boot_id()
        return not (boot_id and here) or boot_id == here

    def lives(self, boot_id: str, pid: int, started: str) -> bool:
        """Return True if the recorded program still runs; if in doubt, True."""
        if not self.is_same_boot(boot_id):
            return False
        now = self.started(pid)
        return now is not None and (not now or not started or now == started)


def _is_hidden(pid: int) -> bool:
    """Return True if /proc hides a running program of another user (hidepid)."""
    try:
        os.kill(pid, 0)  # signal 0 only checks if the process exists
    except PermissionError:
        return True
    except (OSError, OverflowError):
        return False
    return False  # it belonged to this user, and ended in the meantime


def _by_ps(pid: int) -> str | None:
    command = ["ps", "-o", "stat=", "-o", "lstart=", "-p", str(pid)]
    surroundings = {**os.environ, "LC_ALL": "C", "TZ": "UTC"}
    try:
        answer = subprocess.run(
            command, capture_output=True, text=True, env=surroundings, timeout=PS_PATIENCE
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    state, _, started = answer.stdout.strip().partition(" ")
    return None if not state or state[0] in ENDED else " ".join(started.split())
