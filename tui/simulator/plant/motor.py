"""Motor of a simulated drive and its load: a pure step from one state to the next.

Plausible, not exact: straight ramps, slip in proportion to torque, first-order thermal states, a DC
bus that sags under load and rises while braking.

The load changes slowly, with a varying supply voltage, and an operator changes the reference at
intervals. Seeded, so that a run can be repeated.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from enum import Enum
from random import Random

MAX_STEP = 0.05
"""Longest step in s; a longer time is divided into such steps."""

_MAGNETISING = 0.45
_INERTIA = 0.02
"""Torque per Hz/s of acceleration, both in rated units."""
_MOST_TORQUE = 1.6
"""Limit of the torque by the current limitation, in rated units."""
_COAST_TIME = 4.0
_BRAKE_TIME = 0.8
_MOTOR_THERMAL_TIME = 240.0
_DRIVE_THERMAL_TIME = 90.0
_IDLE_DRIVE_THERMAL = 22.0
_EFFICIENCY = 0.95


class Stop(Enum):
    """Kind of stop of a motor."""

    RAMP = "ramp"
    FAST = "fast"
    FREEWHEEL = "freewheel"
    INJECTION = "injection"


@dataclass(frozen=True, slots=True)
class RatingPlate:
    """Rating plate of a drive and its motor: kW, V, Hz, rpm, A."""

    power: float
    voltage: float
    frequency: float = 50.0
    poles: int = 4
    speed: float = 1430.0
    current: float = 0.0
    drive_current: float = 0.0

    @property
    def slip(self) -> float:
        """Slip at rated torque, as a share of the synchronous speed."""
        synchronous = 120 * self.frequency / self.poles
        return max(0.0, 1 - self.speed / synchronous)


@dataclass(frozen=True, slots=True)
class MotorState:
    """State of the motor and the drive's power part, in physical units.

    Frequencies in Hz, signed by direction; torque and thermal states in %; power in kW,
    positive when motoring; energy in kWh; hours in h.
    """

    frequency: float = 0.0
    rotor: float = 0.0
    energised: bool = False
    braking: bool = False
    current: float = 0.0
    voltage: float = 0.0
    torque: float = 0.0
    power: float = 0.0
    input_power: float = 0.0
    mains: float = 0.0
    dc_bus: float = 0.0
    motor_thermal: float = 0.0
    drive_thermal: float = _IDLE_DRIVE_THERMAL
    energy: float = 0.0
    run_hours: float = 0.0
    on_hours: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class Shaft:
    """Load on the motor's shaft: its torque, 1.0 at the rated one, and its inertia."""

    load: float = 0.0
    inertia: float = 1.0
    """Factor of the usual inertia."""
    jammed: bool = False
    """True if the shaft cannot turn."""


@dataclass(frozen=True, slots=True)
class MotorDemand:
    """Demand on the motor by commands and reference: target in Hz, ramps in Hz/s."""

    energised: bool = False
    target: float = 0.0
    acceleration: float = 10.0
    deceleration: float = 10.0
    injection: bool = False


def step(
    state: MotorState, rating: RatingPlate, order: MotorDemand, load: Shaft, mains: float, dt: float
) -> MotorState:
    """Return the state after `dt` seconds with a load and a supply voltage in V."""
    while dt > MAX_STEP:
        state = _step(state, rating, order, load, mains, MAX_STEP)
        dt -= MAX_STEP
    return _step(state, rating, order, load, mains, dt)


def _step(
    state: MotorState, rating: RatingPlate, order: MotorDemand, load: Shaft, mains: float, dt: float
) -> MotorState:
    if order.injection:
        moved = _brake(state, rating, dt / load.inertia)
    elif order.energised:
        moved = _drive(state, rating, order, load, dt)
    else:
        moved = _coast(state, dt / load.inertia)
    if load.jammed:
        moved = replace(moved, rotor=0.0)
    return _supply(moved, rating, mains, dt)


def _drive(
    state: MotorState, rating: RatingPlate, order: MotorDemand, load: Shaft, dt: float
) -> MotorState:
    frequency = approach(state.frequency, order, dt)
    if load.jammed:  # the current limitation keeps the frequency at the slip of the most torque
        most = _MOST_TORQUE * rating.slip * rating.frequency
        frequency = max(-most, min(most, frequency))
    acceleration = (frequency - state.frequency) / dt if dt > 0 else state.acceleration
    share = abs(frequency) / rating.frequency
    way = math.copysign(1.0, frequency) if frequency else 0.0
    torque = way * load.load * (0.35 + 0.65 * min(share, 1.2) ** 2)
    torque += _INERTIA * load.inertia * acceleration
    if load.jammed:
        torque = frequency / (rating.slip * rating.frequency) if rating.slip else way
    torque = max(-_MOST_TORQUE, min(_MOST_TORQUE, torque))
    active = math.sqrt(1 - _MAGNETISING**2) * torque
    return replace(
        state,
        frequency=frequency,
        rotor=frequency - torque * rating.slip * rating.frequency if frequency else 0.0,
        energised=True,
        braking=False,
        acceleration=acceleration,
        torque=100 * torque * (way or 1.0),
        current=rating.current * math.hypot(_MAGNETISING, active),
        voltage=rating.voltage * min(1.0, 0.03 + 0.97 * share) if frequency else 0.0,
        power=rating.power * torque * frequency / rating.frequency,
    )


def approach(frequency: float, order: MotorDemand, dt: float) -> float:
    """Return the ramp's output after `dt`: towards the target, through zero if it must reverse."""
    target = order.target
    if frequency * target < 0:
        target = 0.0
    speeding_up = abs(target) > abs(frequency)
    most = (order.acceleration if speeding_up else order.deceleration) * dt
    change = max(-most, min(most, target - frequency))
    return frequency + change


