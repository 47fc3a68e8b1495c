"""The table of steps: how each kind is carried out, and when it has failed.

Steps that measure a motion are in a module of their own.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from types import MappingProxyType
from typing import Any

from tui.bus.errors import DeviceException, LineError
from tui.drive.errors import DriveError, ValueRefused
from tui.drive.settings.compare import compare_settings, side_of
from tui.drive.shown import raw_of_text, shown
from tui.drive.values import NOT_AVAILABLE

from ..command.access import CommandAccess
from ..command.motor_start import write_reference
from ..command.reference import convert_reference, reference_codes
from ..monitor.snapshot import Snapshot
from ..proof.prover import NothingToProve, Prover
from ..proof.result import ProofResult, proof_entry
from ..reading import with_text
from ..running.ending import MotorStopped
from ..running.watching import latest_of, outcome_or_error
from ..settings.write import NotTaken
from ..work import Permit, Task
from .motion import StepFailed
from .motion_steps import measure_ramp, measure_speeds, measure_stop, run_direction
from .plan import read_high_speed
from .result import StepResult
from .step_work import SETTLED_HERTZ, StepWork
from .steps import CommunicationLossStep, LimitStep, RefusedStep, ResetStep, SettingsStep

RESTORED_WITHIN = 10.0
"""Seconds within which a reference above the high speed is taken back."""


async def run_limit(work: StepWork, step: LimitStep, result: StepResult) -> None:
    """Give a reference above the high speed; the output frequency must stay at the high speed."""
    bench = work.bench
    found = await bench.unless_ended(read_high_speed(bench.console))
    if found is None:
        raise StepFailed("The high speed of the drive cannot be read.")
    if found != work.high_speed:
        raise StepFailed(f"{found.code} is now {found.hertz:g} Hz: another one was confirmed.")
    most, code = found
    over = f"{most + step.over:g}Hz"
    allowed = most + min(step.tolerance, step.over / 2)
    highest = 0.0
    is_above = False

    async def exceed() -> None:
        nonlocal highest, is_above
        await work.reach(most, step.settle)
        bench.curve.marks.append((bench.console.session.clock.monotonic(), over))
        # without a reply, or with an end in between, the drive may hold it
        is_above = True
        if refusal := await _reference_above(work, over):
            is_above = False
            result.check(f"Reference {over}", refusal, "refused or limited", passed=True)
            return
        clock = bench.console.session.clock
        end = clock.monotonic() + step.seconds
        while clock.monotonic() < end:
            latest = latest_of(bench.console)
            highest = max(highest, bench.hertz(latest) or 0.0)
            if highest > allowed:
                break
            await bench.sleep(0.02)
        else:
            await bench.refer(most)
            is_above = False
        # a motor that slowed down, or was not read, shows nothing about the limit
        passed = most - SETTLED_HERTZ <= highest <= allowed
        text = f"{most:g} Hz ({code}), at most {allowed:g} Hz"
        result.check(f"Output with {over}", f"{highest:.1f} Hz", text, passed=passed)

    try:
        await work.run(most, exceed, result)
    finally:
        if is_above and (failed := await _restore_reference(work, most)):
            text = f"{most:g} Hz again"
            result.check("Reference after the step", f"perhaps still {over}", text, passed=False)
            bench.warn(
                f"The drive may still hold the reference {over}: {failed}\n"
                f"Give it a reference of at most {most:g} Hz before its motor is started."
            )


async def _restore_reference(work: StepWork, hz: float) -> str:
    """Give the drive a reference within its limit again, also after the end of the test.

    Writes nothing if the drive holds one within its limit already: another source may have given
    it. Returns why it failed; empty if it did not.
    """
    bench = work.bench
    try:
        bench.permit(after_end=True)
        async with asyncio.timeout(RESTORED_WITHIN):
            held = await _held_reference(work)
            if held is None or held > hz:
                await bench.refer(hz)
    except TimeoutError:
        return f"nothing was written within {RESTORED_WITHIN:g} s."
    except (DriveError, LineError) as error:
        return str(error)
    finally:
        bench.disarm()
    return ""


async def _held_reference(work: StepWork) -> float | None:
    """Return the reference in Hz that the drive holds, without its sign; None if unknown."""
    console = work.bench.console
    parameter = console.session.profile.quantity("command_frequency")
    if parameter is None or parameter.access == "w":
        return None
    number = with_text(await console.read([parameter.code]))[parameter.code].number
    return None if number is None else abs(number)


async def _reference_above(work: StepWork, text: str) -> str:
    """Write a reference above the limit of the drive; return its refusal, or nothing.

    This is the one write beyond a limit: the test file names it, and the person has confirmed it.
    """
    console = work.bench.console
    session = console.session

    async def write(permit: Permit) -> str:
        access = CommandAccess(session, console.journal, permit, console.commander.given)
        readings = await access.read(reference_codes(session.profile))
        return await write_reference(access, convert_reference(session.profile, text, readings))

    def give() -> None:
        session.work.put(Task(write, owner=console.commander))

    try:
        await outcome_or_error(console.commander, give)
    except (DeviceException, NotTaken) as error:
        return f"refused by the drive: {error}"
    return ""


async def run_loss(work: StepWork, step: CommunicationLossStep, result: StepResult) -> None:
    """Test the communication timeout by pauses in polling, at standstill or turning."""
    proof: ProofResult | None = None
    bench = work.bench
    session = bench.console.session

    async def prove(permit: Permit) -> None:
        nonlocal proof
        prover = Prover(session, bench.console.journal, permit, step.turning)
        prover.report = bench.say
        bench.pause_watch()
        try:
            proof = await prover.prove()
        except NothingToProve as error:
            raise StepFailed(str(error)) from error
        finally:
            bench.resume_watch()

    if step.turning:

        async def turning() -> None:
            await work.reach(step.hz, step.settle)
            await prove(session.work.permit())

        try:
            await work.run(step.hz, turning, result)
        except MotorStopped:
            if proof is None:
                raise
    else:
        try:
            await bench.unless_ended(prove(bench.permit()))
        finally:
            bench.disarm()
    if proof is not None:
        _check_proof(step, proof, result)
        bench.console.journal.add(proof_entry(session, proof))


def _check_proof(step: CommunicationLossStep, proof: ProofResult, result: StepResult) -> None:
    same = abs(proof.configured - step.timeout) < 0.005
    result.check("Timeout", f"{proof.configured:g} s", f"{step.timeout:g} s", passed=same)
    if step.reaction:
        name = proof.reaction.name if proof.reaction else NOT_AVAILABLE
        result.check("Reaction", name, step.reaction, passed=name == step.reaction)
    result.check("Communication loss", proof.text, "as configured", passed=proof.as_set)


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


STEP_WORK: Mapping[str, Callable[[StepWork, Any, StepResult], Awaitable[None]]] = MappingProxyType(
    {
        "settings": check_settings,
        "refused": check_refused,
        "direction": run_direction,
        "ramp": measure_ramp,
        "speeds": measure_speeds,
        "stop": measure_stop,
        "limit": run_limit,
        "communication-loss": run_loss,
        "reset": reset_fault,
    }
)


async def carry_out_step(work: StepWork, result: StepResult) -> None:
    """Carry out a step; its checks go into the result.

    Raises StepFailed if a check is outside its limit, AcceptanceEnded, and errors.
    """
    await STEP_WORK[result.step.kind](work, result.step, result)
    if failed := [check.text for check in result.checks if not check.passed]:
        raise StepFailed(" ".join(failed))
