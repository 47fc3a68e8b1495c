"""Status word and extended status word of the Altivar 31, 312 and 71, as pure functions.

Sources: ATV71 communication parameters list (ETA, ETI); ATV312 communication variables.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..body import Body
from ..plant.motor import Stop

WARM_MOTOR = 100.0


@dataclass(frozen=True, slots=True)
class Appearance:
    """What a chart tells about itself."""

    state_bits: int
    network: bool
    """The command word of the line is in force."""
    line_commands: bool
    """The line has, or would have, the command."""
    going: bool
    """The motor is supplied."""
    reached: bool
    wanted: float
    """Signed reference in Hz."""
    outside: bool
    stop: Stop | None
    locked: bool


def status_word(body: Body, seen: Appearance) -> int:
    """The status word ETA."""
    motor = body.motor
    marks = (
        (body.traits.power_bit and motor.mains > 0, 4),
        (body.alarms != 0 or motor.motor_thermal >= WARM_MOTOR, 7),
        (body.traits.remote_always or seen.line_commands, 9),
        (seen.reached, 10),
        (seen.going and seen.outside, 11),
        (motor.frequency < 0, 15),
    )
    return seen.state_bits | sum(1 << bit for given, bit in marks if given)


def extended_status_word(body: Body, seen: Appearance) -> int:
    """The extended status word ETI."""
    motor = body.motor
    change = motor.acceleration * (1 if motor.frequency >= 0 else -1)
    fault = body.fault
    marks = (
        (body.saving > 0, 0),
        (not seen.locked, 1),
        (fault is not None and not fault.persists, 2),
        (motor.frequency != 0 if body.traits.running_bit else True, 4),
        (motor.braking, 5),
        (motor.acceleration != 0, 6),
        (motor.motor_thermal >= WARM_MOTOR, 7),
        (change > 0, 9),
        (change < 0, 10),
        (seen.stop is Stop.FAST and motor.frequency != 0, 12),
        (seen.network, 14),
        (seen.wanted < 0, 15),
    )
    return sum(1 << bit for given, bit in marks if given)
