"""`drivepanel backup`: the settings of a drive into a file."""

from __future__ import annotations

from pathlib import Path

import click

from ..shared.errors import DRIVE_REFUSED, INTERRUPTED, Failure
from ..shared.options import Target, json_option, line_argument, never_forced, settings_options
from ..shared.registration import ON_LINE, command
from ..shared.say import Messages, say
from ..shared.sets import (
    complain_absent,
    file_argument,
    force_option,
    refuse_existing,
    set_of_drive,
    write_down,
)

STANDARD_OUTPUT = Path("-")


_PARAMETERS = "{file}: {count} parameters of {name}"
_SETTINGS = "{file}: {count} settings of {name}"


@command("Back up a drive's settings to a file.", statuses=ON_LINE)
@line_argument
@file_argument
@force_option
@click.option(
    "--all", "everything", is_flag=True, help="Add measurements, counters and command words."
)
@json_option
@settings_options
@never_forced
def backup(target: Target, file: Path, force: bool, everything: bool, as_json: bool) -> None:
    """Back up the settings of a drive to FILE, one line per parameter; `-` is standard output.

    The file is TOML, and easy to diff: two backups of an unchanged drive differ in their time only.
    To change a value by hand, edit `value` and delete `raw` from that line.
    """
    from tui.drive.settings.parameter_set import dump_set

    from ..documents.setting_documents import BackupDocument
    from ..shared.output import drive_fields, print_json

    to_output = file == STANDARD_OUTPUT
    if to_output and as_json:
        raise click.UsageError("Either - or --json: both write to standard output.")
    if not to_output:
        refuse_existing(file, force=force)
    try:
        session, values = set_of_drive(target, settings_only=not everything)
    except KeyboardInterrupt:
        raise Failure("Ended by Ctrl-C: nothing was written.", INTERRUPTED) from None
    text = dump_set(session.profile, values)
    messages = Messages(as_json=as_json)
    if to_output:
        say(text.removesuffix("\n"))
    else:
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
