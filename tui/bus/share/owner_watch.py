"""Whether the owner of a line lives, by what a client hears of it, and what is done if it hangs."""

from __future__ import annotations

import logging
import socket
from collections import deque

from ..errors import OWNER_SILENT
from ..master import MonotonicClock
from ..model import Priority
from .keeper_process import KeeperProcess
from .messages import Alive, AnyMessage, Asking, StopGiven
from .place import Owner

log = logging.getLogger(__name__)

WATCH_INTERVAL = 0.1
"""Seconds between two looks at the owner."""
AWAKE = 0.3
"""Seconds between two looks in which this program was awake all the time."""
SILENT_OWNER = 1.0
"""Seconds without a sign of life after which an owner counts as frozen."""
TAKEN_IN_WITHIN = 1.0
"""Seconds that a keeper which lives takes for the answer to a greeting."""
STOP_HEARD_WITHIN = 1.0
"""Seconds in which a keeper that lives acknowledges a stop."""
HEARD_WITHIN = 3.0
"""Seconds in which a keeper that lives says anything; it does so several times a second."""
DIES_WITHIN = 1.0
"""Seconds that a process has to end once it is killed."""


class OwnerWatch:
    """One attachment's look at its owner; lives in the line's loop."""

    def __init__(self, clock: MonotonicClock, owner: Owner) -> None:
        self._clock = clock
        self._owner = owner
        self.frozen = False
        """True while it does not answer."""
        self.remedy = ""
        """Who can end it if this program cannot, for a person."""
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
        """Watch no more."""
        if self._process is not None:
            self._process.close()

    def note_stop(self) -> None:
        """A stop was sent to the owner."""
        self._stops.append(self._clock())

    def hear(self, message: AnyMessage) -> None:
        """The owner said something: it lives."""
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
