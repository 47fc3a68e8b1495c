"""`drivepanel reference` and `reset`, and what every command that gives orders needs."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any

import click

from tui.drive.orders import OrderRefused, chart_in_force, follows_from
from tui.session.work import Outcome, OutcomeKind

from ..shared.errors import DRIVE_REFUSED, LINE_TROUBLE, REFUSED_HERE, Failure, status_of, told
from ..shared.left_alone import left_alone_of
from ..shared.options import (
    Target,
    connect_drive,
    drive_options,
    line_argument,
    never_forced,
    on_line,
    read_only_option,
)
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.command.commander import Commander
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.journal import Journal
    from tui.session.monitor.snapshot import Snapshot
    from tui.session.monitor.timeout import TimeoutWatch
    from tui.session.starts.keeper import StartKeeper
    from tui.session.work import Permit

COMMAND_POLL_INTERVAL = 0.02
"""Seconds between two looks at what the line's thread has come to."""
PERIOD = 0.25
"""Wished time of a cycle of the monitor in seconds."""
FIRST_TRIES = 3
"""Cycles that may fail before the drive counts as silent."""
LEARNT_WITHIN = 3.0
"""Seconds in which a drive's watch over the line is read."""
FAULT_GONE_WITHIN = 3.0
"""Seconds that a drive may take to leave its fault after a reset."""

arm_option = click.option(
    "--arm", is_flag=True, help="Let this command write to the drive; without it nothing is."
)


def complain(text: str) -> None:
    """Say something on standard error, if anybody is there: what is under way goes on."""
    with suppress(OSError):
        say(f"drivepanel: {text}", err=True)


def close_journal(journal: Journal) -> None:
    """Close the journal, and say what keeps it from being written: nothing is lost unsaid."""
    if not journal.close() and journal.trouble:
        complain(journal.trouble)


def moved(journal: Journal) -> bool:
    """Whether a command was sent, answered or not; a reference alone moves nothing."""
    return any(not entry.why.startswith("reference") for entry in journal.recent)


def latest_of(console: DriveConsole) -> Snapshot:
    """The last cycle of a drive that is watched."""
    latest = console.latest
    assert latest is not None, "a console is handed out after the first cycle"
    return latest


@asynccontextmanager
async def watched(
    opened: OpenLine, target: Target, starts: StartKeeper | None = None
) -> AsyncIterator[tuple[Fleet, DriveConsole]]:
    """The wanted drive, watched and fed, its state known; `starts` records those of its motor.

    Raises Failure where it does not answer, and what `connect` raises.
    """
    from tui.session.fleet import Fleet
    from tui.session.journal import Journal

    from .status import shown_codes

    session = await connect_drive(opened, target)
    journal = Journal()
    # the motors of a simulated line end with it
    fleet = Fleet(opened.line, journal, None if opened.simulation else starts)
    console = fleet.take(session)
    console.monitor.start(period=PERIOD, extra=shown_codes(session.profile))
    try:
        await _first_look(console)
        yield fleet, console
    finally:
        left_alone_of(opened, session).found = fleet.line_watch.timeout(session.device)
        fleet.forget()
        close_journal(journal)
        if starts is not None:
            starts.close()


async def _first_look(console: DriveConsole) -> None:
    while True:
        latest = console.latest
        if latest is not None and not latest.error:
            return
        if latest is not None and latest.cycle >= FIRST_TRIES:
            raise Failure(latest.error, LINE_TROUBLE)
        await asyncio.sleep(COMMAND_POLL_INTERVAL)


def permit_of(session: DriveSession) -> Permit:
    """The right to write to a drive for as long as this command lasts; --arm was given.

    Raises OrderRefused on a read-only line.
    """
    session.arming.arm(seconds=math.inf)
    return session.work.permit()


def arm_drive(console: DriveConsole) -> None:
    """Let commands to a drive through for as long as this command lasts. Raises OrderRefused."""
    latest = console.latest
    if latest is None or latest.error or latest.state.kind == "unknown":
        raise OrderRefused("The state of the drive is not known; nothing is commanded.")
    console.session.arming.arm(seconds=math.inf)


async def carried_out(commander: Commander, give: Callable[[], None]) -> Outcome:
    """Give an order and wait for what becomes of it.

    Raises OrderRefused where it is not even begun; Failure where it is refused, with the status
    of who refused it: 5 here, 4 the drive, 3 no answer.
    """
    work = commander.session.work
    before = work.outcome
    give()
    await _until(lambda: work.outcome is not before or not work.busy_for(commander))
    outcome = work.outcome if work.outcome is not before else None
    if outcome is None:
        raise Failure("The order was not sent: a newer one took its place.", REFUSED_HERE)
    if outcome.kind is OutcomeKind.REFUSED:
        raise Failure(outcome.text + _way_on(outcome.error), _status(outcome.error))
    return outcome


