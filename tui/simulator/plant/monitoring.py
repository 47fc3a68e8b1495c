"""Monitoring words of a drive from the motor's physical values, in the profile's units."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from tui.drive.errors import ValueRefused
from tui.drive.profile.schema import Quantity
from tui.drive.values import is_signed_type

from ..body import Body
from .motor import MotorState

Converter = Callable[[Body, MotorState], float]


def _part(value: float, whole: float) -> float:
    return 100 * value / whole if whole else 0.0


_HOUR_UNITS: Mapping[str, float] = {"h": 1.0, "": 1.0, "min": 60.0, "s": 3600.0}


def _hours(name: str) -> dict[str, Converter]:
    def in_units(factor: float) -> Converter:
        return lambda body, motor: factor * float(getattr(motor, name))

    return {unit: in_units(factor) for unit, factor in _HOUR_UNITS.items()}


BY_UNIT: Mapping[Quantity, Mapping[str, Converter]] = {
    "motor_current": {
        "A": lambda body, motor: motor.current,
        "%": lambda body, motor: _part(motor.current, body.rating.drive_current),
    },
    "motor_voltage": {
        "V": lambda body, motor: motor.voltage,
        "%": lambda body, motor: _part(motor.voltage, body.rating.voltage),
    },
    "mains_voltage": {"V": lambda body, motor: motor.mains},
    "dc_bus": {
        "V": lambda body, motor: motor.dc_bus,
        "%": lambda body, motor: _part(motor.dc_bus, body.rating.voltage * math.sqrt(2)),
    },
    "torque": {"%": lambda body, motor: motor.torque},
    "power": {
        "kW": lambda body, motor: max(0.0, motor.power),
        "W": lambda body, motor: max(0.0, 1000 * motor.power),
        "%": lambda body, motor: _part(motor.power, body.rating.power),
    },
    "input_power": {
        "kW": lambda body, motor: motor.input_power,
        "W": lambda body, motor: 1000 * motor.input_power,
    },
    "drive_thermal": {"%": lambda body, motor: motor.drive_thermal},
    "motor_thermal": {"%": lambda body, motor: motor.motor_thermal},
    "motor_load": {"%": lambda body, motor: abs(motor.torque)},
    "drive_load": {"%": lambda body, motor: _part(motor.current, body.rating.drive_current)},
    "energy": {
        "kWh": lambda body, motor: motor.energy,
        "Wh": lambda body, motor: 1000 * motor.energy,
        "MWh": lambda body, motor: motor.energy / 1000,
    },
    "run_hours": _hours("run_hours"),
    "power_on_hours": _hours("on_hours"),
}
"""Conversions of quantities by unit in the profile; the first applies if the unit is missing."""

UNCONFIRMED: Mapping[str, Mapping[str, Callable[[MotorState], float]]] = {
    "leroy-somer": {
        "4.01": lambda motor: 100 * motor.current,
        "5.01": lambda motor: 10 * abs(motor.frequency),
        "5.02": lambda motor: motor.voltage,
        "5.04": lambda motor: abs(motor.rotor) * 30,
    }
}
"""Words of unknown scale, by kind of chart: they change with the motor, without a verified
value."""

COUNTER_UNITS = 1 | 2 << 2 | 2 << 4
"""UNT of the ATV71: energy in kWh, times in h."""


def show_motor(body: Body) -> None:
    """Put the motor's present values into the monitoring words."""
    motor = body.motor
    for quantity, converters in BY_UNIT.items():
        parameter = body.parameter(quantity)
        if parameter is not None:
            converter = converters.get(parameter.unit) or next(iter(converters.values()))
            body.show(quantity, converter(body, motor))
    _show_speed(body)
    for code, convert in UNCONFIRMED.get(body.traits.kind, {}).items():
        body.show_code(code, round(convert(motor)) & 0xFFFF)
    if body.traits.power_bit:
        body.show_code("UNT", COUNTER_UNITS)


def _show_speed(body: Body) -> None:
    """Show the speed by the profile's formula, else that of the rotor, signed if the word allows
    it."""
    poles = round(body.value("motor_poles", body.rating.poles))
    poles = poles if poles >= 2 else body.rating.poles
    formula = body.profile.data.monitoring.speed_from
    if formula and formula.result:
        raw = body.registers.present(body.profile[formula.frequency])
        body.show_code(formula.result, speed_from_frequency(raw, poles))
        return
    parameter = body.parameter("speed")
    if parameter is None:
        return
    rpm = body.motor.rotor * 120 / poles
    signed = is_signed_type(parameter)
    if parameter.unit == "Hz":
        rpm = body.motor.rotor
    body.show("speed", rpm if signed else abs(rpm))


def speed_from_frequency(raw_frequency: int, poles: int) -> int:
    """Return the speed in rpm from a raw output frequency in 0.01 Hz and the number of poles.

    The drive's own rounding: (F x 12 + 5 x poles) / (poles x 10), cut to an integer. Source: ATV21
    Modbus manual 8.3, FE90. Raises ValueRefused for less than one pole.
    """
    if poles < 1:
        raise ValueRefused(f"{poles} poles: a motor has at least 2.")
    return (raw_frequency * 12 + 5 * poles) // (poles * 10)
