"""Starting the keeper of a line, from whatever program needs the line first."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import msgspec

from .keeping import KeeperOrder

MODULE = "tui.keeper"
"""Started by its name: it stands above the bus, which does not import it."""
NO_KEEPER = "DRIVEPANEL_NO_KEEPER"
"""Set by tests: a program that opens a line first holds it itself, as where no process can."""

PATHS = ("DRIVEPANEL_STATE", "DRIVEPANEL_CONFIG", "DRIVEPANEL_SHARE_FOLDER", "XDG_RUNTIME_DIR")
"""Environment variables that may hold a path which counts from the folder of this program."""

_STARTED: list[subprocess.Popen[bytes]] = []
"""Keepers that were started here and may live; one that has ended is let go with the next."""


def can_start() -> bool:
    """True if this program can start a process of Python; one that embeds Python cannot."""
    python = os.path.basename(sys.executable or "").startswith(("python", "pypy"))
    return os.name == "posix" and python and not os.environ.get(NO_KEEPER)


def start_keeper(
    order: KeeperOrder, lock: int, started: Callable[[int], None]
) -> Callable[[], bool]:
    """Start a process that holds the line; returns whether it lives.

    It inherits nothing but the lock: no terminal, no output, no folder. `started` is called with
    its id before it does anything. Raises OSError.
    """
    _STARTED[:] = [one for one in _STARTED if one.poll() is None]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", MODULE, str(lock)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        cwd="/",
        env=_environment(),
        start_new_session=True,
        pass_fds=(lock,),
    )
    _STARTED.append(process)
    assert process.stdin is not None
    try:
        started(process.pid)
        with process.stdin:
            process.stdin.write(msgspec.json.encode(order))
    except OSError:
        process.kill()
        process.wait()
        raise
    return lambda: process.poll() is None


def _environment() -> dict[str, str]:
    """This program's, and where this package is found if Python does not look there by itself."""
    environment = dict(os.environ)
    for name in PATHS:
        if environment.get(name):
            environment[name] = os.path.abspath(environment[name])
    root = str(Path(__file__).parents[3])
    others = environment.get("PYTHONPATH", "")
    if "site-packages" not in root and "dist-packages" not in root:
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, (others, root)))
    return environment
