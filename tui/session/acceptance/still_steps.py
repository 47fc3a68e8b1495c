"""Steps at standstill: settings, references that are refused, and the reset of a fault."""

from __future__ import annotations

from tui.drive.errors import ValueRefused
from tui.drive.settings.compare import compare_settings, side_of
from tui.drive.shown import raw_of_text, shown
from tui.drive.values import NOT_AVAILABLE

from ..monitor.snapshot import Snapshot
from ..running.watching import latest_of, outcome_or_error
from .motion import StepFailed
from .result import StepResult
from .step_work import StepWork
from .steps import (
    RefusedStep,
    ResetStep,
    SettingsStep,
)

RESET_SHOWS_WITHIN = 3.0
"""Seconds within which a reset shows."""


async def check_settings(work: StepWork, step: SettingsStep, result: StepResult) -> None:
    """Compare the settings that were read before the test with a set, or with values."""
    profile, values = work.file.profile, work.before
    wanted = work.file.sets.get(result.number - 1)
    if wanted is not None:
        rows = compare_settings(profile, side_of(step.file, wanted), side_of("drive", values))
        differing = [r for r in rows if r.a_raw is not None and r.code not in step.ignore]
        for row in differing:
            result.check(f"{row.code} {row.name}", row.b, row.a, passed=False)
        if not differing:
            result.check("Settings", "all equal", step.file, passed=True)
    for code, text in step.values.items():
        raw = values.raws.get(code)
        held, same = NOT_AVAILABLE, False
        if raw is not None:
            held = shown(profile, profile[code], raw, values.raws).display
            try:
                same = raw_of_text(profile, profile[code], text, values.raws).raw == raw
            except ValueRefused as error:
                raise StepFailed(str(error)) from error
        result.check(f"{code} {profile[code].name}", held, text, passed=same)


async def check_refused(work: StepWork, step: RefusedStep, result: StepResult) -> None:
    """Check that references are refused by the limits that the drive has now; write nothing."""
    commander = work.bench.console.commander
    for reference in step.references:
        work.bench.permit()

        def check(text: str = reference) -> None:
            commander.check_run("forward", text)

        try:
            await work.bench.unless_ended(outcome_or_error(commander, check))
        except ValueRefused as error:
            result.check(f"Reference {reference}", f"refused: {error}", "refused", passed=True)
        else:
            result.check(f"Reference {reference}", "accepted", "refused", passed=False)
        finally:
            work.bench.disarm()


async def reset_fault(work: StepWork, _step: ResetStep, result: StepResult) -> None:
    """Reset the fault; the motor must not start."""
    bench = work.bench
    latest = await bench.unless_ended(_next_cycle(work))
    if latest.state.kind != "fault":
        raise StepFailed(f"There is no fault to reset: the drive is {latest.state.headline}.")
    fault = f"{latest.state.fault.code}" if latest.state.fault else "a fault"
    bench.permit()
    commander = bench.console.commander
    try:
        outcome = await bench.unless_ended(
            outcome_or_error(commander, lambda: commander.order("reset"))
        )
        latest = await bench.unless_ended(_without_fault(work))
    finally:
        bench.disarm()
    passed = latest.state.kind != "fault" and bench.at_rest(latest)
    text = latest.state.headline if passed else outcome.text
    result.check(f"Reset of {fault}", text, "at standstill, no fault", passed=passed)


async def _without_fault(work: StepWork) -> Snapshot:
    """Wait until the drive shows no fault; return the last cycle after RESET_SHOWS_WITHIN."""
    clock = work.bench.console.session.clock
    end = clock.monotonic() + RESET_SHOWS_WITHIN
    while (latest := await _next_cycle(work)).state.kind == "fault" and clock.monotonic() < end:
        pass
    return latest


async def _next_cycle(work: StepWork) -> Snapshot:
    """Wait for the second cycle from now: the first may have begun before."""
    console = work.bench.console
    begun, seen = latest_of(console).cycle, latest_of(console)
    while seen.cycle < begun + 2 or seen.error:
        await work.bench.sleep(0.02)
        seen = latest_of(console)
    return seen
