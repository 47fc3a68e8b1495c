"""Arming of one drive: until when this program may write to it, and why no longer."""

from __future__ import annotations

import math
from collections.abc import Callable

from tui.bus.api import LineStatus, ModbusLine
from tui.drive.orders import OrderRefused
from tui.safety import ARMED_FOR

from .clock import REAL_CLOCK, Clock


class NotArmed(OrderRefused):
    """The drive is not armed, so nothing is written to it."""

    def __init__(self, why: str = "") -> None:
        super().__init__(why or "Not armed. Press a to arm this drive.")


class CommandedElsewhere(OrderRefused):
    """Another program on the line commands the drive, so it cannot be armed."""


class Arming:
    """Allows writes to one drive for a limited time; every write checks it first."""

    def __init__(
        self,
        line: ModbusLine,
        clock: Clock = REAL_CLOCK,
        device: int | None = None,
        care: Callable[[], bytes] = bytes,
    ) -> None:
        """`care` returns the data by which the owner of the line can stop the drive."""
        self._line = line
        self._device = device
        self._care = care
        self._clock = clock
        self._until: float | None = None
        self._span = ARMED_FOR
        self.why_disarmed = ""
        """Why arming ended without a command; empty if it did not."""
        self.times = 0
        """Number of times that the drive was armed."""
        self.trouble: Callable[[], str] = str
        """Returns the defect of the drive's replies that forbids writing; empty if none."""
        self.barred = ""
        """Why the drive must never be armed, for a person; empty if it may be."""

    def arm(self, *, seconds: float = ARMED_FOR) -> None:
        """Allow writes from now on.

        `seconds` is the time without a key until it ends; math.inf for a command that disarms on
        its own. Raises OrderRefused if the line is read-only, or held until a person accepts it,
        or the drive is barred. Raises CommandedElsewhere if another program commands the drive.
        """
        if why := self.hindrance:
            raise OrderRefused(why)
        if self._device is not None and (why := self._line.facts.claim(self._device)):
            raise CommandedElsewhere(why)
        if self._device is not None:
            self._line.facts.leases.arm(self._device, _finite(seconds), self._care())
        self._span, self.why_disarmed = seconds, ""
        self.times += 1
        self._until = self._clock.monotonic() + seconds

    @property
    def hindrance(self) -> str:
        """Why the drive cannot be armed now; empty if it can."""
        if self.barred:
            return self.barred
        if self._line.read_only:
            return "The line is read-only: nothing is written."
        return self._line.held or self.trouble()

    def disarm(self, why: str = "") -> None:
        """Refuse all writes from now on; `why` is shown to a person."""
        self._until = None
        self.why_disarmed = why
        if self._device is not None:
            self._line.facts.release(self._device)
            self._line.facts.leases.disarm(self._device)

    def touch(self) -> None:
        """Restart the time of an armed drive, after a key or during work."""
        if self.armed_for is not None:
            self._until = self._clock.monotonic() + self._span
            if self._device is not None:
                self._line.facts.leases.stay_armed(self._device, _finite(self._span))

    @property
    def armed_for(self) -> float | None:
        """Seconds until the drive is disarmed, maybe infinite; None if it is not armed."""
        until = self._until
        if until is None:
            return None
        if until <= self._clock.monotonic():
            self.disarm("Disarmed: no key pressed for 60 s.")
            return None
        if self._line.state.status is not LineStatus.CONNECTED:
            self.disarm("The line was lost: no longer armed.")
            return None
        if self._line.held:
            self.disarm(self._line.held)
            return None
        if why := self.trouble():
            self.disarm(why)
            return None
        return math.inf if until == math.inf else until - self._clock.monotonic()

    @property
    def armed(self) -> bool:
        """True if writes are allowed now."""
        return self.armed_for is not None

    def refusal(self) -> str:
        """Return why nothing may be written now; empty if it may."""
        return "" if self.armed else self.why_disarmed or "Not armed. Press a to arm this drive."


def _finite(seconds: float) -> float | None:
    return None if seconds == math.inf else seconds
