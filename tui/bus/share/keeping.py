"""The order with which a keeper is started, and the request that it end."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep

import msgspec

from ..bounds import Number, Text
from ..program import KEEPER, Program
from .messages import LENGTH, VERSION, Goodbye, packed
from .place import Owner, OwnerLock, SharePlace, reached


class KeeperOrder(msgspec.Struct, frozen=True):
    """The line that a new keeper is to hold."""

    line: Text
    """The line, as tui.bus.link.label writes it."""
    key: Text
    lock_folder: Text
    socket_folders: tuple[Text, ...]
    group: int | None
    before: tuple[Program, ...] = ()
    """Programs on the line until now; one that does not come back is gone."""
    version: Number = VERSION
    """Of the messages of the program that starts it."""

    @classmethod
    def of(cls, place: SharePlace, line: str, before: tuple[Program, ...]) -> KeeperOrder:
        """The order for a line that meets at a place."""
        folders = tuple(str(one.absolute()) for one in place.socket_folders)
        locks = str(place.lock_folder.absolute())
        return cls(line, place.key, locks, folders, place.group, before)

    @property
    def place(self) -> SharePlace:
        """The meeting place of the line."""
        folders = tuple(Path(one) for one in self.socket_folders)
        return SharePlace(self.key, Path(self.lock_folder), folders, self.group)


MAKES_WAY_WITHIN = 1.0
"""Seconds that a keeper which serves nobody has to end when it is asked to."""
LOCK_INTERVAL = 0.01


def ends_unneeded(owner: Owner, lock: OwnerLock) -> bool:
    """Ask a keeper to end, and take its lock; False if it serves a program. Raises OSError.

    Waits MAKES_WAY_WITHIN seconds at most; for a program that needs the line to itself.
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
