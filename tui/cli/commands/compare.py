"""`drivepanel compare`: two parameter sets, of files, drives or the factory."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.errors import DIFFERENT, USAGE, Failure, told
from ..shared.options import Target, devices_option
from ..shared.say import say
from ..shared.sets import set_in, set_of_drive

if TYPE_CHECKING:
    from tui.drive.settings.compare import TableFormat
    from tui.drive.settings.parameter_set import ParameterSet

FACTORY = "factory"


@click.command()
@click.argument("a")
@click.argument("b")
@click.option("--all", "all_rows", is_flag=True, help="Show equal and measured ones too.")
@click.option(
    "--format",
    "format_",
    type=click.Choice(["text", "markdown", "csv"]),
    default="text",
    show_default=True,
    help="Form of the table.",
)
@click.option("-p", "--profile", "profile_id", metavar="ID", help="Profile of the drives.")
@devices_option("Slave address of the drive; twice where A and B are two drives.")
@told
def compare(
    a: str,
    b: str,
    all_rows: bool,
    format_: TableFormat,
    profile_id: str | None,
    devices: tuple[int, ...],
) -> None:
    """Compare the settings of A and B: each a FILE, a LINE, or `factory`.

    Measurements, counters and orders are no settings. Ends with 0 where all are equal and with 1
    where some differ.
    """
    from tui.drive.profile import library
    from tui.drive.settings.compare import compare_settings as rows_of
    from tui.drive.settings.compare import factory_side, side_of
    from tui.drive.settings.compare import rows_text as table

    if len(devices) > 2:
        raise click.UsageError("-d is given once, or once for A and once for B.")
    places = devices or (1,)
    sets = [
        None if text == FACTORY else _set_of(text, Target(text, device, profile_id))
        for text, device in ((a, places[0]), (b, places[-1]))
    ]
    ids = {found.head.profile for found in sets if found is not None}
    if not ids:
        raise click.UsageError("One of A and B must be a file or a drive.")
    if len(ids) > 1:
        raise Failure(
            f"A and B are of different families ({', '.join(sorted(ids))}).\n'drivepanel restore"
            " --dry-run' tells what can be carried from one to the other.",
            USAGE,
        )
    profile = library.load(ids.pop())
    drive = next(found for found in sets if found is not None)
    sides = [
        factory_side(profile, drive) if found is None else side_of(text, found)
        for text, found in zip((a, b), sets, strict=True)
    ]
    rows = rows_of(profile, *sides, all_rows=all_rows)
    say(table(rows, (a, b), format_).removesuffix("\n"))
    if any(row.differs for row in rows):
        raise click.exceptions.Exit(DIFFERENT)


def _set_of(text: str, target: Target) -> ParameterSet:
    """The parameter set in a file, or that of a drive, read now."""
    path = Path(text)
    if path.is_file() or (path.suffix == ".toml" and os.path.lexists(path)):
        return set_in(path)
    if path.suffix == ".toml":
        raise Failure(f"{text} is not there.", USAGE)
    return set_of_drive(target)[1]
