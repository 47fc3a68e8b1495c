"""The start of a line's keeper, from whatever program needs the line first, and its end."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep

import msgspec

from ..bounds import Number, Text
from ..program import KEEPER, Program
from .messages import LENGTH, VERSION, Goodbye, packed
from .place import Owner, OwnerLock, SharePlace, reached

MODULE = "tui.keeper"
"""Started by its name: it belongs above the bus, which does not import it."""
NO_KEEPER = "DRIVEPANEL_NO_KEEPER"
"""Set by tests: the first program holds the line itself, as on systems that cannot start one."""

PATHS = ("DRIVEPANEL_STATE", "DRIVEPANEL_CONFIG", "DRIVEPANEL_SHARE_FOLDER", "XDG_RUNTIME_DIR")
"""Environment variables that may hold a path which counts from the folder of this program."""

MAKES_WAY_WITHIN = 1.0
"""Seconds in which a keeper without clients must end when requested."""
LOCK_INTERVAL = 0.01

_STARTED: list[subprocess.Popen[bytes]] = []
"""Keepers that this program has started; one that has ended is removed at the next start."""


class KeeperOrder(msgspec.Struct, frozen=True):
    """The line that a new keeper is to hold."""

    line: Text
    """The line, as tui.bus.link.label writes it."""
    key: Text
    lock_folder: Text
    socket_folders: tuple[Text, ...]
    group: int | None
    before: tuple[Program, ...] = ()
    """Programs on the line so far; one that does not attach counts as exited."""
    version: Number = VERSION
    """Of the messages of the program that starts it."""

    @classmethod
    def of(cls, place: SharePlace, line: str, before: tuple[Program, ...]) -> KeeperOrder:
        """The order for a line that meets at a place."""
        folders = tuple(str(folder.absolute()) for folder in place.socket_folders)
        locks = str(place.lock_folder.absolute())
        return cls(line, place.key, locks, folders, place.group, before)

    @property
    def place(self) -> SharePlace:
        """The meeting place of the line."""
        folders = tuple(Path(folder) for folder in self.socket_folders)
        return SharePlace(self.key, Path(self.lock_folder), folders, self.group)


def ends_unneeded(owner: Owner, lock: OwnerLock) -> bool:
    """Request the end of a keeper, and take its lock; False if it serves a program.

    Waits MAKES_WAY_WITHIN seconds at most; for a program that needs the line alone. Raises OSError.
    """
    if owner.program.name != KEEPER:
        return False
    with suppress(OSError), reached(Path(owner.socket), MAKES_WAY_WITHIN) as connection:
        connection.sendall(packed(Goodbye()))
        while connection.recv(LENGTH):
            pass
    end = monotonic() + MAKES_WAY_WITHIN
    while not (taken := lock.take()) and monotonic() < end:
        sleep(LOCK_INTERVAL)
    return taken


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
    _STARTED[:] = [item for item in _STARTED if item.poll() is None]
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
    """This program's environment, with the path of this package if Python does not find it."""
    environment = dict(os.environ)
    for name in PATHS:
        if environment.get(name):
            environment[name] = os.path.abspath(environment[name])
    root = str(Path(__file__).parents[3])
    others = environment.get("PYTHONPATH", "")
    if "site-packages" not in root and "dist-packages" not in root:
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, (others, root)))
    return environment
