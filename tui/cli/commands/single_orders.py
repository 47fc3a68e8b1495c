"""`drivepanel reference` and `reset`: one command to a drive."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Literal

import click

from tui.bus.errors import LineError
from tui.drive.fault_reset import not_in_command, reset_codes, reset_follows
from tui.drive.sentences import MAY_START
from tui.session.clock import patience
from tui.session.running.watching import COMMAND_POLL_INTERVAL, latest_of

from ..running.stop_following import carried_to_rest
from ..shared.drive_commands import (
    arm_drive,
    arm_option,
    need_arming,
    watched,
)
from ..shared.errors import DRIVE_REFUSED, LINE_TROUBLE, Failure
from ..shared.options import (
    Target,
    drive_options,
    json_option,
    line_argument,
    never_forced,
    on_line,
    read_only_option,
)
from ..shared.registration import WRITING, command
from ..shared.say import Messages

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.fleet import Fleet
    from tui.session.work import Outcome

    from ..documents.document import DriveFields

FAULT_GONE_WITHIN = 3.0
"""Seconds that a drive may take to leave its fault after a reset, on a quick line."""


def _ordered(
    command: Literal["reference", "reset"],
    target: Target,
    read_only: bool,
    work: Callable[[Fleet, DriveConsole, Messages], Coroutine[Any, Any, str]],
    *,
    as_json: bool,
) -> None:
    """Do the work at the armed drive and print its result."""
    from ..documents.drive_documents import CommandDocument
    from ..shared.output import drive_fields, print_json

    messages = Messages(as_json=as_json)

    async def at_console(opened: OpenLine) -> tuple[DriveFields, str]:
        async with watched(opened, target) as (fleet, console):
            arm_drive(console)
            text = await work(fleet, console, messages)
            messages.tell(text)
            return drive_fields(target.line_text, console.session), text

    fields, text = on_line(target, at_console, read_only=read_only)
    if as_json:
        print_json(CommandDocument(command=command, **fields, text=text, messages=messages.texts))


@command("Set a drive's reference.", group="Run", statuses=WRITING, acts=True)
@line_argument
@click.argument("text", metavar="REFERENCE")
@drive_options
@arm_option
@read_only_option
@json_option
@never_forced
def reference(
    target: Target,
    text: str,
    arm: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Set a drive's reference: 30, 30.5Hz, 900rpm. Starts no motor."""
    need_arming(arm, "reference writes the drive's reference; a running motor follows it")

    async def work(fleet: Fleet, console: DriveConsole, _: Messages) -> str:
        outcome = await carried_to_rest(fleet, console, lambda: console.commander.refer(text))
        return outcome.text

    _ordered("reference", target, read_only, work, as_json=as_json)


@command(
    "Reset a drive's fault.",
    group="Run",
    statuses=WRITING,
    acts=True,
    help=f"Reset a drive's fault. Its cause must be removed first.\n\n{MAY_START}",
)
@line_argument
@drive_options
@arm_option
@read_only_option
@json_option
@never_forced
def reset(
    target: Target,
    arm: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    need_arming(arm, "reset writes the drive's command word and ends its fault")

    async def work(fleet: Fleet, console: DriveConsole, messages: Messages) -> str:
        if latest_of(console).state.kind == "fault":
            messages.tell(await _follows(console))
        commander = console.commander
        outcome = await carried_to_rest(fleet, console, lambda: commander.order("reset"))
        await _out_of_fault(console, outcome)
        name, _, came = outcome.text.partition(":")
        now = came.partition(";")[2]
        return f"{name}. State: {latest_of(console).state.headline}{';' * bool(now)}{now}"

    _ordered("reset", target, read_only, work, as_json=as_json)


async def _follows(console: DriveConsole) -> str:
    """The motor's reaction to the reset, with the inputs that are closed now."""
    profile, current = console.session.profile, {}
    with suppress(LineError):  # what cannot be read is reported as not read
        found = await console.read(reset_codes(profile))
        current = {code: r.raw for code, r in found.items() if r.raw is not None}
    return reset_follows(profile, {**console.session.image.raws, **current}, current)


async def _out_of_fault(console: DriveConsole, outcome: Outcome) -> None:
    """Wait until the drive shows no fault any more; raises Failure where it stays in it."""
    end = outcome.time + patience(console.session.line, FAULT_GONE_WITHIN)
    while True:
        latest = latest_of(console)
        fresh = latest.time > outcome.time and not latest.error
        if fresh and latest.state.kind not in ("fault", "unknown", "starting"):
            return
        if latest.time > end:
            break
        await asyncio.sleep(COMMAND_POLL_INTERVAL)
    if latest.error:
        raise Failure(latest.error, LINE_TROUBLE)
    if why := not_in_command(console.session.profile, console.session.image.raws):
        raise Failure(why, DRIVE_REFUSED)
    raise Failure(
        f"The drive stays in {latest.state.headline}: its cause is not gone. Check the machine.",
        DRIVE_REFUSED,
    )
