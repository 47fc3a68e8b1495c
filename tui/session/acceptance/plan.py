"""Plan of an acceptance test for a person: which steps run the motor, how, and for how long.

The high speed of a drive is the highest reference that its own setting allows.
"""

from __future__ import annotations

from typing import NamedTuple

from ..command.reference import reference_codes, reference_limits
from ..console import DriveConsole
from .step_file import AcceptanceFile
from .steps import (
    AcceptanceStep,
    CommunicationLossStep,
    DirectionStep,
    LimitStep,
    MotionStep,
    RampStep,
    SpeedsStep,
    StopStep,
    moves_motor,
)


class HighSpeed(NamedTuple):
    """Highest reference of a drive in Hz, and the code of the setting."""

    hertz: float
    code: str


async def read_high_speed(console: DriveConsole) -> HighSpeed | None:
    """Return the high speed of a drive; None if it has none. Raises the line's errors."""
    profile = console.session.profile
    parameter = profile.quantity("command_frequency")
    if parameter is None:
        return None
    readings = await console.read(reference_codes(profile))
    _, high, code = reference_limits(profile, readings, parameter)
    return None if high is None else HighSpeed(float(high), code)


RAMP_SLACK, RAMP_FACTOR = 2.0, 1.5
"""A ramp is waited for this factor of its time, and these seconds longer; then it has failed."""
COARSE_RAMP = 60.0
"""Seconds within which a motor must reach a speed whose ramp is not given."""
PROOF_FACTOR, PROOF_MORE = 12.0, 20.0
"""Longest test of a communication loss: so many timeouts, and seconds more."""
COASTING_STOP = "freewheel"
REST_LINES = (
    "Each run ends with a stop. Ctrl-C or Enter stops the motor at once and ends the test.",
    "Check the machine, the people near it, and its emergency stop.",
)


def planned_motions(file: AcceptanceFile, high: HighSpeed | None = None) -> list[str]:
    """Return a line for each step that runs the motor or trips the drive, in their order.

    `high` is the high speed of the drive, once it was read.
    """
    return [
        f"Step {number}: {text}"
        for number, step in enumerate(file.steps, start=1)
        if (text := step_effect(step, high))
    ]


def step_effect(step: AcceptanceStep, high: HighSpeed | None = None) -> str:
    """Describe the effect of a step on the motor and the drive; empty for none."""
    if isinstance(step, CommunicationLossStep) and not step.turning:
        return f"motor at standstill; polling pauses until the drive trips ({step.timeout:g} s)."
    if not moves_motor(step) or not isinstance(step, MotionStep):
        return ""
    at = "at its present reference" if step.hz is None else f"at {step.hz:g} Hz"
    run = f"{step.direction} {at}"
    if isinstance(step, DirectionStep):
        return f"{run}, for {step.seconds:g} s."
    if isinstance(step, RampStep):
        times = [f"{t:g} s" for t in (step.up, step.down) if t is not None]
        return f"{run}, up and down its ramps ({', '.join(times)})."
    if isinstance(step, SpeedsStep):
        speeds = ", ".join(f"{p:g}" for p in step.percent)
        each = f"{step.seconds:g} s each, {step.settle:g} s at most to reach it"
        return f"{run.replace(' at ', f' at {speeds} % of ')}; {each}."
    if isinstance(step, StopStep):
        text = f"{run}, for {step.seconds:g} s, then {step.method}, within {step.max:g} s."
        return (
            f"{text} The motor COASTS, and a hoist load falls."
            if step.method == COASTING_STOP
            else text
        )
    if isinstance(step, LimitStep):
        speed = f"{high.code} = {high.hertz:g} Hz" if high else "the high speed of the drive"
        return (
            f"{step.direction} at {speed}, then with a reference {step.over:g}"
            f" Hz ABOVE it, for {step.seconds:g} s. A drive that ignores its limit exceeds it."
        )
    assert isinstance(step, CommunicationLossStep)
    return (
        f"{run}; then polling pauses until the drive reacts ({step.timeout:g} s) with the motor"
        " TURNING. It may coast, and a hoist load may fall."
    )


def longest_motion(file: AcceptanceFile) -> float:
    """Return the seconds that all runs take at most, without their stops."""
    return sum(longest_of(step) for step in file.steps if moves_motor(step))


def longest_of(step: AcceptanceStep) -> float:
    """Return the longest run of a step in seconds, without its stop."""
    match step:
        case DirectionStep():
            return step.seconds + RAMP_SLACK
        case RampStep():
            return ramp_within(step) + RAMP_SLACK
        case SpeedsStep():
            return len(step.percent) * (step.settle + step.seconds + RAMP_SLACK)
        case StopStep():
            return step.settle + step.seconds + stop_within(step) + RAMP_SLACK
        case LimitStep():
            return step.settle + step.seconds + 2 * RAMP_SLACK
        case CommunicationLossStep():
            return step.settle + PROOF_FACTOR * step.timeout + PROOF_MORE
    return 0.0


def ramp_within(step: RampStep) -> float:
    """Return the seconds within which the reference of a ramp must be reached."""
    hz = step.hz or 0.0
    return COARSE_RAMP if step.up is None else _slack(step.up * hz / (step.base or hz))


def stop_within(step: StopStep) -> float:
    """Return the seconds after which a stop is followed by the ramp stop."""
    return _slack(step.max)


def _slack(seconds: float) -> float:
    return seconds * RAMP_FACTOR + RAMP_SLACK
