"""`drivepanel read`: values of some parameters, once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ..shared.completion import complete_code
from ..shared.drives import on_each_drive
from ..shared.errors import DONE, DRIVE_REFUSED
from ..shared.options import (
    Target,
    connect_drive,
    drives_options,
    force_profile_option,
    hold_option,
    json_option,
    line_argument,
    read_only_option,
)
from ..shared.output import drive_fields, print_readings, value_field
from ..shared.registration import ON_LINE, command
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.drive_documents import ReadDocument


@command("Read parameters from a drive.", group="Watch", statuses=ON_LINE)
@line_argument
@click.argument("codes", nargs=-1, required=True, metavar="CODE...", shell_complete=complete_code)
@drives_options
@force_profile_option
@hold_option
@read_only_option
@json_option
def read(
    target: Target,
    codes: tuple[str, ...],
    hold: float | None,
    read_only: bool,
    as_json: bool,
) -> None:
    """Read parameters of a drive.

    A CODE is the drive's own (ACC, 1.05, F875), the manual's number (W9001, 16#FD00) or a wire
    address (9001), in upper or lower case.
    """
    from tui.session.read.reader import Reader
    from tui.session.read.retrying_reader import read_apart

    from ..documents.drive_documents import ReadDocument

    sessions: list[DriveSession] = []

    async def read_drive(opened: OpenLine, drive: Target) -> tuple[ReadDocument, int]:
        session = await connect_drive(opened, drive)
        sessions.append(session)
        wanted = [session.profile.find(code).code for code in codes]
        readings = await read_apart(Reader(session), wanted)
        if not as_json:
            print_readings(readings)
        refused = [reading for reading in readings.values() if reading.raw is None]
        for reading in refused:
            say(f"drivepanel: {reading.parameter.code}: {reading.error}", err=True)
        document = ReadDocument(
            **drive_fields(target.line_text, session),
            values={code: value_field(reading) for code, reading in readings.items()},
        )
        return document, DRIVE_REFUSED if refused else DONE

    on_each_drive(
        target, read_drive, as_json=as_json, read_only=read_only, hold=hold, held=sessions
    )
