"""`drivepanel read`: values of some parameters, once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ..shared.errors import DRIVE_REFUSED, told
from ..shared.left_alone import timeout_json, timeout_of
from ..shared.options import (
    Target,
    connect_drive,
    drive_options,
    force_profile_option,
    hold_option,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine


@click.command()
@line_argument
@click.argument("codes", nargs=-1, required=True, metavar="CODE...")
@drive_options
@force_profile_option
@hold_option
@read_only_option
@json_option
@told
def read(
    target: Target,
    codes: tuple[str, ...],
    hold: float | None,
    read_only: bool,
    as_json: bool,
) -> None:
    """Read parameters of a drive.

    A CODE is the drive's own (ACC, 1.05, F875), the manual's number (W9001, 16#FD00) or a wire
    address (9001), in any case.
    """
    from tui.session.read.reader import Reader

    from ..running.holding import hold_on
    from ..shared.output import print_json, print_readings, readings_json

    async def work(opened: OpenLine) -> bool:
        session = await connect_drive(opened, target)
        wanted = [session.profile.find(code).code for code in codes]
        readings = await Reader(session).read(wanted)
        if as_json:
            timeout = timeout_json(await timeout_of(opened, session))
            print_json({**readings_json(target.line_text, session, readings), "timeout": timeout})
        else:
            print_readings(readings)
        refused = [reading for reading in readings.values() if reading.raw is None]
        for reading in refused:
            say(f"drivepanel: {reading.parameter.code}: {reading.error}", err=True)
        await hold_on(opened, [session], hold)
        return bool(refused)

    if on_line(target, work, read_only=read_only):
        raise click.exceptions.Exit(DRIVE_REFUSED)
