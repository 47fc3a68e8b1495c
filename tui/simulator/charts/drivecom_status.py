"""Status word and extended status word of the Altivar 31, 312 and 71."""

from __future__ import annotations

from dataclasses import dataclass

from ..body import Body
from ..plant.motor import Stop
from .altivar_words import show_altivar_words, show_channels
from .channels import ChannelsInForce, extended_status_bits
from .drivecom_stops import CMI_LOCKED, extended_command

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
