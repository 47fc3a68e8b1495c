"""`drivepanel lines`: the lines that have a name, and what is remembered of lines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from ..shared.errors import USAGE
from ..shared.left_behind import LeftBehind, left_on_lines
from ..shared.options import json_option
from ..shared.registration import command
from ..shared.rows import Column, say_row
from ..shared.say import say

if TYPE_CHECKING:
    from tui.bus.share.beside import LineLook
    from tui.bus.share.place import Owner
    from tui.session.connect.known_lines import LineMark
    from tui.session.connect.named_lines import NamedLine

    from ..documents.other_documents import KnownLineField, LeftOnLineDocument, OpenLineDocument

NAMED_COLUMNS = (Column("name", width=11), Column("line"), Column("device"), Column("profile"))
DRIVE_COLUMNS = (Column("device", width=5, right=True), Column("drive"))


@command("List named and remembered lines.", group="Share")
@json_option
def lines(as_json: bool) -> None:
    """List the lines that the settings file names, and the stored adapters and drives.

    Open lines are listed with the process that owns each, its programs, and the good replies of the
    last minute. A motor that may still run although its program has exited is listed too. The
    settings file is checked: each error is reported with its file, line and key, with status 2.
    """
    from tui.bus.share.beside import line_look
    from tui.session.connect.known_lines import load_memory
    from tui.session.connect.named_lines import line_settings
    from tui.session.connect.share_place import owners

    from ..documents.other_documents import LinesDocument, NamedLineField
    from ..shared.output import print_json

    settings, memory, left = line_settings(), load_memory(), left_on_lines()
    held = [(item, line_look(item)) for item in owners()]
    named = list(settings.lines.values())
    places = settings.places.items()
    found = (f"{at}: {fault}" for name, at in places for fault in _faults(settings.lines[name]))
    faults = [*settings.faults, *found]
    if as_json:
        print_json(
            LinesDocument(
                settings=str(settings.path),
                faults=faults,
                lines=[
                    NamedLineField(
                        name=line.name, line=line.line, device=line.device, profile=line.profile
                    )
                    for line in named
                ],
                known=[_known_field(key, mark) for key, mark in memory.lines.items()],
                open=[_open_field(*pair) for pair in held],
                left_behind=[_left_field(behind) for behind in left],
            )
        )
    else:
        if not named and not faults:
            say(f"No line has a name. Lines are named in {settings.path}.")
        for line in named:
            drive = "" if line.device is None else f"device {line.device}"
            say_row(NAMED_COLUMNS, (line.name, line.line, drive, line.profile or ""))
        for key, mark in memory.lines.items():
            say(f"Remembered: {key} ({mark.adapter})" if mark.adapter else f"Remembered: {key}")
            for device, drive_mark in mark.drives.items():
                say_row(DRIVE_COLUMNS, (str(device), drive_mark.text))
        for owner, look in held:
            minute = look.minute if look is not None else None
            text = f"Open: {owner.line}, held by {owner.program.text}."
            if minute is not None and minute.replies:
                good = f"{minute.good} of {minute.replies} replies good in the last minute."
                text = f"{text} {good}"
            say(text)
            for client in look.clients if look is not None else ():
                say(f"  {client.share:>4.0%} of the line: {client.program} (pid {client.pid})")
        for motor in left:
            say(f"{motor.record.line} device {motor.record.device}: {motor.text}")
            say(f"  {motor.advice(motor.record.line)}", to_copy=True)
    for fault in faults:
        say(f"drivepanel: {fault}", err=True)
    if faults:
        raise click.exceptions.Exit(USAGE)


def _faults(line: NamedLine) -> Iterator[str]:
    """Yield the problems of a name, as far as they are known without opening its line."""
    from tui.bus.errors import LinkSyntaxError
    from tui.drive.errors import DriveError
    from tui.drive.profile import library
    from tui.session.connect.open_line import check_line

    from ..command_index import COMMANDS

    if line.name.casefold() in COMMANDS:
        yield "a command has this name: the panel cannot be opened by it."
    try:
        check_line(line.line)
    except LinkSyntaxError as error:
        yield str(error)
    try:
        if line.profile is not None:
            library.load(line.profile)
    except DriveError as error:
        yield str(error)


def _open_field(owner: Owner, look: LineLook | None) -> OpenLineDocument:
    from ..documents.other_documents import LineClientDocument, OpenLineDocument
    from ..shared.output import last_minute_field

    clients, minute = (None, None) if look is None else (look.clients, look.minute)
    return OpenLineDocument(
        line=owner.line,
        program=owner.program.name,
        pid=owner.program.pid,
        clients=None
        if clients is None
        else [
            LineClientDocument(program=client.program, pid=client.pid, share=client.share)
            for client in clients
        ],
        last_minute=None if minute is None else last_minute_field(minute, minute.share),
    )


def _left_field(behind: LeftBehind) -> LeftOnLineDocument:
    from ..documents.other_documents import LeftOnLineDocument

    record = behind.record
    return LeftOnLineDocument(line=record.line, device=record.device, **behind.fields())


def _known_field(key: str, mark: LineMark) -> KnownLineField:
    from ..documents.other_documents import KnownDriveField, KnownLineField

    drives = [
        KnownDriveField(
            device=device,
            vendor=drive.vendor or None,
            reference=drive.reference or None,
            version=drive.version or None,
            name=drive.name or None,
            profile=drive.profile or None,
        )
        for device, drive in mark.drives.items()
    ]
    return KnownLineField(line=key, adapter=mark.adapter or None, drives=drives)
