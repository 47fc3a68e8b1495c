"""Words of the Altivar 21 beside its status words: what few families have.

Source: ATV21 Modbus manual 8.3 and 8.8. The bases of the percentages are not in it: rated torque
and rated current are taken. The unit of the energy counters is not either: kWh is taken.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..body import Body

ANALOGUE_FULL = 1023
ANALOGUE_HZ = 50.0


def show_altivar21_words(body: Body) -> None:
    """Put the further words of the family into their registers."""
    motor = body.motor
    rated = body.rating.current
    torque_current = motor.current * min(1.0, abs(motor.torque) / 100) if motor.energised else 0.0
    excitation = math.sqrt(max(0.0, motor.current**2 - torque_current**2))
    reference = min(1.0, abs(body.terminal_hz or 0.0) / ANALOGUE_HZ)
    values: Mapping[str, float] = {
        "FE16": abs(motor.rotor),
        "FE20": 100 * torque_current / rated,
        "FE21": 100 * excitation / rated,
        "FE35": ANALOGUE_FULL * reference,
        "FE76": motor.energy,
        "FE77": 0.93 * motor.energy,
    }
    for code, value in values.items():
        if parameter := body.registers.named(code):
            body.registers.put(parameter, round(value / body.scale(parameter)))