def _way_on(error: Exception | None) -> str:
    """What lets a command through that was refused, where something does."""
    from tui.session.starts.starts import StartNotRecorded, StartOvertaken

    refused = isinstance(error, StartNotRecorded) and not isinstance(error, StartOvertaken)
    return " --unrecorded runs it all the same." if refused else ""


async def _until(holds: Callable[[], bool]) -> None:
    """Look until something holds that the line's thread brings about."""
    while True:
        if holds():
            return
        await asyncio.sleep(COMMAND_POLL_INTERVAL)


def _status(error: Exception | None) -> int:
    return REFUSED_HERE if error is None else status_of(error) or REFUSED_HERE


def need_arming(arm: bool, does: str) -> None:
    """Raise Failure where --arm was not given; `does` says what the command does to the drive."""
    if not arm:
        raise Failure(
            f"Not armed: {does}.\n--arm lets this one command write to this one drive. Look at the"
            " machine first, then add it.",
            REFUSED_HERE,
        )


async def watch_of(fleet: Fleet, console: DriveConsole) -> TimeoutWatch | None:
    """A kept drive's watch over the line; None where it has none, or it is off.

    Raises Failure where it could not be learnt.
    """
    rules = console.session.profile.data.communication_fault
    if rules is None or not rules.timeout:
        return None
    readings = await console.read([rules.timeout])
    raw = readings[rules.timeout].raw
    if raw is None or raw in (rules.off, 0):
        return None
    end = asyncio.get_running_loop().time() + LEARNT_WITHIN
    while (watch := fleet.line_watch.watch(console.device)) is None:
        if asyncio.get_running_loop().time() > end:
            raise Failure(f"{rules.timeout} is set and could not be learnt.", LINE_TROUBLE)
        await asyncio.sleep(COMMAND_POLL_INTERVAL)
    return watch


def _ordered(
    target: Target, read_only: bool, work: Callable[[DriveConsole], Coroutine[Any, Any, str]]
) -> None:
    """Do the work at the armed drive and print what it came to."""

    async def at_console(opened: OpenLine) -> None:
        async with watched(opened, target) as (_, console):
            arm_drive(console)
            say(await work(console))

    on_line(target, at_console, read_only=read_only)


@click.command()
@line_argument
@click.argument("text", metavar="REFERENCE")
@drive_options
@arm_option
@read_only_option
@never_forced
@told
def reference(
    target: Target,
    text: str,
    arm: bool,
    read_only: bool,
) -> None:
    """Give a drive its reference: 30, 30.5Hz, 900rpm. Starts no motor."""
    need_arming(arm, "reference writes the drive's reference; a running motor follows it")

    async def work(console: DriveConsole) -> str:
        commander = console.commander
        return (await carried_out(commander, lambda: commander.refer(text))).text

    _ordered(target, read_only, work)


@click.command()
@line_argument
@drive_options
@arm_option
@read_only_option
@never_forced
@told
def reset(
    target: Target,
    arm: bool,
    read_only: bool,
) -> None:
    """Reset a drive's fault. Its cause must be gone.

    It commands no run; a run command that waits at the terminals may start the motor.
    """
    need_arming(arm, "reset writes the drive's command word and ends its fault")

    async def work(console: DriveConsole) -> str:
        session = console.session
        chart = chart_in_force(session.profile, session.image.raws)
        if chart is not None and (besides := follows_from(chart, "reset")):
            say(besides)
        outcome = await carried_out(console.commander, lambda: console.commander.order("reset"))
        await _out_of_fault(console, outcome)
        name, _, came = outcome.text.partition(":")
        now = came.partition(";")[2]
        return f"{name}: {latest_of(console).state.headline}{';' * bool(now)}{now}"

    _ordered(target, read_only, work)


async def _out_of_fault(console: DriveConsole, outcome: Outcome) -> None:
    """Wait until the drive shows no fault any more; raises Failure where it stays in it."""
    end = outcome.time + FAULT_GONE_WITHIN
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
    raise Failure(
        f"The drive stays in {latest.state.headline}: its cause is not gone. Look at the machine.",
        DRIVE_REFUSED,
    )
