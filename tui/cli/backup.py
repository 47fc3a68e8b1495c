"""`drivepanel backup`: every readable parameter of a drive into a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .errors import USAGE, Failure, told
from .options import Target, connect, device_option, line_argument, on_line
from .sets import counter, read_out

if TYPE_CHECKING:
    from tui.drive.parameter_set import ParameterSet
    from tui.session.drive_session import DriveSession
    from tui.session.lines import OpenLine

profile_option = click.option(
    "-p", "--profile", "profile_id", metavar="ID", help="Profile of the drive."
)


async def take_set(session: DriveSession) -> ParameterSet:
    """Every readable parameter of a drive, with who it is, as far as it says so."""
    from tui.bus.errors import ExchangeError
    from tui.session.identify import identify
    from tui.session.upload import Upload

    if session.identity is None and session.profile.function(43) is not None:
        try:
            session.identity = await identify(session.line, session.device)
        except ExchangeError:
            session.identity = None
    upload = Upload(session, progress=counter("Read"))
    await read_out(upload)
    return upload.parameter_set()


@click.command()
@line_argument
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Replace FILE where it exists.")
@profile_option
@device_option
@told
def backup(line_text: str, file: Path, force: bool, profile_id: str | None, device: int) -> None:
    """Write every readable parameter of a drive to FILE, one line a parameter.

    The file is TOML, made for a diff. To change a value by hand, write it into `value` and take
    `raw` out of that line.
    """
    from tui.drive.parameter_set import SetError, dumps
    from tui.drive.set_file import write_file

    target = Target(line_text, device, profile_id)
    if file.exists() and not force:
        raise Failure(f"{file} is there already. Use another name, or --force.", USAGE)

    async def work(opened: OpenLine) -> tuple[DriveSession, ParameterSet]:
        session = await connect(opened, target)
        return session, await take_set(session)

    session, values = on_line(line_text, work, read_only=True)
    try:
        write_file(file, dumps(session.profile, values), force=force)
    except SetError as error:
        raise Failure(str(error), USAGE) from error
    click.echo(f"{file}: {len(values.raws)} parameters of {session.profile.name}")
    for code, why in values.absent.items():
        click.echo(f"drivepanel: {code} could not be read: {why}", err=True)
