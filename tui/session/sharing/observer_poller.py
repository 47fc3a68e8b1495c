"""When a drive may be asked by who only looks on, for hours, without a person before it.

Each request keeps the drive's communication timeout from running out: kept polled, the motor of a
commander that has died would run for ever.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from tui.drive.settings.writable import AT_REST
from tui.safety import GRACE_SHARE

from ..clock import REAL_CLOCK
from ..drive import DriveSession

if TYPE_CHECKING:
    from ..monitor.snapshot import Snapshot

COMMANDER_SILENT = "Not polled: the program that started its motor gives no heartbeat."
UNKNOWN_TIMEOUT_ACTED = 60.0
"""Seconds of silence after which a drive has reacted that does not report its timeout."""
ACTED_AFTER = 1.0
"""Seconds beyond its timeout after which a drive has begun to act."""


class ObserverPoller:
    """Looks on at one drive, and keeps no motor running whose commander has died.

    `sign` is the time of the last heartbeat of the program that started its motor (monotonic), or
    None if there was none. The drive is polled once for each such heartbeat, and for a quarter of
    its timeout after it, until its motor was seen at standstill; one that was silent for longer
    than its timeout has acted: it is looked at once.
    """

    def __init__(
        self,
        session: DriveSession,
        sign: Callable[[], float | None],
        latest: Callable[[], Snapshot | None],
        now: Callable[[], float] = REAL_CLOCK.monotonic,
    ) -> None:
        self.orphan = False
        """True if a program that has ended started the motor, and it was not seen at standstill."""
        self.waits = False
        """True if the drive was left alone when it was to be asked last."""
        self._session = session
        self._sign = sign
        self._latest = latest
        self._now = now
        self._requested = now()

    def freely(self) -> bool:
        """Return True if it may be asked at any time: nobody is known to have started its motor."""
        return self._sign() is None and not self.orphan

    def held_back(self) -> str:
        """Why the drive must not be asked now, or nothing: then it counts as asked."""
        self.waits = not self._may_ask()
        if self.waits:
            return COMMANDER_SILENT
        self._requested = self._now()
        return ""

    def _may_ask(self) -> bool:
        sign = self._sign()
        if sign is None and not self.orphan:
            return True
        sign = -math.inf if sign is None else sign
        if sign >= self._requested or self._stands(sign):
            return True
        timeout = self._timeout()
        if timeout is None:
            return self._silence() > UNKNOWN_TIMEOUT_ACTED
        if timeout == 0 or self._now() - sign <= GRACE_SHARE * timeout:
            return True
        return self._silence() > timeout + ACTED_AFTER

    def _stands(self, since: float) -> bool:
        """Return True if it was at standstill at the last check, and got no command since."""
        seen = self._latest()
        if seen is None or seen.error or seen.time < since:
            return False
        stands = seen.state.motion in AT_REST
        self.orphan = self.orphan and not stands
        return stands

    def _silence(self) -> float:
        heard = self._session.line.device_state(self._session.device).heard
        return self._now() - (heard if heard is not None else self._requested)

    def _timeout(self) -> float | None:
        """The drive's communication timeout in seconds, 0 for one that has none; None: unknown."""
        reported = self._session.timeout
        if reported is None or not reported.known:
            return None
        return reported.watch.timeout if reported.watch is not None else 0.0
