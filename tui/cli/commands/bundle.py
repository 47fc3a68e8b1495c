"""`drivepanel bundle`: one file about a line for a colleague or a manufacturer."""

from __future__ import annotations

import asyncio
import sys
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.errors import USAGE, Failure
from ..shared.options import (
    Target,
    connect_drive,
    devices_option,
    json_option,
    line_argument,
    on_line,
    profile_of,
)
from ..shared.registration import ON_LINE, command
from ..shared.say import Messages, say_over
from ..shared.sets import refuse_output, write_down
from ..shared.standard_streams import STANDARD

if TYPE_CHECKING:
    from tui.bus.errors import LineError
    from tui.bus.link import Link
    from tui.drive.profile.profile import Profile
    from tui.session.bundle.parts import PartProgress
    from tui.session.bundle.subject import BundleSubject
    from tui.session.bundle.work import Bundle
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession


@command("Collect all evidence about a line in one file.", group="Troubleshoot", statuses=ON_LINE)
@line_argument
@devices_option("Include this drive; several times for several (default: those known).")
@profile_of("Use this profile for drives that do not identify themselves.")
@click.option(
    "--output",
    "file",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write this file (default: named by line and time).",
)
@click.option("--force", is_flag=True, help="Replace FILE if it exists.")
@json_option
def bundle(
    line_text: str,
    devices: tuple[int, ...],
    profile_id: str | None,
    file: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Collect everything about a line in one zip, for a colleague or a manufacturer.

    It has port and adapter, why and counters, the last frames, settings and a report of each drive,
    journal and messages of the last day, profiles in use, versions, and the log. README.txt in the
    zip explains each file and names what could not be collected.

    Drives are read after all other requests; nothing is written to them. User names, host names,
    passwords and credentials are omitted. It works on a dead line too: status 0 means that the
    file was written.
    """
    from tui.drive.profile import library
    from tui.session.bundle.subject import bundle_name

    if profile_id is not None:
        library.load(profile_id)
    link = _link_of(line_text)
    stem = bundle_name(link, datetime.now())
    file = file or Path(f"{stem}.zip")
    refuse_output(file, force=force, as_json=as_json)
    if not file.absolute().parent.is_dir():
        raise Failure(f"{file}: there is no folder {file.parent}.", USAGE)
    made = _made(Target(line_text, 1, profile_id), devices, link, stem)
    write_down(file, made.data, force=force, private=True)
    messages = Messages(as_json=as_json or file == STANDARD)
    messages.tell(f"{file}: {len(made.files)} files. README.txt in it explains each.")
    if made.missing:
        messages.tell(f"Could not get: {', '.join(made.missing)}. README.txt says why.")
    if as_json:
        from ..documents.other_documents import BundleDocument
        from ..shared.output import print_json

        print_json(
            BundleDocument(
                line=line_text,
                file=str(file),
                bytes=len(made.data),
                files=list(made.files),
                missing=dict(made.missing),
                omitted=dict(made.omitted),
                messages=messages.texts,
            )
        )


def _link_of(text: str) -> Link | None:
    """The link of a LINE; None for a simulated one. Raises LinkSyntaxError."""
    from tui.bus.link import parse_link
    from tui.session.connect.line_key import SIMULATED_PREFIX
    from tui.session.connect.open_line import check_line

    check_line(text)
    return None if text.casefold().startswith(SIMULATED_PREFIX) else parse_link(text)


def _made(target: Target, devices: tuple[int, ...], link: Link | None, stem: str) -> Bundle:
    """The bundle of the line, open or not."""
    from tui.bus.errors import LineError, LinkSyntaxError
    from tui.session.bundle.work import make_bundle

    progress = _progress()

    async def work(opened: OpenLine) -> Bundle:
        found = _devices(devices, opened, opened.line.link)
        return await make_bundle(_subject(target, found, opened, opened.line.link), stem, progress)

    try:
        return on_line(target, work, read_only=True)
    except LinkSyntaxError:
        raise
    except LineError as error:
        found = _devices(devices, None, link)
        subject = _subject(target, found, None, link, error)
        return asyncio.run(make_bundle(subject, stem, progress))


def _devices(named: tuple[int, ...], opened: OpenLine | None, link: Link | None) -> tuple[int, ...]:
    """The addresses that were named, else those known on this line, else 1."""
    from tui.session.bundle.line_parts import remembered_devices

    if named:
        return tuple(dict.fromkeys(named))
    known = set(remembered_devices(link)) if link is not None else set()
    if opened is not None:
        known |= {*opened.devices, *opened.line.pace.others}
    return tuple(sorted(known)) or (1,)


def _subject(
    target: Target,
    devices: tuple[int, ...],
    opened: OpenLine | None,
    link: Link | None,
    trouble: LineError | None = None,
) -> BundleSubject:
    from tui.drive.profile import library
    from tui.session.bundle.parts import Missing
    from tui.session.bundle.subject import BundleSubject
    from tui.session.diagnosis.asking import profile_remembered

    from ..shared.diagnosis_documents import drive_documents

    def expected(device: int) -> Profile | None:
        named = library.load(target.profile_id) if target.profile_id is not None else None
        return named or (profile_remembered(link, device) if link is not None else None)

    async def open_drive(device: int) -> DriveSession:
        assert opened is not None
        item = target._replace(device=device, profile_id=None)
        try:
            return await connect_drive(opened, item)
        except click.UsageError as error:
            profile = await asyncio.to_thread(expected, device)
            if profile is None:
                raise Missing(error.format_message()) from None
            return await connect_drive(opened, item._replace(profile_id=profile.id))

    return BundleSubject(
        text=target.line_text,
        link=link,
        opened=opened,
        trouble=trouble,
        devices=devices,
        open_drive=open_drive,
        documents=drive_documents(),
        expected_profile=expected,
    )


def _progress() -> PartProgress | None:
    """Show the current part in one line of a terminal; None without one."""
    if not sys.stderr.isatty():
        return None
    width = 0

    def show(done: int, of: int, name: str) -> None:
        nonlocal width
        text = f"Collecting {done + 1} of {of}: {name}" if name else f"Collected {of} parts."
        say_over(text, last=not name, before=width)
        width = max(width, len(text))

    return show
