"""`drivepanel prove`: does a drive react to a silent line as it is set to?"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import click

from ..running.stop_following import carried_to_rest
from ..shared.asking import may_ask, says_yes
from ..shared.drive_commands import (
    arm_drive,
    arm_option,
    complain,
    need_arming,
    watched,
)
from ..shared.errors import DIFFERENT, DRIVE_REFUSED, REFUSED_HERE, Failure
from ..shared.options import (
    Target,
    drive_options,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.output import drive_fields, print_json
from ..shared.registration import WRITING, command
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.fleet import Fleet
    from tui.session.proof.result import ProofResult

    from ..documents.document import DriveFields
    from ..documents.drive_documents import ProveDocument

ON_THE_RUN = (
    "The motor turns while it is proved: it does what is set, and may coast; a hoist falls. It is"
    " stopped when the proof ends."
)
_IN_FAULT = "It is in the fault {fault} now; `drivepanel reset` with --arm ends that."
_IN_UNNAMED_FAULT = "It is in a fault now; `drivepanel reset` with --arm ends that."
STOPPED_AFTER_PROOF_WITHIN = 60.0
"""Seconds that a motor may take to its standstill after a proof on the run."""


@command(
    "Test how a drive reacts to communication loss.", group="Run", statuses=(DIFFERENT, *WRITING)
)
@line_argument
@drive_options
@arm_option
@click.option(
    "--turning",
    is_flag=True,
    help="Test with the motor turning: a hoist load may fall.",
)
@click.option("--yes", is_flag=True, help="Skip the question of --turning.")
@click.option("--reset", is_flag=True, help="Reset the fault that the test has caused.")
@read_only_option
@json_option
def prove(
    target: Target,
    arm: bool,
    turning: bool,
    yes: bool,
    reset: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Test a drive's reaction to a communication loss, by pauses of growing length.

    Ends with 0 if it reacted as set, with 1 otherwise. In that time no other program on the line
    polls the drive. The motor is at standstill, unless --turning is passed.
    """
    need_arming(arm, "prove lets the drive trip on its communication timeout")

    async def work(opened: OpenLine) -> bool:
        async with watched(opened, target) as (fleet, console):
            if turning and not yes:
                await _ask_on_the_run(console.device)
            arm_drive(console)
            result = await _proved(fleet, console, turning, quiet=as_json)
            if reset and result.fault:
                commander = console.commander
                await carried_to_rest(fleet, console, lambda: commander.order("reset"))
            fields = drive_fields(target.line_text, console.session)
            _tell(fields, result, reset, as_json)
            return result.as_set

    if not on_line(target, work, read_only=read_only):
        raise click.exceptions.Exit(DIFFERENT)


async def _ask_on_the_run(device: int) -> None:
    """A motor that turns is left to its drive only with a yes; raises Failure without one."""
    if not may_ask():
        raise Failure(f"{ON_THE_RUN} --yes says that this is meant.", REFUSED_HERE)
    complain(ON_THE_RUN)
    if not await says_yes(f"Prove the communication loss of device {device} on the run?"):
        raise Failure("Nothing was proved.", REFUSED_HERE)


async def _proved(
    fleet: Fleet, console: DriveConsole, turning: bool, *, quiet: bool
) -> ProofResult:
    """The proof, on record; a motor that turned is stopped, whatever the end."""
    from tui.session.proof.prover import NothingToProve, Prover
    from tui.session.proof.result import proof_entry

    session = console.session
    prover = Prover(session, console.journal, session.work.permit(), turning)
    if not quiet:
        prover.report = lambda text: complain(f"Test: {text}")
    try:
        result = await prover.prove()
    except NothingToProve as error:
        raise Failure(str(error), DIFFERENT) from error
    finally:
        if turning:
            fleet.stop([session], by="the end of the proof")
            summary = await asyncio.to_thread(
                fleet.stopper.wait, [session], STOPPED_AFTER_PROOF_WITHIN
            )
            if summary.failed:
                raise Failure(f"Device {session.device}: NOT STOPPED.", DRIVE_REFUSED)
    console.journal.add(proof_entry(session, result))
    return result


def _tell(fields: DriveFields, result: ProofResult, reset: bool, as_json: bool) -> None:
    if as_json:
        print_json(prove_document(fields, result, was_reset=reset and bool(result.fault)))
        return
    say(f"Device {result.device}: {result.text}")
    if result.changed:
        say(result.changed)
    if result.fault and not reset:
        from tui.session.proof.result import UNNAMED_FAULT

        text = _IN_UNNAMED_FAULT if result.fault == UNNAMED_FAULT else _IN_FAULT
        say(text.format(fault=result.fault))


def prove_document(fields: DriveFields, result: ProofResult, *, was_reset: bool) -> ProveDocument:
    """The figures of a result, in whole ms; null where there is none."""
    from ..documents.drive_documents import ProveDocument

    bracket = result.bracket
    return ProveDocument(
        **fields,
        configured_ms=round(1000 * result.configured),
        not_before_ms=round(1000 * bracket.not_before),
        not_after_ms=_milliseconds(bracket.not_after),
        measured_ms=_milliseconds(bracket.measured),
        reaction=result.reaction.name if result.reaction else None,
        seen=result.seen or None,
        fault=result.fault or None,
        turning=result.turning,
        as_set=result.as_set,
        text=result.text,
        changed=result.changed or None,
        reset=was_reset,
    )


def _milliseconds(seconds: float | None) -> int | None:
    return None if seconds is None else round(1000 * seconds)
