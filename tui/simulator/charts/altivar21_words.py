"""Words of the Altivar 21 beside its status words: what few families have.

Source: ATV21 Modbus manual 8.3 and 8.8. The bases of the percentages are not in it: rated torque
and rated current are taken. The unit of the energy counters is not either: kWh is taken.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..body import Body

ANALOG_FULL = 1023
ANALOG_HZ = 50.0
BY_LINE, BY_LINE_NEGATED = 38, 39
"""Functions of an output that hand it to FA50, as it is or negated."""
RELAY, FAULT_RELAY = 1 << 0, 1 << 2


def outputs(body: Body) -> int:
    """The outputs as FD07 shows them; RY follows FA50 where F130 hands it over."""
    function, given = body.setting("F130", 0), body.setting("FA50", 0) & RELAY
    relay = given if function == BY_LINE else 0
    if function == BY_LINE_NEGATED:
        relay = RELAY ^ given
    return relay | (FAULT_RELAY if body.fault else 0)


def show_altivar21_words(body: Body) -> None:
    """Put the further words of the family into their registers."""
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
