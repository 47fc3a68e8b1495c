"""True if a drive may be written to from here: until when, and why no longer."""

from __future__ import annotations

import math
from collections.abc import Callable

from tui.bus.api import LineStatus, ModbusLine
from tui.drive.orders import OrderRefused
from tui.safety import ARMED_FOR

from .clock import REAL_CLOCK, Clock


class NotArmed(OrderRefused):
    """A write or command to a drive that is not armed."""

    def __init__(self, why: str = "") -> None:
        super().__init__(why or "Not armed. Press a to arm this drive.")


class CommandedElsewhere(OrderRefused):
    """Another program on the line commands the drive."""


class Arming:
    """Lets writes to one drive through for a while; whatever writes asks here."""

    def __init__(
        self,
        line: ModbusLine,
        clock: Clock = REAL_CLOCK,
        device: int | None = None,
        care: Callable[[], bytes] = bytes,
    ) -> None:
        """`care` is passed to the holder of the line: how the drive is stopped without this
        program."""
        self._line = line
        self._device = device
        self._care = care
        self._clock = clock
        self._until: float | None = None
        self._span = ARMED_FOR
        self.why_disarmed = ""
        """Why arming ended without a command; empty if it did not."""
        self.times = 0
        """Number of times it was armed."""
        self.trouble: Callable[[], str] = str
        """Returns what is wrong with the drive's replies so that nothing may be written now."""
        self.barred = ""
        """Why the drive is not to be armed at all, for a person; empty where it may be."""

    def arm(self, *, seconds: float = ARMED_FOR) -> None:
        """Let writes through from now on.

        `seconds` is how long without a key; math.inf for a command that ends on its own. Raises
        OrderRefused on a line that is read-only, or held until a person says otherwise, and where
        it is barred; CommandedElsewhere where another program commands the drive.
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
        """Why the drive cannot be armed now, whatever a person does here; empty if it can."""
        if self._line.read_only:
            return "The line is read-only: nothing is written."
        return self._line.held or self.barred or self.trouble()

    def disarm(self, why: str = "") -> None:
        """Let no write through any more."""
        self._until = None
        self.why_disarmed = why
        if self._device is not None:
            self._line.facts.release(self._device)
            self._line.facts.leases.disarm(self._device)

    def touch(self) -> None:
        """A key was pressed, or work goes on: an armed drive stays armed."""
        if self.armed_for is not None:
            self._until = self._clock.monotonic() + self._span
            if self._device is not None:
                self._line.facts.leases.stay_armed(self._device, _finite(self._span))

    @property
    def armed_for(self) -> float | None:
        """Seconds for which the drive is armed yet, maybe infinite; None when it is not."""
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
        """True if writes are let through now."""
        return self.armed_for is not None

    def refusal(self) -> str:
        """Why nothing may be written now; empty where it may."""
        return "" if self.armed else self.why_disarmed or "Not armed. Press a to arm this drive."


def _finite(seconds: float) -> float | None:
    return None if seconds == math.inf else seconds
