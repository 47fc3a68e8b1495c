"""`drivepanel report`: identity, settings and journal of a drive as Markdown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .backup import profile_option, take_set
from .errors import USAGE, Failure, told
from .options import Target, connect, device_option, line_argument, on_line

if TYPE_CHECKING:
    from tui.drive.parameter_set import ParameterSet
    from tui.session.drive_session import DriveSession
    from tui.session.lines import OpenLine


@click.command()
@line_argument
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Replace FILE where it exists.")
@profile_option
@device_option
@told
def report(line_text: str, file: Path, force: bool, profile_id: str | None, device: int) -> None:
    """Write a report on a drive to FILE, as Markdown.

    What it is, its line settings, settings changed from the factory, who commands it, scanner,
    what it does on a silent line, its faults, and what was written to it from here.
    """
    from tui.drive.parameter_set import SetError
    from tui.drive.set_file import write_file
    from tui.session.journal import Journal
    from tui.session.report import entries_of
    from tui.session.report import report as text_of

    target = Target(line_text, device, profile_id)
    if file.exists() and not force:
        raise Failure(f"{file} is there already. Use another name, or --force.", USAGE)

    async def work(opened: OpenLine) -> tuple[DriveSession, ParameterSet]:
        session = await connect(opened, target)
        return session, await take_set(session)

    session, values = on_line(line_text, work, read_only=True)
    entries = entries_of(Journal(), session.line_text, device)
    try:
        write_file(file, text_of(session.profile, values, entries), force=force)
    except SetError as error:
        raise Failure(str(error), USAGE) from error
    click.echo(f"{file}: report on {session.profile.name} at address {device}")
