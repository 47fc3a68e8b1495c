"""When a program that only observes may poll a drive, unattended and for hours.

Each request restarts the drive's communication timeout. So a motor whose commander has died would
run forever if its drive were polled all the time.
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
"""Seconds without a request after which a drive with an unknown timeout has reacted."""
ACTED_AFTER = 1.0
"""Seconds after its timeout in which a drive begins to react."""


class ObserverPoller:
    """Decides when to poll one drive, so that no motor whose commander has died keeps running.

    `sign` returns the time of the last heartbeat of the program that started the motor
    (monotonic), or None if there was none. Until the motor is seen at standstill, the drive is
    polled only after a heartbeat, for a quarter of its timeout. After silence for longer than its
    timeout the drive has reacted, and is polled again.
    """

    def __init__(
        self,
        session: DriveSession,
        sign: Callable[[], float | None],
        latest: Callable[[], Snapshot | None],
        now: Callable[[], float] = REAL_CLOCK.monotonic,
    ) -> None:
        self.orphan = False
        """True if the motor was started by a program that has ended, and not yet seen stopped."""
        self.waits = False
        """True if the drive was not polled when its last poll was due."""
        self._session = session
        self._sign = sign
        self._latest = latest
        self._now = now
        self._requested = now()

    def freely(self) -> bool:
        """Return True if it may be polled at any time: no program has started its motor."""
        return self._sign() is None and not self.orphan

    def pause_reason(self) -> str:
        """Return why the drive must not be polled now; if empty, it counts as polled."""
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
        """Return the drive's communication timeout in seconds; 0 for none, None if not known."""
        reported = self._session.timeout
        if reported is None or not reported.known:
            return None
        return reported.watch.timeout if reported.watch is not None else 0.0
