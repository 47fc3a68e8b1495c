"""Keypad of the Altivar 21: LOC/REM, RUN and STOP.

Source: ATV21 Modbus manual 6.2 (LOC/REM is always active) and 8.6 (FD01 bit 15, FE45, FE46). That
LOC keeps the motor as it runs, and that STOP pressed twice in remote trips E, is known from sister
families (F295, F735).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import SimulatorError

LOCAL_STATUS = 15
"""Bit of FD01 that is 1 in local."""
KEYPAD_COMMAND, KEYPAD_REFERENCE = 1, 3
"""FE45 and FE46 in local."""


@dataclass
class Altivar21Keypad:
    """State of the keypad of one drive."""

    local: bool = False
    runs: bool = False
    """True if the keypad commands a run, while local."""
    hz: float = 0.0
    """Reference of the keypad in Hz, signed by direction."""

    def take(self, *, runs: bool, hz: float) -> str:
        """Go to local, as the motor is commanded now."""
        if not self.local:
            self.local, self.runs, self.hz = True, runs, hz
        return "local"

    def give(self) -> str:
        """Return to remote."""
        self.local = self.runs = False
        return "remote"

    def run(self) -> str:
        """Run at the keypad's reference. Raises SimulatorError in remote."""
        if not self.local:
            raise SimulatorError("RUN acts in local only. Press LOC first.")
        self.runs = True
        return f"RUN at {self.hz:g} Hz"

    def stop(self) -> str:
        """Stop on the ramp, in local."""
        self.runs = False
        return "STOP"
