"""The process of a line's keeper, and its end by a program on the line if it hangs."""

from __future__ import annotations

import os
import select
import signal
import socket
from contextlib import suppress

from ..program import KEEPER, pid_namespace
from .messages import VERSION
from .place import Owner, peer_of

OTHER_USER = "It belongs to another user: end it as that user or as root (kill -9 {pid})."
OTHER_CONTAINER = "It runs in another container: end it there."
STAYS = "The system does not end it: plug its adapter in again, or restart the computer."
BY_HAND = "End that program (kill -9 {pid}). Then stops are sent."


class KeeperProcess:
    """A process that was started as a keeper, by a handle that no other process ever gets.

    Nothing else is killed: not a program that holds the line itself, not one of another version.
    """

    def __init__(self, owner: Owner, connection: socket.socket) -> None:
        """`connection` leads to the owner that the lock file names."""
        self._pid = owner.program.pid
        self._handle: int | None = None
        known = owner.program.name == KEEPER and owner.version == VERSION
        peer = peer_of(connection)
        # a number of another PID namespace may be that of any process here
        inside = owner.program.process[0] == pid_namespace() and (peer is None or peer.pid != 0)
        self._remedy = BY_HAND if inside else OTHER_CONTAINER
        if inside and peer is not None and peer.pid != self._pid:
            # the lock file is behind: what hangs is at the other end
            self._pid, known = peer.pid, False
        if known and inside and peer is not None and self._pid != os.getpid():
            self._open(connection)

    def _open(self, connection: socket.socket) -> None:
        with suppress(OSError, AttributeError):  # a system without handles
            self._handle = os.pidfd_open(self._pid)
        # an end that is open yet: the number was not given to another process since
        ended = select.poll()
        ended.register(connection, 0)
        if ended.poll(0):
            self.close()

    @property
    def remedy(self) -> str:
        """Who can end it if this program cannot, for a person."""
        return self._remedy.format(pid=self._pid)

    def kill(self) -> bool:
        """End it; False if this program cannot. It is dead once its lock is released."""
        if self._handle is None:
            return False
        try:
            signal.pidfd_send_signal(self._handle, signal.SIGKILL)
        except ProcessLookupError:
            pass  # another program was quicker
        except PermissionError:
            self._remedy = OTHER_USER
            return False
        except OSError:
            return False
        self._remedy = STAYS
        return True

    def close(self) -> None:
        """Let go of the handle."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
