"""Steps that provoke the drive: a reference above its high speed, and communication loss."""

from __future__ import annotations

from tui.bus.errors import DeviceException
from tui.drive.values import NOT_AVAILABLE

from ..command.access import CommandAccess
from ..command.motor_start import write_reference
from ..command.reference import convert_reference, reference_codes
from ..proof.prover import NothingToProve, Prover
from ..proof.result import ProofResult, proof_entry
from ..running.errors import MotorStopped
from ..running.watching import latest_of, outcome_or_error
from ..settings.write import NotTaken
from ..work import Permit, Task
from .high_speed import read_high_speed
from .motion import StepFailed
from .result import StepResult
from .step_work import SETTLED_HERTZ, StepWork
from .steps import (
    CommunicationLossStep,
    LimitStep,
)


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

    async def exceed() -> None:
        nonlocal highest
        await work.reach(most, step.settle)
        bench.curve.marks.append((bench.console.session.clock.monotonic(), over))
        if refusal := await _reference_above(work, over):
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
        # a motor that slowed down, or was not read, shows nothing about the limit
        passed = most - SETTLED_HERTZ <= highest <= allowed
        text = f"{most:g} Hz ({code}), at most {allowed:g} Hz"
        result.check(f"Output with {over}", f"{highest:.1f} Hz", text, passed=passed)

    await work.run(most, exceed, result)
    if highest > allowed:
        await _restore_reference(work, most)


async def _restore_reference(work: StepWork, hz: float) -> None:
    """Give the drive a reference within its limit again, with its motor at standstill."""
    work.bench.permit()
    try:
        await work.bench.unless_ended(work.bench.refer(hz))
    finally:
        work.bench.disarm()


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
