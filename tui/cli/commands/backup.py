"""`drivepanel backup`: every readable parameter of a drive into a file."""

from __future__ import annotations

from pathlib import Path

import click

from ..shared.errors import told
from ..shared.options import Target, line_argument, never_forced, settings_options
from ..shared.say import say
from ..shared.sets import (
    file_argument,
    force_option,
    refuse_existing,
    set_of_drive,
    write_down,
)


@click.command()
@line_argument
@file_argument
@force_option
@settings_options
@never_forced
@told
def backup(target: Target, file: Path, force: bool) -> None:
    """Write every readable parameter of a drive to FILE, one line a parameter.

    The file is TOML, made for a diff. To change a value by hand, write it into `value` and take
    `raw` out of that line.
    """
    from tui.drive.settings.parameter_set import dump_set

    refuse_existing(file, force=force)
    session, values = set_of_drive(target)
    write_down(file, dump_set(session.profile, values), force=force)
    say(f"{file}: {len(values.raws)} parameters of {session.profile.name}")
    for code, why in values.absent.items():
        say(f"drivepanel: {code} could not be read: {why}", err=True)
