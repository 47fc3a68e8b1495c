"""Drivecom state machine of one drive: transitions by commands, faults and standstill.

Sources: ATV71 Modbus manual and communication parameters guide; ATV312 communication variables
manual, control and status words.
"""

from __future__ import annotations

from ..body import Body
from ..plant.motor import Stop
from .drivecom_states import TRANSITIONS, DrivecomCommand, DrivecomState
from .drivecom_stops import stop_type

QSTD_LEAVES = 2


class DrivecomMachine:
    """State of one drive, and how it stops when it leaves the state."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self.state = DrivecomState.DISABLED
        self.leaving = False
        """True while a Disable operation waits for the motor to stop."""
        self.stop = Stop.RAMP
        """Kind of stop in the fault reaction, or on leaving operation."""

    def start(self, *, enabled: bool) -> None:
        """Restart: disabled, or enabled automatically."""
        self.state = DrivecomState.ENABLED if enabled else DrivecomState.DISABLED
        self.leaving = False

    def enable(self) -> None:
        """Go to Operation enabled without the line, unless a fault is present."""
        if not self.faulty:
            self.state = DrivecomState.ENABLED
            self.leaving = False

    def leave(self) -> None:
        """Ramp down, then go to Switched on."""
        if self.state is DrivecomState.ENABLED:
            self.stop, self.leaving = Stop.RAMP, True

    @property
    def faulty(self) -> bool:
        """True during a fault or a fault reaction."""
        return self.state in (DrivecomState.FAULT, DrivecomState.REACTION)

    def obey(self, command: DrivecomCommand | None, *, low_access: bool) -> None:
        """Execute a command of the line."""
        if self.faulty:
            return
        self.leaving = False
        if command is None:
            return
        if self.state is DrivecomState.ENABLED and command is DrivecomCommand.SWITCH_ON:
            self._disable_operation()
        elif command is DrivecomCommand.ENABLE and self._enables_from_here(low_access):
            self.state = DrivecomState.ENABLED
        elif target := TRANSITIONS.get((self.state, command)):
            self.state = target

    def _disable_operation(self) -> None:
        """Stop as DOTD or the normal stop type demands, then go to Switched on."""
        freewheel_set = self._body.setting("DOTD", 1) == 0
        self.stop = Stop.FREEWHEEL if freewheel_set else stop_type(self._body)
        self.leaving = self.stop is not Stop.FREEWHEEL
        if not self.leaving:
            self.state = DrivecomState.SWITCHED_ON

    def _enables_from_here(self, low_access: bool) -> bool:
        if self.state is DrivecomState.READY:
            return self._body.traits.enable_from_ready
        return self.state is DrivecomState.DISABLED and low_access

    def reconfigured(self) -> None:
        """Process a write to a configuration word: some families return to disabled."""
        between = (DrivecomState.READY, DrivecomState.SWITCHED_ON)
        if self._body.traits.config_disables and self.state in between:
            self.state = DrivecomState.DISABLED

    def trip(self, stop: Stop) -> None:
        """Go to Fault, after the fault reaction if the motor is stopped first."""
        slow = stop is not Stop.FREEWHEEL and self._body.turning
        self.state = DrivecomState.REACTION if slow else DrivecomState.FAULT
        self.stop = stop
        self.leaving = False

    def stands(self, *, holds: bool) -> None:
        """Change the state at standstill; `holds` keeps it enabled."""
        if self.state is DrivecomState.REACTION:
            self.state = DrivecomState.FAULT
        elif self.leaving:
            self.leaving = False
            self.state = DrivecomState.SWITCHED_ON
        elif self.state is DrivecomState.QUICK_STOP:
            if self._body.setting("QSTD", 6) == QSTD_LEAVES:
                self.state = DrivecomState.DISABLED
        elif self.state is DrivecomState.ENABLED and not holds:
            self.state = DrivecomState.DISABLED

    def stopping(self) -> Stop | None:
        """Return the stop that the state demands; None if the state allows running."""
        if self.state is DrivecomState.QUICK_STOP:
            return Stop.FAST
        if self.state is DrivecomState.REACTION or self.leaving:
            return self.stop
        return None
