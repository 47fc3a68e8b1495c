"""`drivepanel compare`: two parameter sets, of files, drives or the factory."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.completion import complete_side
from ..shared.errors import DIFFERENT, USAGE, Failure
from ..shared.line_argument import LINE_VARIABLE, named_line_of
from ..shared.options import Target, devices_option, json_option, never_forced, profile_of
from ..shared.registration import ON_LINE, command
from ..shared.say import say
from ..shared.sets import set_in, set_of_drive
from ..shared.standard_streams import STANDARD

if TYPE_CHECKING:
    from tui.drive.settings.compare import ComparedRow, TableFormat
    from tui.drive.settings.parameter_set import ParameterSet

    from ..documents.parts import ComparedSettingField

FACTORY = "factory"


@command(
    "Compare settings of files, drives or factory defaults.",
    group="Set up",
    statuses=(DIFFERENT, *ON_LINE),
)
@click.argument("a", shell_complete=complete_side)
@click.argument("b", shell_complete=complete_side, envvar=LINE_VARIABLE)
@click.option("--all", "all_rows", is_flag=True, help="Show equal settings and measurements too.")
@click.option(
    "--format",
    "format_",
    type=click.Choice(["text", "markdown", "csv"]),
    default="text",
    show_default=True,
    help="Show the table in this format.",
)
@json_option
@profile_of("Use this profile for the drives.")
@devices_option("Use the drive at this slave address; twice if A and B are two drives.")
@never_forced
def compare(
    a: str,
    b: str,
    all_rows: bool,
    format_: TableFormat,
    as_json: bool,
    profile_id: str | None,
    devices: tuple[int, ...],
) -> None:
    """Compare the settings of A and B: each a FILE, a LINE, or `factory`.

    If A is a file of recipes, each drive of the line B is compared with its own recipe.

    A FILE may be `-`: standard input.

    Measurements, counters and command words are not settings. A comparison with the factory omits
    address, baud rate and format. Ends with 0 if all are equal and with 1 if some differ.
    """
    from tui.drive.profile import library
    from tui.drive.settings.compare import compare_settings as rows_of
    from tui.drive.settings.compare import factory_side, side_of
    from tui.drive.settings.compare import rows_text as table
    from tui.drive.settings.recipes import is_recipe_file

    from ..documents.setting_documents import CompareDocument
    from ..running.recipe_comparison import compare_with_recipes
    from ..shared.output import print_json

    if is_recipe_file(Path(a)):
        if profile_id is not None:
            raise click.UsageError("The profiles are in the file of recipes: omit -p.")
        status = compare_with_recipes(
            Path(a), _target(b, None, None).line_text, devices, format_, _row_field,
            all_rows=all_rows, as_json=as_json,
        )  # fmt: skip
        raise click.exceptions.Exit(status)
    if len(devices) > 2:
        raise click.UsageError("-d is given once, or once for A and once for B.")
    places = devices or (None,)
    sets = [
        None if text == FACTORY else _set_of(text, _target(text, device, profile_id))
        for text, device in ((a, places[0]), (b, places[-1]))
    ]
    ids = {found.head.profile for found in sets if found is not None}
    if not ids:
        raise click.UsageError("One of A and B must be a file or a drive.")
    if len(ids) > 1:
        raise Failure(
            f"A and B are of different families ({', '.join(sorted(ids))}).\n"
            "'drivepanel restore --dry-run' shows which settings fit the other family.",
            USAGE,
        )
    profile = library.load(ids.pop())
    apart = a == b and len(devices) > 1
    names = (f"{a} -d {devices[0]}", f"{b} -d {devices[1]}") if apart else (a, b)
    drive = next(found for found in sets if found is not None)
    sides = [
        factory_side(profile, drive) if found is None else side_of(text, found)
        for text, found in zip(names, sets, strict=True)
    ]
    rows = rows_of(profile, *sides, all_rows=all_rows)
    if as_json:
        print_json(
            CompareDocument(
                a=names[0],
                b=names[1],
                profile=profile.id,
                equal=not any(row.differs for row in rows),
                rows=[_row_field(row) for row in rows],
            )
        )
    else:
        say(table(rows, names, format_).removesuffix("\n"), indent=3)
    if any(row.differs for row in rows):
        raise click.exceptions.Exit(DIFFERENT)


def _row_field(row: ComparedRow) -> ComparedSettingField:
    from ..documents.parts import ComparedSettingField

    return ComparedSettingField(
        code=row.code,
        name=row.name,
        group=row.group,
        a=row.a,
        b=row.b,
        raw_a=row.a_raw,
        raw_b=row.b_raw,
        differs=row.differs,
        remark=row.note or None,
    )


def _set_of(text: str, target: Target) -> ParameterSet:
    """The parameter set in a file, or that of a drive, read now."""
    path = Path(text)
    if path == STANDARD or path.is_file() or (path.suffix == ".toml" and os.path.lexists(path)):
        return set_in(path)
    if path.suffix == ".toml":
        raise Failure(f"{text} not found.", USAGE)
    return set_of_drive(target)[1]


def _target(text: str, device: int | None, profile_id: str | None) -> Target:
    """The drive of a LINE or of its name; typed options override those of the name."""
    named = named_line_of(text)
    if named is None:
        return Target(text, device or 1, profile_id)
    if device in (None, named.device):
        profile_id = profile_id or named.profile
    return Target(named.line, device or named.device or 1, profile_id)
