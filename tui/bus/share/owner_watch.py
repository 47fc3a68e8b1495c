"""Supervision of the owner of a line by its messages, and the end of an owner that hangs."""

from __future__ import annotations

import logging
import os
import select
import signal
import socket
from collections import deque
from contextlib import suppress

from tui.safety import AWAKE, HEARD_WITHIN, SILENT_OWNER, STOP_HEARD_WITHIN, TAKEN_IN_WITHIN

from ..errors import OWNER_SILENT
from ..master import MonotonicClock
from ..model import Priority
from ..program import KEEPER, pid_namespace
from .messages import VERSION, Alive, AnyMessage, Asking, StopGiven
from .place import Owner, peer_of

log = logging.getLogger(__name__)

OTHER_USER = "It belongs to another user: end it as that user or as root (kill -9 {pid})."
OTHER_CONTAINER = "It runs in another container: end it there."
STAYS = "The system does not end it: plug its adapter in again, or restart the computer."
BY_HAND = "End that program (kill -9 {pid}). Then stops are sent."


class KeeperProcess:
    """A process that was started as a keeper, by a handle that is never reused.

    No other process is killed: not a program that holds the line itself, not one of another
    version.
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
        """Advice on ending it if this program cannot."""
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
        """Close the handle."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


WATCH_INTERVAL = 0.1
"""Seconds between two looks at the owner."""
DIES_WITHIN = 1.0
"""Seconds in which a killed process must end."""


class OwnerWatch:
    """One attachment's look at its owner; lives in the line's loop."""

    def __init__(self, clock: MonotonicClock, owner: Owner) -> None:
        self._clock = clock
        self._owner = owner
        self.frozen = False
        """True while it does not answer."""
        self.remedy = ""
        """Advice on ending it if this program cannot."""
        self._process: KeeperProcess | None = None
        self._killed: float | None = None
        self._looks = 0
        self._stops: deque[float] = deque()
        """When stops were sent that are not acknowledged yet."""
        self.heard = self._looked = self._awake = self._begun = clock()
        """When the owner gave its last sign of life, when this program looked for one last, and
        since when it was awake all the time; and when it began."""

    def connected(self, connection: socket.socket) -> None:
        """There is a connection to the owner."""
        self._process = KeeperProcess(self._owner, connection)

    def close(self) -> None:
        """End the supervision."""
        if self._process is not None:
            self._process.close()

    def note_stop(self) -> None:
        """A stop was sent to the owner."""
        self._stops.append(self._clock())

    def hear(self, message: AnyMessage) -> None:
        """Note a message of the owner."""
        self.heard, self._looks, self._killed = self._clock(), 0, None
        self.frozen, self.remedy = False, ""
        if isinstance(message, Alive) and self._stops:
            self._stops.popleft()

    def look(self, *, attached: bool) -> None:
        """Note if the owner does not answer; kill a keeper that hangs."""
        now = self._clock()
        if now - self._looked > AWAKE:
            self._awake = now
        self._looked = now
        # by looks, too: if this program got no time to look, the owner may be well
        self._looks += 1
        looked = self._looks > SILENT_OWNER / WATCH_INTERVAL
        if not self.frozen and now - self.heard > SILENT_OWNER and looked:
            log.error("%s %s", self._owner.program.text, OWNER_SILENT)
            self.frozen = True
        if self._process is not None and self._hangs(now, attached):
            self._end(self._process, now)

    def _hangs(self, now: float, attached: bool) -> bool:
        """True if it acknowledges nothing, seen by a program that was awake all the time."""
        if now - max(self.heard, self._awake) > HEARD_WITHIN:
            return True
        sent = self._stops[0] if self._stops else now
        if not attached:
            sent = max(sent, self._begun + TAKEN_IN_WITHIN)
        return now - max(sent, self._awake) > STOP_HEARD_WITHIN

    def _end(self, process: KeeperProcess, now: float) -> None:
        """Kill it once; it is dead when its lock is released, and this attachment ends before."""
        dies = True
        if self._killed is None:
            self._killed, dies = now, process.kill()
            done = "was killed" if dies else "cannot be killed"
            log.error("%s hangs and %s", self._owner.program.text, done)
        if not dies or now - self._killed > DIES_WITHIN:
            self.frozen, self.remedy = True, process.remedy


def is_stop(message: AnyMessage) -> bool:
    """True for a message that the owner acknowledges as soon as it has received it."""
    if isinstance(message, Asking):
        return message.priority is Priority.STOP
    return isinstance(message, StopGiven)
