"""Acceptance test that tries a profile on a real drive without its motor."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tui.drive.profile.profile import Profile, digest_of

from .step_file import STOP_METHODS, AcceptanceFile, step_faults
from .steps import AcceptanceStep, AcceptanceTest, DirectionStep, SpeedsStep, StopStep

PROVED_HZ = 25.0
"""Highest reference: a motor that is still connected turns at half its usual speed."""
MOTOR_FIRST = "Disconnect the motor from the drive, then add --without-motor. Nothing was sent."
MAY_TRY = (
    "It gives references up to {hz:g} Hz, runs the output both ways, and sends each stop.",
    "It writes no setting, saves nothing, restores no factory settings, and changes no timeout.",
    "It trips and resets nothing. A drive that misses its motor may trip: then the test ends.",
)
"""Sentences for the person who confirms the test: its attempts, and their limits."""


def profile_test(profile: Profile, path: Path) -> AcceptanceFile:
    """Return the test of a profile; without steps if it has no command of a run.

    Steps that the profile cannot carry out are omitted.
    """
    steps = tuple(step for step in _steps(profile) if not any(step_faults(step, profile)))
    test = AcceptanceTest(format=1, name=f"Profile {profile.id}", profile=profile.id)
    return AcceptanceFile(path, test, steps, profile, {}, digest_of(profile))


def _steps(profile: Profile) -> Iterator[AcceptanceStep]:
    hz = PROVED_HZ if profile.quantity("command_frequency") is not None else None
    ids = {order.id for chart in profile.data.charts for order in chart.orders}
    if hz is not None:
        yield SpeedsStep(
            kind="speeds",
            name="Reference and feedback agree",
            hz=hz,
            percent=[20.0, 40.0, 60.0, 80.0, 100.0],
            seconds=2.0,
        )
    for direction in ("forward", "reverse"):
        yield DirectionStep(
            kind="direction", name=f"{direction} shows {direction}", direction=direction, hz=hz
        )
    for method in STOP_METHODS:
        if method in ids and method != "emergency-stop":
            name = f"{method} stops"
            yield StopStep(kind="stop", name=name, method=method, hz=hz, max=30.0)
