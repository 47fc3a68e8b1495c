"""Steps of an acceptance test as its file has them: one table for each kind.

Frequencies are in Hz and times in seconds. Every step that moves the motor ends with a stop.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Literal

from msgspec import Meta, field

from tui.drive.chart import Direction
from tui.drive.profile.schema import OrderId, Table, about

MOST_STEPS = 100

Hertz = Annotated[float, Meta(ge=0.1, le=1000)]
StepSeconds = Annotated[float, Meta(ge=0.1, le=3600)]
Tolerance = Annotated[float, Meta(ge=0.0, le=1000.0)]
StepPercent = Annotated[float, Meta(ge=1, le=100)]


class ValueLimits(Table, frozen=True, kw_only=True):
    """Lowest and highest allowed value."""

    unit: Annotated[str, about("Unit of both: the drive's, or one that it can be converted to.")]
    min: Annotated[float | None, about("Lowest allowed value.")] = None
    max: Annotated[float | None, about("Highest allowed value.")] = None


class AcceptanceStep(Table, frozen=True, kw_only=True):
    """Fields common to all steps."""

    kind: Annotated[str, about("Kind of the step.")]
    name: Annotated[str, about("Name of the step in the report.")] = ""
    goes_on: Annotated[
        bool,
        about("True if the motor may be run in later steps even if this one fails."),
    ] = field(default=False, name="continue")


class SettingsStep(AcceptanceStep, frozen=True, kw_only=True):
    """Settings of the drive match a set, or these values."""

    file: Annotated[str, about("Parameter set, relative to the test file.")] = ""
    values: Annotated[
        dict[str, str], Meta(description='Values by code, as they are shown: "3.0 s".')
    ] = {}
    ignore: Annotated[list[str], about("Codes of the set that may differ.")] = []


class RefusedStep(AcceptanceStep, frozen=True, kw_only=True):
    """References beyond the limits of the drive are refused; nothing is written."""

    references: Annotated[
        Annotated[list[str], Meta(min_length=1)], Meta(description='References as typed: "55Hz".')
    ]


class MotionStep(AcceptanceStep, frozen=True, kw_only=True):
    """A step that runs the motor."""

    direction: Annotated[Direction, about("Direction of the run command.")] = "forward"
    hz: Annotated[Hertz | None, about("Reference in Hz; absent: the present reference.")] = None


class DirectionStep(MotionStep, frozen=True, kw_only=True):
    """The motor turns in the commanded direction."""

    seconds: Annotated[StepSeconds, about("Duration of the run.")] = 3.0
    turns: Annotated[
        Literal["", "right", "left"],
        about("Direction that the person must see, toward the end of the shaft; empty: not asked."),
    ] = ""


class RampStep(MotionStep, frozen=True, kw_only=True):
    """Acceleration and deceleration take the given times."""

    up: Annotated[StepSeconds | None, about("Seconds from 0 Hz to `base`.")] = None
    down: Annotated[StepSeconds | None, about("Seconds from `base` to 0 Hz, by the ramp stop.")] = (
        None
    )
    base: Annotated[Hertz | None, about("Frequency to which the times apply; absent: `hz`.")] = None
    tolerance: Annotated[Tolerance, about("Allowed difference in seconds.")] = 0.1


class SpeedsStep(MotionStep, frozen=True, kw_only=True):
    """Values at several speeds, each in its limits."""

    percent: Annotated[
        list[StepPercent],
        Meta(min_length=1, max_length=20),
        about("Speeds in percent of `hz`."),
    ] = field(default_factory=lambda: [25.0, 50.0, 75.0, 100.0])
    seconds: Annotated[StepSeconds, about("Seconds at each speed.")] = 5.0
    settle: Annotated[StepSeconds, about("Seconds within which each speed must be reached.")] = 20.0
    tolerance: Annotated[Tolerance, about("Allowed difference of the output frequency in Hz.")] = (
        0.5
    )
    limits: Annotated[
        dict[str, ValueLimits],
        about(
            "Limits by value: motor_current, torque, motor_voltage, motor_thermal, drive_thermal."
        ),
    ] = {}


class StopStep(MotionStep, frozen=True, kw_only=True):
    """A stop brings the motor to standstill in time."""

    method: Annotated[OrderId, about("Command that stops the motor.")] = "stop"
    seconds: Annotated[StepSeconds, about("Duration of the run before the stop.")] = 2.0
    settle: Annotated[StepSeconds, about("Seconds within which the speed must be reached.")] = 20.0
    min: Annotated[Tolerance, about("Least seconds to standstill.")] = 0.0
    max: Annotated[StepSeconds, about("Most seconds to standstill.")]


class LimitStep(MotionStep, frozen=True, kw_only=True):
    """The drive limits a reference above its high speed.

    It runs at high speed first, then gets a reference that is `over` Hz higher.
    """

    over: Annotated[
        float,
        Meta(ge=0.5, le=3),
        about("Hz above the high speed of the drive."),
    ] = 1.0
    seconds: Annotated[StepSeconds, about("Seconds with that reference.")] = 3.0
    settle: Annotated[
        StepSeconds, about("Seconds within which the high speed must be reached.")
    ] = 20.0
    tolerance: Annotated[
        float,
        Meta(ge=0.1, le=2),
        about("Allowed output frequency above the high speed in Hz."),
    ] = 0.3


class CommunicationLossStep(MotionStep, frozen=True, kw_only=True):
    """The drive reacts to communication loss as configured."""

    timeout: Annotated[StepSeconds, about("Timeout that must be configured, in seconds.")]
    reaction: Annotated[
        str, about("Reaction that must be configured, by its name; empty: any.")
    ] = ""
    turning: Annotated[bool, about("True to test with the motor turning.")] = False
    settle: Annotated[StepSeconds, about("Seconds within which the speed must be reached.")] = 20.0


class ResetStep(AcceptanceStep, frozen=True, kw_only=True):
    """The fault is reset, and the motor stays at standstill."""


STEP_KINDS: Mapping[str, type[AcceptanceStep]] = MappingProxyType(
    {
        "settings": SettingsStep,
        "refused": RefusedStep,
        "direction": DirectionStep,
        "ramp": RampStep,
        "speeds": SpeedsStep,
        "stop": StopStep,
        "limit": LimitStep,
        "communication-loss": CommunicationLossStep,
        "reset": ResetStep,
    }
)


class AcceptanceTest(Table, frozen=True, kw_only=True):
    """A test file without its steps."""

    format: Annotated[Literal[1], about("Format of the file.")]
    name: Annotated[str, about("Title of the report.")]
    profile: Annotated[str, about("Profile of the drive.")]


def moves_motor(step: AcceptanceStep) -> bool:
    """Return True if a step runs the motor."""
    if isinstance(step, CommunicationLossStep):
        return step.turning
    return isinstance(step, MotionStep)
