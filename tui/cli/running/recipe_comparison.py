"""Comparison of the drives of a line with their recipes, for `compare`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tui.drive.sentences import counted, first_of

from ..documents.setting_documents import RecipeDriveField, RecipesDocument
from ..shared.errors import DIFFERENT, DONE, LINE_TROUBLE, USAGE, Failure
from ..shared.options import Target, connect_drive, on_line
from ..shared.output import print_json
from ..shared.say import say
from ..shared.sets import take_set

if TYPE_CHECKING:
    from tui.drive.settings.compare import ComparedRow, TableFormat
    from tui.drive.settings.recipes import DriveRecipe
    from tui.session.connect.open_line import OpenLine

    from ..documents.parts import ComparedSettingField

RowField = Callable[["ComparedRow"], "ComparedSettingField"]
LEFT_TO_DRIVES = "   Not compared, because it belongs to the set of a drive: {codes}."
CODES_LISTED = 12
DIFFERS = ("Drive {device}: differs in 1.", "Drive {device}: differs in {count}.")


def compare_with_recipes(
    file: Path,
    line: str,
    devices: Sequence[int],
    format_: TableFormat,
    row_field: RowField,
    *,
    all_rows: bool,
    as_json: bool,
) -> int:
    """Compare each drive with its recipe; return the exit status.

    With `devices` only these. A drive that cannot be read hinders no other: the status is then 3.
    """
    recipes = recipes_in(file, devices)

    async def work(opened: OpenLine) -> list[tuple[RecipeDriveField, list[ComparedRow]]]:
        return [await _compared(opened, line, each, row_field, all_rows) for each in recipes]

    found = on_line(line, work, read_only=True)
    if as_json:
        drives = [each for each, _ in found]
        equal = all(each.differs == 0 for each in drives)
        name = recipes[0].name or None
        document = RecipesDocument(file=str(file), name=name, line=line, equal=equal, drives=drives)
        print_json(document)
    else:
        if recipes[0].name:
            say(f"{recipes[0].name}:")
        for each, rows in found:
            _print(each, rows, format_)
    if any(each.error for each, _ in found):
        return LINE_TROUBLE
    return DIFFERENT if any(each.differs for each, _ in found) else DONE


def recipes_in(file: Path, devices: Sequence[int]) -> list[DriveRecipe]:
    """Return the recipes of a file; with `devices` only these. Raises Failure or UsageError."""
    from tui.drive.errors import ProfileError
    from tui.drive.settings.recipes import read_recipes

    try:
        found = read_recipes(file)
    except ProfileError as error:
        raise Failure(str(error), USAGE) from error
    if absent := [device for device in devices if device not in [each.device for each in found]]:
        raise click.UsageError(f"{file} has no recipe for device {absent[0]}.")
    return [each for each in found if not devices or each.device in devices]


async def _compared(
    opened: OpenLine, line: str, recipe: DriveRecipe, row_field: RowField, all_rows: bool
) -> tuple[RecipeDriveField, list[ComparedRow]]:
    from tui.bus.errors import LineError
    from tui.drive.errors import DriveError

    rows: list[ComparedRow] = []
    error = ""
    try:
        target = Target(line, recipe.device, recipe.profile.id, by_recipe=True)
        session = await connect_drive(opened, target)
        values = await take_set(session, settings_only=True)
        rows = recipe.differences(values, all_rows=all_rows)
    except (LineError, DriveError) as fault:
        error = str(fault)
    differs = None if error else sum(row.differs for row in rows)
    each = RecipeDriveField(
        device=recipe.device,
        profile=recipe.profile.id,
        settings=len(recipe.raws),
        differs=differs,
        error=error or None,
        left=list(recipe.left),
        rows=[row_field(row) for row in rows],
    )
    return each, rows


def _print(each: RecipeDriveField, rows: list[ComparedRow], format_: TableFormat) -> None:
    from tui.drive.settings.compare import rows_text

    if each.error:
        say(f"Drive {each.device}: not compared. {each.error}")
    elif not each.differs:
        say(f"Drive {each.device}: as its recipe of {each.settings} settings.")
    else:
        say(counted(each.differs, *DIFFERS, device=each.device))
    if each.left:
        say(LEFT_TO_DRIVES.format(codes=first_of(each.left, CODES_LISTED)), indent=3)
    if rows:
        say(rows_text(rows, ("recipe", "drive"), format_).removesuffix("\n"), indent=3)
