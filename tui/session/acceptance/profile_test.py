"""Acceptance test that tries a profile on a real drive without its motor."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from tui.drive.orders import chart_in_force
from tui.drive.profile.evidence import command_statement, finding_name
from tui.drive.profile.profile import Profile, digest_of
from tui.drive.profile.schema import Chart, EvidenceFinding, EvidenceResult, EvidenceSubject

from ..drive import DriveSession
from .result import AcceptanceResult, StepResult
from .step_file import STOP_METHODS, AcceptanceFile, step_faults
from .steps import (
    AcceptanceStep,
    AcceptanceTest,
    DirectionStep,
    ResetStep,
    SpeedsStep,
    StopStep,
)

PROVED_HZ = 25.0
"""Highest reference: a motor that is still connected turns at half its usual speed."""
MOTOR_FIRST = "Disconnect the motor from the drive, then add --without-motor. Nothing was sent."
MAY_TRY = (
    "It gives references up to {hz:g} Hz, runs the output both ways, and sends each stop.",
    "It writes no setting, saves nothing, restores no factory settings, and changes no timeout.",
    "It trips nothing. A drive that misses its motor may trip: then the test ends.",
    "If the drive is in fault now, the first step resets it. The output must then stay off.",
    "If the test is carried out to its end, each command that worked is proved on this site.",
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


def with_reset(test: AcceptanceFile) -> AcceptanceFile:
    """Return the test of a drive that is in fault: the first step resets it, if it can."""
    ids = {order.id for chart in test.profile.data.charts for order in chart.orders}
    if "reset" not in ids:
        return test
    return replace(test, steps=(ResetStep(kind="reset", name="reset ends the fault"), *test.steps))


def command_findings(session: DriveSession, result: AcceptanceResult) -> list[EvidenceFinding]:
    """Return what the test of a profile has shown about its commands and its reference.

    Nothing is confirmed unless the test was carried out to its end, the stop worked, and the
    settings of the drive are the same as before.
    """
    profile = session.family
    chart = chart_in_force(profile, session.image.raws)
    if chart is None:
        return []
    statement = command_statement(profile.data)
    whole = not result.ended_by and result.settings_hash == result.settings_after
    whole = whole and any(
        isinstance(s.step, StopStep) and s.step.method == "stop" and s.outcome == "passed"
        for s in result.steps
    )
    return [
        EvidenceFinding(
            subject=subject,
            name=name,
            statement=statement,
            result=_shown(step, whole=whole),
            seen=" ".join(check.text for check in step.checks if check.limit) or step.text,
        )
        for step in result.steps
        if (found := _tested(profile, chart, step.step)) is not None
        for subject, name in [found]
    ]


def _tested(
    profile: Profile, chart: Chart, step: AcceptanceStep
) -> tuple[EvidenceSubject, str] | None:
    """Return what a step tests; None if several commands of the chart have that id."""
    if isinstance(step, SpeedsStep):
        reference = profile.quantity("command_frequency")
        return None if reference is None else ("reference", reference.code)
    id = "reset"
    if isinstance(step, DirectionStep):
        id = step.direction
    elif isinstance(step, StopStep):
        id = step.method
    same = [order for order in chart.orders if order.id == id]
    return ("command", finding_name(chart, same[0].id)) if len(same) == 1 else None


def _shown(step: StepResult, *, whole: bool) -> EvidenceResult:
    """Return the result of a step; a step that a line error ended contradicts nothing."""
    if step.outcome == "passed":
        return "confirmed" if whole else "open"
    return "contradicted" if any(not check.passed for check in step.checks) else "open"
