"""Keypad of the Altivar 21, and words that few families have.

Source: ATV21 Modbus manual 8.3 and 8.8. It does not give the bases of the percentages: rated torque
and rated current are assumed. Nor does it give the unit of the energy counters: kWh is assumed.

Source of the keypad: 6.2 (LOC/REM is always active) and 8.6 (FD01 bit 15, FE45, FE46). That LOC
keeps the motor as it runs, and that STOP pressed twice in remote trips E, is known from sister
families (F295, F735).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..body import Body
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


ANALOG_FULL = 1023
ANALOG_HZ = 50.0
BY_LINE, BY_LINE_NEGATED = 38, 39
"""Functions of an output that make it follow FA50, directly or negated."""
RELAY, FAULT_RELAY = 1 << 0, 1 << 2


def outputs(body: Body) -> int:
    """Return the outputs as FD07 shows them; RY follows FA50 if F130 selects it."""
    function, given = body.setting("F130", 0), body.setting("FA50", 0) & RELAY
    relay = given if function == BY_LINE else 0
    if function == BY_LINE_NEGATED:
        relay = RELAY ^ given
    return relay | (FAULT_RELAY if body.fault else 0)


def show_altivar21_words(body: Body) -> None:
    """Put the additional words of the family into their registers."""
    motor = body.motor
    rated = body.rating.current
    torque_current = motor.current * min(1.0, abs(motor.torque) / 100) if motor.energised else 0.0
    excitation = math.sqrt(max(0.0, motor.current**2 - torque_current**2))
    values: Mapping[str, float] = {
        "FE16": abs(motor.rotor),
        "FE20": 100 * torque_current / rated,
        "FE21": 100 * excitation / rated,
        "FE35": ANALOG_FULL * body.terminals.level("VIA"),
        "FE36": ANALOG_FULL * body.terminals.level("VIB"),
        "FE76": motor.energy,
        "FE77": 0.93 * motor.energy,
    }
    for code, value in values.items():
        if parameter := body.registers.named(code):
            body.registers.put(parameter, round(value / body.scale(parameter)))


def take_effect(body: Body) -> None:
    """Put in force what was written for the next power-up or reset: manual 6."""
    for parameter in body.profile.parameters:
        if parameter.effective == "after-reset":
            body.registers.put(parameter, body.registers.present(parameter))
