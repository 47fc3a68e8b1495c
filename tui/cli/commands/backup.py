"""`drivepanel backup`: the settings of a drive into a file, or of a line into a recipe."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.errors import DONE, DRIVE_REFUSED, INTERRUPTED, Failure, end_with
from ..shared.options import (
    Target,
    connect_drive,
    json_option,
    line_argument,
    never_forced,
    on_line,
    several_settings,
)
from ..shared.output import drive_fields, print_json
from ..shared.registration import ON_LINE, command
from ..shared.say import Messages
from ..shared.sets import (
    complain_absent,
    file_argument,
    force_option,
    refuse_output,
    set_of_drive,
    take_set,
    write_down,
)
from ..shared.standard_streams import STANDARD

if TYPE_CHECKING:
    from tui.drive.settings.parameter_set import ParameterSet
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.setting_documents import BackupDocument


RECIPES_WRITTEN = "{file}: recipes of {count} drives."
SETTINGS_SHARED = "{file}: {count} drives of {name} share {shared} settings."
RecipeDrive = tuple["DriveSession", "ParameterSet"]


def back_up_recipes(target: Target, file: Path, *, force: bool, as_json: bool) -> int:
    """Write a recipe file with its sets beside it; return the exit status.

    Raises Failure, with nothing written, if a drive cannot be read or a file exists.
    """
    from tui.drive.settings.parameter_set import dump_set
    from tui.drive.settings.recipes import dump_recipes, split_sets

    refuse_output(file, force=force, as_json=as_json)
    for each in target.each():
        refuse_output(_drive_file(file, each.device), force=force, as_json=as_json)
    drives = _drives_read(target)
    families = {session.profile.id: session.profile for session, _ in drives}
    for id_ in families:
        refuse_output(_machine_file(file, id_), force=force, as_json=as_json)
    rests: dict[int, ParameterSet] = {}
    messages = Messages(as_json=as_json)
    shared_texts = []
    for id_, profile in families.items():
        members = [values for session, values in drives if session.profile.id == id_]
        machine, rest = split_sets(profile, members)
        if len(members) > 1:
            shared_texts.append(
                SETTINGS_SHARED.format(
                    file=_machine_file(file, id_),
                    count=len(members),
                    name=profile.name,
                    shared=len(machine.raws),
                )
            )
        write_down(_machine_file(file, id_), dump_set(profile, machine), force=force)
        rests |= {values.head.device: values for values in rest}
    rows = []
    for session, _ in drives:
        path = _drive_file(file, session.device)
        write_down(path, dump_set(session.profile, rests[session.device]), force=force)
        id_ = session.profile.id
        rows.append((session.device, id_, _machine_file(file, id_).name, path.name))
    write_down(file, dump_recipes(rows), force=force)
    for text in (RECIPES_WRITTEN.format(file=file, count=len(drives)), *shared_texts):
        messages.tell(text)
    for _, values in drives:
        complain_absent(messages, values.absent)
    if as_json:
        print_json([_document(target, file, drive, rests) for drive in drives])
    return DRIVE_REFUSED if any(values.absent for _, values in drives) else DONE


def _machine_file(file: Path, profile: str) -> Path:
    return file.with_name(f"{file.stem}-{profile}.toml")


def _drive_file(file: Path, device: int) -> Path:
    return file.with_name(f"{file.stem}-{device}.toml")


def _drives_read(target: Target) -> Sequence[RecipeDrive]:
    """Read every drive of the target, one after another."""

    async def work(opened: OpenLine) -> list[RecipeDrive]:
        sessions = [await connect_drive(opened, each) for each in target.each()]
        return [(session, await take_set(session, settings_only=True)) for session in sessions]

    try:
        return on_line(target, work, read_only=True)
    except KeyboardInterrupt:
        raise Failure("Ended by Ctrl-C: nothing was written.", INTERRUPTED) from None


def _document(
    target: Target, file: Path, drive: RecipeDrive, rests: dict[int, ParameterSet]
) -> BackupDocument:
    session, values = drive
    from ..documents.setting_documents import BackupDocument

    return BackupDocument(
        **drive_fields(target.line_text, session),
        file=str(_drive_file(file, session.device)),
        parameters=len(rests[session.device].raws),
        all=False,
        absent=dict(values.absent),
        messages=[],
        recipe=str(file),
        machine=str(_machine_file(file, session.profile.id)),
    )


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

        end_with(back_up_recipes(target, file, force=force, as_json=as_json))
        return
    if target.others:
        raise click.UsageError("Several -d require --recipe.")
    from tui.drive.settings.parameter_set import dump_set

    from ..documents.setting_documents import BackupDocument

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
