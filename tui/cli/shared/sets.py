"""What the commands about settings and parameter sets share."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .errors import DONE, DRIVE_REFUSED, LINE_TROUBLE, REFUSED_HERE, USAGE, Failure
from .options import Target, connect_drive, on_line
from .say import say, say_over

if TYPE_CHECKING:
    from tui.drive.settings.parameter_set import ParameterSet
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.read.upload import Upload
    from tui.session.settings.applied import Result

OUTAGE = 20.0
"""Seconds for which a read-out waits for a lost line to come back."""
SET_POLL_INTERVAL = 0.1

file_argument = click.argument("file", type=click.Path(path_type=Path))
force_option = click.option("--force", is_flag=True, help="Replace FILE where it exists.")
confirm_option = click.option(
    "--confirm",
    "confirmed",
    multiple=True,
    metavar="CODE",
    help="Write this unverified parameter too, after comparing it with the keypad.",
)
save_option = click.option(
    "--save", is_flag=True, help="Save the settings to the drive's EEPROM afterwards."
)
dry_run_option = click.option(
    "--dry-run", is_flag=True, help="Tell what would be written, and write nothing."
)


def set_in(path: Path) -> ParameterSet:
    """The parameter set in a file; raises Failure with status 2 for a bad one."""
    from tui.drive.settings.parameter_set import SetError
    from tui.drive.settings.set_file import read_set

    try:
        return read_set(path)
    except SetError as error:
        raise Failure(str(error), USAGE) from error


def refuse_existing(file: Path, *, force: bool) -> None:
    """Raise Failure with status 2 where a file would be lost; asked before the line is opened."""
    if file.exists() and not force:
        raise Failure(f"{file} is there already. Use another name, or --force.", USAGE)


def write_down(file: Path, text: str, *, force: bool = False) -> None:
    """Write a file whole or not at all; raises Failure with status 2 where that cannot be."""
    from tui.drive.settings.parameter_set import SetError
    from tui.drive.settings.set_file import write_file

    try:
        write_file(file, text, force=force)
    except SetError as error:
        raise Failure(str(error), USAGE) from error


def codes_of(session: DriveSession, names: Iterable[str]) -> frozenset[str]:
    """The codes that a person named in any notation; raises UnknownParameter."""
    return frozenset(session.profile.find(name).code for name in names)


def set_of_drive(target: Target) -> tuple[DriveSession, ParameterSet]:
    """A drive and every readable parameter of it, read now on a line that is not written to."""

    async def work(opened: OpenLine) -> tuple[DriveSession, ParameterSet]:
        session = await connect_drive(opened, target)
        return session, await take_set(session)

    return on_line(target, work, read_only=True)


async def take_set(session: DriveSession) -> ParameterSet:
    """Every readable parameter of a drive, with who it is, as far as it says so."""
    from tui.bus.errors import ExchangeError
    from tui.session.connect.identify import identify_drive
    from tui.session.read.upload import Upload

    if session.identity is None and session.profile.function(43) is not None:
        try:
            session.identity = await identify_drive(session.line, session.device)
        except ExchangeError:
            session.identity = None
    upload = Upload(session, progress=counter("Read"))
    await read_out(upload)
    return upload.parameter_set()


async def read_out(upload: Upload) -> None:
    """Read what is left of an upload; a line that is lost for a moment does not end it.

    Raises the line's errors where it does not come back.
    """
    from tui.bus.api import LineStatus
    from tui.bus.errors import LineLost

    line = upload.session.line
    while not upload.done:
        try:
            await upload.run()
        except LineLost:
            end = time.monotonic() + OUTAGE
            while line.state.status is not LineStatus.CONNECTED:
                if time.monotonic() > end:
                    raise
                await asyncio.sleep(SET_POLL_INTERVAL)


def counter(what: str) -> Callable[[int, int], None] | None:
    """Shows progress in one line of a terminal; None where nobody would see it."""
    if not sys.stderr.isatty():
        return None

    def show(done: int, of: int) -> None:
        say_over(f"{what}: {done} of {of}", last=done >= of)

    return show


def say_result(done: int, of: int, result: Result) -> None:
    """One written or refused setting: on standard output, or as an error."""
    text = f"{done}/{of}  {result.text}"
    say(text if result.done else f"drivepanel: {text}", err=not result.done)


def status_of_results(results: Iterable[Result]) -> int:
    """The exit status of a number of writes: the worst that has happened."""
    from tui.session.settings.applied import EditOutcome

    table = {
        EditOutcome.DRIVE_REFUSED: DRIVE_REFUSED,
        EditOutcome.NOT_TAKEN: DRIVE_REFUSED,
        EditOutcome.REFUSED: REFUSED_HERE,
        EditOutcome.CHANGED: REFUSED_HERE,
        EditOutcome.HELD_BACK: REFUSED_HERE,
        EditOutcome.UNKNOWN: LINE_TROUBLE,
        EditOutcome.NOT_SENT: LINE_TROUBLE,
    }
    statuses = {table[r.outcome] for r in results if r.outcome in table}
    order = (LINE_TROUBLE, DRIVE_REFUSED, REFUSED_HERE)
    return next((status for status in order if status in statuses), DONE)


def say_afterwards(after_reset: Iterable[str], unsaved: Iterable[str], *, saved: bool) -> None:
    """What a person has to know once settings are written."""
    if waiting := ", ".join(after_reset):
        say(f"In force only after the next reset of the drive: {waiting}.")
    if any(True for _ in unsaved) and not saved:
        say("Lost at power-off until they are saved: --save does that, motor stopped.")
