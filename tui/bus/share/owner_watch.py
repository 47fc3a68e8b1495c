"""Whether the owner of a line lives, by what a client hears of it, and what is done if it hangs."""

from __future__ import annotations

import logging
import socket
from collections import deque

from ..model import Priority
from ..schedule.inside import LineInside
from .keeper_process import KeeperProcess
from .lease import SILENT_OWNER
from .messages import Alive, AnyMessage, Asking, StopGiven
from .past_owner import PastOwner
from .place import Owner

log = logging.getLogger(__name__)

WATCH_INTERVAL = 0.1
"""Seconds between two looks at the owner."""
AWAKE = 0.3
"""Seconds between two looks in which this program was awake all the time."""
STOP_HEARD_WITHIN = 1.0
"""Seconds in which a keeper that lives acknowledges a stop."""
HEARD_WITHIN = 3.0
"""Seconds in which a keeper that lives says anything; it does so several times a second."""
DIES_WITHIN = 1.0
"""Seconds that a process has to end once it is killed."""


class OwnerWatch:
    """One attachment's look at its owner; lives in the line's loop."""

    def __init__(self, inside: LineInside, owner: Owner, past: PastOwner) -> None:
        self._clock = inside.clock
        self._owner = owner
        self._past = past
        self._process: KeeperProcess | None = None
        self._killed: float | None = None
        self._stays = False
        """True if it could not be killed."""
        self._looks = 0
        self._stops: deque[float] = deque()
        """When stops were sent that are not acknowledged yet."""
        self.heard = self._looked = self._awake = inside.clock()
        """When the owner gave its last sign of life, when this program looked for one last, and
        since when it was awake all the time."""

    def connected(self, connection: socket.socket) -> None:
        """There is a connection to the owner."""
        self._process = KeeperProcess(self._owner, connection)

    def close(self) -> None:
        """Watch no more."""
        if self._process is not None:
            self._process.close()

    def note_stop(self) -> None:
        """A stop was sent to the owner."""
        self._stops.append(self._clock())

    def hear(self, message: AnyMessage) -> None:
        """The owner said something: it lives."""
        self.heard, self._looks, self._killed = self._clock(), 0, None
        if isinstance(message, Alive) and self._stops:
            self._stops.popleft()

    @property
    def silence(self) -> float:
        """Seconds since it has said anything."""
        return self._clock() - self.heard

    def look(self, *, attached: bool) -> None:
        """Let stops go past an owner that does not answer; kill a keeper that hangs."""
        now = self._clock()
        if now - self._looked > AWAKE:
            self._awake = now
        self._looked = now
        # by looks, too: if this program got no time to look, the owner may be well
        self._looks += 1
        looked = self._looks > SILENT_OWNER / WATCH_INTERVAL
        if not self._past.at_work and self.silence > SILENT_OWNER and looked:
            log.error("%s owns the line and does not answer", self._owner.program.text)
            self._past.begin()
        if self._process is not None and self._process.is_keeper and self._hangs(now, attached):
            self._end(self._process, now)

    def _hangs(self, now: float, attached: bool) -> bool:
        """True if it acknowledges nothing, seen by a program that was awake all the time."""
        if now - max(self.heard, self._awake) > HEARD_WITHIN:
            return True
        sent = self._stops[0] if attached and self._stops else now
        return now - max(sent, self._awake) > STOP_HEARD_WITHIN

    def _end(self, process: KeeperProcess, now: float) -> None:
        """Kill it once; it is dead when its lock is released, and this attachment ends before."""
        if self._killed is None:
            self._killed, self._stays = now, not process.kill()
            done = "cannot be killed" if self._stays else "was killed"
            log.error("%s hangs and %s", self._owner.program.text, done)
        if self._stays or now - self._killed > DIES_WITHIN:
            self._past.owner_stays(process.remedy)


def is_stop(message: AnyMessage) -> bool:
    """True for a message that the owner acknowledges as soon as it has received it."""
    if isinstance(message, Asking):
        return message.priority is Priority.STOP
    return isinstance(message, StopGiven)
