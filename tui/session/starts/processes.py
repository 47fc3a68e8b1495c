"""True if a program of this machine still lives, also where its number was given to another."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

ENDED = frozenset("ZXx")
"""States of a process that runs no more, though nobody has fetched its exit status yet."""
PS_PATIENCE = 5.0
"""Seconds for `ps`, where there is no /proc."""
_STATE, _START = 0, 19
"""Fields 3 and 22 of /proc/PID/stat, counted behind the name, which may hold spaces."""


class Processes:
    """The programs of this machine, by number and by when they were started.

    From /proc; where there is none from `ps`. On Windows nothing is known: all count as living.
    """

    def __init__(self, proc: Path = Path("/proc")) -> None:
        self._proc = proc

    def boot_id(self) -> str:
        """Return an id of this run of the computer; empty if it is not known.

        Without it a program's start still distinguishes them.
        """
        try:
            return (self._proc / "sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        except (OSError, ValueError):
            return ""

    def started(self, pid: int) -> str | None:
        """When a program was started, comparable only; empty if unknown, None if it ended."""
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
        """False if the computer was started since; True where it does not say."""
        here = self.boot_id()
        return not (boot_id and here) or boot_id == here

    def lives(self, boot_id: str, pid: int, started: str) -> bool:
        """Return True if the program still lives that was noted so; in doubt it does."""
        if not self.is_same_boot(boot_id):
            return False
        now = self.started(pid)
        return now is not None and (not now or not started or now == started)


def _is_hidden(pid: int) -> bool:
    """Return True if a program of another user runs that /proc does not show to this one
    (hidepid)."""
    try:
        os.kill(pid, 0)  # no signal: it asks whether there is such a program
    except PermissionError:
        return True
    except (OSError, OverflowError):
        return False
    return False  # it is this user's, and ended meanwhile


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
