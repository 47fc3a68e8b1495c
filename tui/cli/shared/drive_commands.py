"""Shared parts of commands to drives: arming, watching, results."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING

import click

from tui.drive.orders import OrderRefused
from tui.drive.sentences import counted
from tui.session.work import Outcome, OutcomeKind, Permit

from .errors import REFUSED_HERE, Failure, note_journal, status_of
from .options import Target, connect_drive
from .say import say
from .typed import refuse_if_stopped

if TYPE_CHECKING:
    from tui.session.command.commander import Commander
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.journal import Journal
    from tui.session.starts.keeper import StartKeeper

arm_option = click.option(
    "--arm", is_flag=True, help="Arm the drive for this command. Required for writing."
)


def complain(text: str) -> None:
    """Report on standard error; a closed stream does not interrupt the command."""
    with suppress(OSError):
        say(f"drivepanel: {text}", err=True)


def journal_document() -> Journal:
    """A journal that reports its errors immediately, on standard error."""
    from tui.session.journal import Journal

    journal = Journal(on_trouble=lambda trouble: complain(f"{trouble} The command goes on."))
    note_journal(journal)
    return journal


_UNKEPT = ("1 entry is not in the journal.", "{count} entries are not in the journal.")
_UNKEPT_SILENT_DISK = (
    "1 entry is not in the journal: the disk does not answer: {path}.",
    "{count} entries are not in the journal: the disk does not answer: {path}.",
)


def close_journal(journal: Journal) -> None:
    """Close the journal, and say what is not on record: nothing is lost unsaid."""
    if not journal.close() and (unkept := journal.unkept):
        texts = _UNKEPT if journal.trouble else _UNKEPT_SILENT_DISK
        complain(counted(unkept, *texts, path=journal.path))


@asynccontextmanager
async def watched(
    opened: OpenLine, target: Target, starts: StartKeeper | None = None
) -> AsyncIterator[tuple[Fleet, DriveConsole]]:
    """Yield the drive, monitored and kept alive, once its state is known.

    `starts` records the starts of its motor. Raises LineError without an answer, and the errors of
    `connect_drive`.
    """
    from tui.session.fleet import Fleet
    from tui.session.running.watching import WATCH_PERIOD, first_cycle

    from .drive_status import shown_codes

    session = await connect_drive(opened, target)
    journal = journal_document()
    # the motors of a simulated line end with it
    fleet = Fleet(opened.line, journal, None if opened.simulation else starts)
    console = fleet.take(session)
    console.monitor.start(period=WATCH_PERIOD, extra=shown_codes(session.profile))
    try:
        await first_cycle(console)
        yield fleet, console
    finally:
        fleet.forget()
        close_journal(journal)
        if starts is not None:
            starts.close()


def permit_of(session: DriveSession) -> Permit:
    """The right to write to a drive for as long as this command lasts; --arm was given.

    Raises OrderRefused on a read-only line, Failure where the drive was stopped since.
    """
    session.arming.arm(seconds=math.inf)
    refuse_if_stopped(session)
    return session.work.permit()


def arm_drive(console: DriveConsole) -> None:
    """Let commands to a drive through for as long as this command lasts.

    Raises OrderRefused, and Failure where the drive was stopped since this command was typed.
    """
    latest = console.latest
    if latest is None or latest.error or latest.state.kind == "unknown":
        raise OrderRefused("The state of the drive is not known; nothing is commanded.")
    console.session.arming.arm(seconds=math.inf)
    refuse_if_stopped(console.session)


async def carried_out(commander: Commander, give: Callable[[], None]) -> Outcome:
    """Give a command and wait for its result.

    Raises OrderRefused if it is not begun. Raises Failure if it is refused: status 5 by Drive
    Panel, 4 by the drive, 3 without an answer.
    """
    from tui.session.running.watching import outcome_of

    outcome = await outcome_of(commander, give)
    if outcome is None:
        raise Failure("Not sent: superseded by a newer command.", REFUSED_HERE)
    if outcome.kind is OutcomeKind.REFUSED:
        text = outcome.text + _way_on(outcome.error)
        raise Failure(text, _status(outcome.error)) from outcome.error
    return outcome


def _way_on(error: Exception | None) -> str:
    """Return how to unblock a refused command, if possible."""
    from tui.session.starts.record import StartNotRecorded, StartOvertaken

    refused = isinstance(error, StartNotRecorded) and not isinstance(error, StartOvertaken)
    return " Use --unrecorded to run it anyway." if refused else ""


def _status(error: Exception | None) -> int:
    return REFUSED_HERE if error is None else status_of(error) or REFUSED_HERE


def need_arming(arm: bool, does: str) -> None:
    """Raise Failure without --arm; `does` is the effect of the command on the drive."""
    if not arm:
        raise Failure(
            f"Not armed: {does}.\n--arm lets this one command write to this one drive. Check the"
            " machine, then repeat the command with --arm.",
            REFUSED_HERE,
        )
