"""Stops in progress, and a check from another thread that the first frame of each is sent."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from tui.bus.api import LineStatus, LineWorker
from tui.bus.model import Timing
from tui.drive.profile.schema import OrderId
from tui.safety import HANGS_AFTER, STOP_REPEATED_EVERY

from ..carry_on import carried_on
from ..drive import DriveSession
from .motor_stop import STANDSTILL_POLL_INTERVAL, MotorStop

FIRST_FRAME_EACH = 0.3
"""Seconds that the first frame of each of several stops may take, on the slowest line."""
SLOWEST_READS = 6
"""Timeouts after which a drive that does not answer must have been sent its stop word."""

SendLast = Callable[[DriveSession, float, Exception], None]


@dataclass(frozen=True, slots=True)
class UnderWay:
    """A stop in progress."""

    stop: MotorStop
    worker: LineWorker
    times: int
    """Number of times that the drive had been armed at its start."""

    def is_lost(self, begins_late: bool, is_late: bool) -> bool:
        """Return True if it was not sent, and has ended or is too late."""
        stop = self.stop
        if stop.sent or stop.over:
            return False
        connected = stop.session.line.state.status is LineStatus.CONNECTED
        return self.worker.done() or is_late or (begins_late and connected and not stop.begun)

    def goes_out(self, session: DriveSession, order: OrderId) -> bool:
        """Return True if another stop of the drive would add nothing.

        Its words still wait to be sent, and the drive was not armed since, so nothing was written.
        """
        same = self.stop.session is session and self.stop.wanted == order
        waits = not self.worker.done() and not self.stop.sent
        return same and waits and self.times == session.arming.times


def watch_first_frames(begun: Sequence[UnderWay], timing: Timing, send_last: SendLast) -> None:
    """Check in a separate thread that the first frame of each stop is sent.

    An error in the line's loop ends a stop silently; then its prepared frames are sent.
    """
    if not begun:
        return
    longest = timing.first_timeout
    hangs_at = time.monotonic() + HANGS_AFTER
    begin_by = time.monotonic() + longest
    send_by = begin_by + SLOWEST_READS * longest + FIRST_FRAME_EACH * len(begun)

    def watch() -> None:
        left = list(begun)
        given: list[UnderWay] = []
        direct_at = hangs_at
        while left:
            time.sleep(STANDSTILL_POLL_INTERVAL)
            now = time.monotonic()
            if now > direct_at:
                direct_at = now + STOP_REPEATED_EVERY
                hanging = [work for work in left if not work.stop.begun or now > begin_by]
                carried_on(partial(_stop_directly, [o for o in hanging if o not in given], given))
            for work in [each for each in left if each.is_lost(now > begin_by, now > send_by)]:
                error = TimeoutError("its frame was not sent in time")
                send_last(work.stop.session, work.stop.ordered, error)
                left.remove(work)
            left = [work for work in left if not (work.stop.sent or work.stop.over)]

    threading.Thread(target=watch, name="stops sent", daemon=True).start()


def _stop_directly(hanging: Sequence[UnderWay], given: list[UnderWay]) -> None:
    """Have the keeper of the line stop drives whose stops hang in this program."""
    if hanging:
        line = hanging[0].stop.session.line
        if (voice := line.facts.voice) is not None:
            voice.stop_directly(tuple(work.stop.session.device for work in hanging))
            given += hanging
