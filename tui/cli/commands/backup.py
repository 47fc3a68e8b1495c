"""`drivepanel backup`: the settings of a drive into a file."""

from __future__ import annotations

from pathlib import Path

import click

from ..shared.errors import DRIVE_REFUSED, INTERRUPTED, Failure, end_with
from ..shared.options import Target, json_option, line_argument, never_forced, several_settings
from ..shared.registration import ON_LINE, command
from ..shared.say import Messages
from ..shared.sets import (
    complain_absent,
    file_argument,
    force_option,
    refuse_output,
    set_of_drive,
    write_down,
)
from ..shared.standard_streams import STANDARD

_PARAMETERS = "{file}: {count} parameters of {name}"
_SETTINGS = "{file}: {count} settings of {name}"


@command("Back up a drive's settings to a file.", group="Set up", statuses=ON_LINE)
@line_argument
@file_argument
@force_option
@click.option(
    "--all", "everything", is_flag=True, help="Add measurements, counters and command words."
)
@click.option("--recipe", is_flag=True, help="Write recipes for several drives (repeat -d).")
@json_option
@several_settings
@never_forced
def backup(
    target: Target, file: Path, force: bool, everything: bool, recipe: bool, as_json: bool
) -> None:
    """Back up the settings of a drive to FILE, one line per parameter; `-` is standard output.

    The file is TOML, and easy to diff: two backups of an unchanged drive differ in their time only.
    To change a value by hand, edit `value` and delete `raw` from that line.

    With --recipe, FILE names the sets of several drives: what they share, and what belongs to each.
    """
    if recipe:
        if everything or file == STANDARD:
            raise click.UsageError("--recipe takes neither --all nor standard output.")
        from ..running.recipe_backup import back_up_recipes

        end_with(back_up_recipes(target, file, force=force, as_json=as_json))
        return
    if target.others:
        raise click.UsageError("Several -d require --recipe.")
    from tui.drive.settings.parameter_set import dump_set

    from ..documents.setting_documents import BackupDocument
    from ..shared.output import drive_fields, print_json

    refuse_output(file, force=force, as_json=as_json)
    try:
        session, values = set_of_drive(target, settings_only=not everything)
    except KeyboardInterrupt:
        raise Failure("Ended by Ctrl-C: nothing was written.", INTERRUPTED) from None
    text = dump_set(session.profile, values)
    messages = Messages(as_json=as_json or file == STANDARD)
    write_down(file, text, force=force)
    text = _PARAMETERS if everything else _SETTINGS
    messages.tell(text.format(file=file, count=len(values.raws), name=session.profile.name))
    complain_absent(messages, values.absent)
    if as_json:
        print_json(
            BackupDocument(
                **drive_fields(target.line_text, session),
                file=str(file),
                parameters=len(values.raws),
                all=everything,
                absent=dict(values.absent),
                messages=messages.texts,
            )
        )
    if values.absent:
        raise click.exceptions.Exit(DRIVE_REFUSED)
