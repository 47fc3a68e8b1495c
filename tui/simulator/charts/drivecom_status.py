"""Words of the Altivar 31, 312 and 71: status words, keypad state and marks.

Source: ATV71 communication parameters list (HMIS, LRS1, LRS8, CNFS).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..body import Body
from ..plant.motor import Stop
from ..plant.terminals import FULL_VOLTS
from .channels import ChannelsInForce, channel_bit, channel_marks, extended_status_bits
from .drivecom_stops import CMI_LOCKED, extended_command

INPUT_BITS = 0x003F
"""Bits of IOLR that are inputs."""
ANALOG_COUNTS = 1000
"""Counts of AI1C per volt."""
VOLTAGES: Mapping[float, int] = {230.0: 4, 400.0: 6, 575.0: 8}
"""Raw values of VCAL on three phases, by the voltage of the motor in V."""

(INJECTING, READY, FREEWHEEL, RUNNING, ACCELERATING, DECELERATING, FAST_STOP, FAULT) = (
    1,
    2,
    3,
    4,
    5,
    6,
    8,
    23,
)


def keypad_state(body: Body, stop: Stop | None, *, disabled: bool) -> int:
    """Return the state shown on the keypad of an Altivar 71 (HMIS)."""
    motor = body.motor
    change = motor.acceleration * (1 if motor.frequency >= 0 else -1)
    shown = (
        (body.fault is not None and not body.turning, FAULT),
        (motor.braking, INJECTING),
        (stop is Stop.FAST and motor.frequency != 0, FAST_STOP),
        (motor.energised and change > 0, ACCELERATING),
        (motor.energised and change < 0, DECELERATING),
        (motor.energised, RUNNING),
        (disabled, FREEWHEEL),
    )
    return next((state for holds, state in shown if holds), READY)


def show_altivar_words(body: Body, stop: Stop | None, *, disabled: bool, reached: bool) -> None:
    """Put the additional words of the family into their registers."""
    motor = body.motor
    high = body.value("high_speed", 0.0)
    marks = (
        (body.fault is not None, 1),
        (motor.energised, 2),
        (high > 0 and abs(motor.frequency) >= high - 0.05, 5),
        (reached, 7),
        (motor.motor_thermal >= 100, 8),
    )
    body.show_code("LRS1", sum(1 << bit for holds, bit in marks if holds))
    if body.traits.power_bit:
        body.show_code("HMIS", keypad_state(body, stop, disabled=disabled))
        body.show_code("LRS8", 0 if body.fault or motor.energised else 1 << 15)
        body.show_code("CNFS", 1)
        body.show_code("PPN", body.rating.poles // 2)
        body.show_code("VCAL", VOLTAGES.get(body.rating.voltage, 0))
    show_inputs(body)


def show_inputs(body: Body) -> None:
    """Put the inputs into IL1R or IOLR, and into AI1C and similar words (in mV)."""
    body.show_code("IL1R", body.terminals.bits())
    if outputs := body.registers.named("IOLR"):
        kept = body.registers.present(outputs) & ~INPUT_BITS
        body.registers.put(outputs, kept | (body.terminals.bits() & INPUT_BITS))
    for name in body.terminals.names.analog:
        if analog := body.registers.named(f"{name}C"):
            volts = FULL_VOLTS * body.terminals.level(name)
            body.registers.put(analog, round(volts * ANALOG_COUNTS))


def show_channels(body: Body, channels: ChannelsInForce, *, second_ramp: bool) -> None:
    """Put the channels in force into CCC, CRC, LRS3 and LRS7."""
    body.show_code("CCC", channel_bit(channels.command))
    body.show_code("CRC", channel_bit(channels.reference))
    third, seventh = channel_marks(channels, second_ramp=second_ramp)
    body.show_code("LRS3", third)
    body.show_code("LRS7", seventh)


WARM_MOTOR = 100.0


@dataclass(frozen=True, slots=True)
class Appearance:
    """State of a chart for its status words."""

    state_bits: int
    channels: ChannelsInForce
    going: bool
    """True if the motor is supplied."""
    reached: bool
    wanted: float
    """Signed reference in Hz."""
    outside: bool
    stop: Stop | None
    disabled: bool
    second_ramp: bool


def status_word(body: Body, seen: Appearance) -> int:
    """The status word ETA."""
    motor = body.motor
    marks = (
        (body.traits.power_bit and motor.mains > 0, 4),
        (body.alarms != 0 or motor.motor_thermal >= WARM_MOTOR, 7),
        (_remote(body, seen.channels), 9),
        (seen.reached, 10),
        (seen.going and seen.outside, 11),
        (motor.frequency < 0, 15),
    )
    return seen.state_bits | sum(1 << bit for given, bit in marks if given)


def _remote(body: Body, channels: ChannelsInForce) -> bool:
    """Return bit 9: no forced local (ATV31/312); command or reference by a network (ATV71)."""
    if body.traits.remote_always:
        return not channels.local
    return channels.command.network or channels.reference.network


def extended_status_word(body: Body, seen: Appearance) -> int:
    """The extended status word ETI."""
    motor = body.motor
    change = motor.acceleration * (1 if motor.frequency >= 0 else -1)
    fault = body.fault
    shows_display, shows_line = extended_status_bits(seen.channels.command)
    marks = (
        (body.saving > 0, 0),
        (not extended_command(body) & CMI_LOCKED, 1),
        (fault is not None and not fault.persists, 2),
        (motor.frequency != 0 if body.traits.running_bit else True, 4),
        (motor.braking, 5),
        (motor.acceleration != 0, 6),
        (motor.motor_thermal >= WARM_MOTOR, 7),
        (change > 0, 9),
        (change < 0, 10),
        (seen.stop is Stop.FAST and motor.frequency != 0, 12),
        (shows_display, 13),
        (shows_line, 14),
        (seen.wanted < 0, 15),
    )
    return sum(1 << bit for given, bit in marks if given)


def show_drivecom(body: Body, seen: Appearance) -> None:
    """Put the status words, the channels and the additional words into their registers."""
    body.show_raw("status_word", status_word(body, seen))
    body.show_raw("extended_status_word", extended_status_word(body, seen))
    show_channels(body, seen.channels, second_ramp=seen.second_ramp)
    show_altivar_words(body, seen.stop, disabled=seen.disabled, reached=seen.reached)