def _coast(state: MotorState, dt: float) -> MotorState:
    rotor = state.rotor * math.exp(-dt / _COAST_TIME)
    return _unloaded(state, rotor if abs(rotor) > 0.2 else 0.0, current=0.0, braking=False)


def _brake(state: MotorState, rating: RatingPlate, dt: float) -> MotorState:
    rotor = state.rotor * math.exp(-dt / _BRAKE_TIME)
    rotor = rotor if abs(rotor) > 0.2 else 0.0
    return _unloaded(state, rotor, current=0.7 * rating.current, braking=True)


def _unloaded(state: MotorState, rotor: float, *, current: float, braking: bool) -> MotorState:
    return replace(
        state,
        frequency=0.0,
        rotor=rotor,
        energised=False,
        braking=braking,
        acceleration=0.0,
        torque=0.0,
        current=current,
        voltage=0.0,
        power=0.0,
    )


def _supply(state: MotorState, rating: RatingPlate, mains: float, dt: float) -> MotorState:
    """Mains side, thermal states and counters."""
    on = mains > 0
    losses = 0.02 * rating.power if on else 0.0
    input_power = max(0.0, state.power / _EFFICIENCY) + losses * (2 if state.energised else 1)
    load = state.power / rating.power
    bus = mains * math.sqrt(2) * (1 - 0.02 * max(load, 0.0)) * (1 + 0.15 * max(-load, 0.0))
    heat = (state.current / rating.current) ** 2 if rating.current else 0.0
    drive_heat = (state.current / rating.drive_current) ** 2 if rating.drive_current else 0.0
    return replace(
        state,
        mains=mains,
        input_power=input_power if on else 0.0,
        dc_bus=bus,
        motor_thermal=_towards(state.motor_thermal, 90 * heat, dt / _MOTOR_THERMAL_TIME),
        drive_thermal=_towards(
            state.drive_thermal,
            _IDLE_DRIVE_THERMAL + 65 * drive_heat,
            dt / _DRIVE_THERMAL_TIME,
        ),
        energy=state.energy + (input_power if on else 0.0) * dt / 3600,
        run_hours=state.run_hours + (dt / 3600 if state.energised else 0.0),
        on_hours=state.on_hours + (dt / 3600 if on else 0.0),
    )


def _towards(value: float, end: float, part: float) -> float:
    return end + (value - end) * math.exp(-part)


# Ratings

_PLATE = re.compile(r"[HWEPL]?([U0DC]\d\d)(M2|M3X?|N4C?|S6X?)")
_VOLTAGES = {"M2": 230.0, "M3": 230.0, "N4": 400.0, "S6": 575.0}
_FACTORS = {"U": 0.1, "D": 1.0, "0": 0.01, "C": 10.0}
_STANDARD = RatingPlate(4.0, 400.0, speed=1440.0)


def rating_of(reference: str) -> RatingPlate:
    """Return the rating of a drive's reference (ATV71HU15M3: 1.5 kW, 230 V); 4 kW, 400 V
    otherwise."""
    match = _PLATE.search(reference.upper()[5:]) or _PLATE.search(reference.upper())
    if match is None:
        return _with_currents(_STANDARD)
    power = int(match[1][1:]) * _FACTORS[match[1][0]]
    voltage = next(v for prefix, v in _VOLTAGES.items() if match[2].startswith(prefix))
    slip = 0.055 if power < 2 else 0.04 if power < 8 else 0.025
    return _with_currents(RatingPlate(power, voltage, speed=round(1500 * (1 - slip), -1)))


def _with_currents(rating: RatingPlate) -> RatingPlate:
    efficiency = 0.76 if rating.power < 1 else 0.82 if rating.power < 4 else 0.88
    current = 1000 * rating.power / (math.sqrt(3) * rating.voltage * 0.8 * efficiency)
    return replace(rating, current=round(current, 1), drive_current=round(1.3 * current, 1))


REFERENCE_STEPS = (0.5, 0.65, 0.8, 0.9, 1.0)
"""Factors of the initial reference that a wandering one takes."""
REFERENCE_PAUSE = (12.0, 30.0)


class Load:
    """Load as a share of rated torque, and supply as a share of rated voltage, over time."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._base = random.uniform(0.5, 0.68)
        self._phases = [random.uniform(0, 2 * math.pi) for _ in range(3)]
        self._time = 0.0

    def step(self, dt: float) -> None:
        """Advance the time by `dt` seconds."""
        self._time += dt

    @property
    def torque(self) -> float:
        """Load torque, 1.0 at the motor's rated torque and speed."""
        slow = 0.16 * math.sin(2 * math.pi * self._time / 53 + self._phases[0])
        quick = 0.05 * math.sin(2 * math.pi * self._time / 11 + self._phases[1])
        return self._base + slow + quick

    @property
    def mains(self) -> float:
        """Mains voltage, 1.0 at its rated value."""
        return 1.0 + 0.008 * math.sin(2 * math.pi * self._time / 31 + self._phases[2])


class Wanderer:
    """Reference at the terminals that changes at intervals."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._first: float | None = None
        self._left = 0.0

    def begin(self, hz: float | None) -> None:
        """Start changes around a reference in Hz; None: no changes."""
        self._first = hz
        self._left = self._random.uniform(*REFERENCE_PAUSE)

    def step(self, dt: float) -> float | None:
        """Advance the time by `dt` seconds; return the new reference in Hz if it changes, else
        None."""
        if self._first is None:
            return None
        self._left -= dt
        if self._left > 0:
            return None
        self._left = self._random.uniform(*REFERENCE_PAUSE)
        return self._first * self._random.choice(REFERENCE_STEPS)
