"""Steps of an acceptance test as its file has them: one table for each kind.

Frequencies are in Hz and times in seconds. Every step that moves the motor ends with a stop.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Literal

from msgspec import Meta, field

from tui.drive.chart import Direction
from tui.drive.profile.schema import OrderId, Table

MOST_STEPS = 100

Hertz = Annotated[float, Meta(ge=0.1, le=1000)]
StepSeconds = Annotated[float, Meta(ge=0.1, le=3600)]
Tolerance = Annotated[float, Meta(ge=0, le=1000)]
StepPercent = Annotated[float, Meta(ge=1, le=100)]


class ValueLimits(Table, frozen=True, kw_only=True):
    """Lowest and highest allowed value."""

    unit: str
    """Unit of both: the drive's, or one that it can be converted to."""
    min: float | None = None
    """Lowest allowed value."""
    max: float | None = None
    """Highest allowed value."""


class AcceptanceStep(Table, frozen=True, kw_only=True):
    """Fields common to all steps."""

    kind: str
    """Kind of the step."""
    name: str = ""
    """Name of the step in the report."""
    goes_on: bool = field(default=False, name="continue")
    """True if the motor may be run in later steps even if this one fails."""


class SettingsStep(AcceptanceStep, frozen=True, kw_only=True):
    """Settings of the drive match a set, or these values."""

    file: str = ""
    """Parameter set, relative to the test file."""
    values: dict[str, str] = {}
    """Values by code, as they are shown: "3.0 s"."""
    ignore: list[str] = []
    """Codes of the set that may differ."""


class RefusedStep(AcceptanceStep, frozen=True, kw_only=True):
    """References beyond the limits of the drive are refused; nothing is written."""

    references: Annotated[list[str], Meta(min_length=1)]
    """References as typed: "55Hz"."""


class MotionStep(AcceptanceStep, frozen=True, kw_only=True):
    """A step that runs the motor."""

    direction: Direction = "forward"
    """Direction of the run command."""
    hz: Hertz | None = None
    """Reference in Hz; absent: the present reference."""


class DirectionStep(MotionStep, frozen=True, kw_only=True):
    """The motor turns in the commanded direction."""

    seconds: StepSeconds = 3.0
    """Duration of the run."""
    turns: Literal["", "right", "left"] = ""
    """Direction that the person must see, toward the end of the shaft; empty: not asked."""


class RampStep(MotionStep, frozen=True, kw_only=True):
    """Acceleration and deceleration take the given times."""

    up: StepSeconds | None = None
    """Seconds from 0 Hz to `base`."""
    down: StepSeconds | None = None
    """Seconds from `base` to 0 Hz, by the ramp stop."""
    base: Hertz | None = None
    """Frequency to which the times apply; absent: `hz`."""
    tolerance: Tolerance = 0.1
    """Allowed difference in seconds."""


class SpeedsStep(MotionStep, frozen=True, kw_only=True):
    """Values at several speeds, each in its limits."""

    percent: Annotated[list[StepPercent], Meta(min_length=1, max_length=20)] = field(
        default_factory=lambda: [25.0, 50.0, 75.0, 100.0]
    )
    """Speeds in percent of `hz`."""
    seconds: StepSeconds = 5.0
    """Seconds at each speed."""
    settle: StepSeconds = 20.0
    """Seconds within which each speed must be reached."""
    tolerance: Tolerance = 0.5
    """Allowed difference of the output frequency in Hz."""
    limits: dict[str, ValueLimits] = {}
    """Limits by value: motor_current, torque, motor_voltage, motor_thermal, drive_thermal."""


class StopStep(MotionStep, frozen=True, kw_only=True):
    """A stop brings the motor to standstill in time."""

    method: OrderId = "stop"
    """Command that stops the motor."""
    seconds: StepSeconds = 2.0
    """Duration of the run before the stop."""
    settle: StepSeconds = 20.0
    """Seconds within which the speed must be reached."""
    min: Tolerance = 0.0
    """Least seconds to standstill."""
    max: StepSeconds
    """Most seconds to standstill."""


class LimitStep(MotionStep, frozen=True, kw_only=True):
    """The drive limits a reference above its high speed.

    It runs at high speed first, then gets a reference that is `over` Hz higher.
    """

    over: Annotated[float, Meta(ge=0.5, le=3)] = 1.0
    """Hz above the high speed of the drive."""
    seconds: StepSeconds = 3.0
    """Seconds with that reference."""
    settle: StepSeconds = 20.0
    """Seconds within which the high speed must be reached."""
    tolerance: Annotated[float, Meta(ge=0.1, le=2)] = 0.3
    """Allowed output frequency above the high speed in Hz."""


class CommunicationLossStep(MotionStep, frozen=True, kw_only=True):
    """The drive reacts to communication loss as configured."""

    timeout: StepSeconds
    """Timeout that must be configured, in seconds."""
    reaction: str = ""
    """Reaction that must be configured, by its name; empty: any."""
    turning: bool = False
    """True to test with the motor turning."""
    settle: StepSeconds = 20.0
    """Seconds within which the speed must be reached."""


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

    format: Literal[1]
    """Format of the file."""
    name: str
    """Title of the report."""
    profile: str
    """Profile of the drive."""


def moves_motor(step: AcceptanceStep) -> bool:
    """Return True if a step runs the motor."""
    if isinstance(step, CommunicationLossStep):
        return step.turning
    return isinstance(step, MotionStep)
