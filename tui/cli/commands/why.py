"""`drivepanel why`: why a drive does not answer, in one sentence, and what to look at next."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import click

from ..shared.errors import LINE_TROUBLE
from ..shared.line_argument import mind_the_drive
from ..shared.options import (
    Target,
    json_option,
    line_argument,
    on_line,
    read_only_option,
    settings_options,
)
from ..shared.registration import ON_LINE, command
from ..shared.say import say

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine
    from tui.session.diagnosis.diagnosis import Diagnosis

    from ..documents.document import DriveFields


@command("Diagnose why a drive does not answer.", group="Troubleshoot", statuses=ON_LINE)
@line_argument
@settings_options
@read_only_option
@json_option
def why(target: Target, read_only: bool, as_json: bool) -> None:
    """Diagnose why a drive does not answer: the cause in a sentence, and the next steps.

    It checks the port and its adapter, and listens before it sends. While another master is active,
    it sends nothing. Then it reads the drive up to 200 times, and ends earlier if all replies are
    good: 150 exclude that 2 % are lost or damaged, and those of the last minute count.

    It takes 5 to 15 s, and up to 30 s on a faulty line. A connection to a gateway is watched for
    3 s without a request, so a longer idle timeout is not detected. If nothing on a gateway
    answers, the other protocol and the units 255 and 0 are tried. Nothing is written, and no
    other baud rate or format is tried.

    With -p, or for a drive that was here before, the steps include advice from its manual: address,
    settings, pins and wires. Ends with 0 if the drive answers and nothing is wrong, else with 3.
    """
    from tui.bus.errors import LineError, LinkSyntaxError
    from tui.drive.profile import library

    named = library.load(target.profile_id) if target.profile_id else None

    async def work(opened: OpenLine) -> tuple[Diagnosis, DriveFields | None]:
        return await _requested(opened, target, named)

    try:
        found, fields = on_line(target, work, read_only=read_only)
    except LinkSyntaxError:
        raise
    except LineError as error:
        found, fields = _unopened(target, named, error), None
    _tell(target, found, fields, as_json)
    if not found.well:
        raise click.exceptions.Exit(LINE_TROUBLE)


async def _requested(
    opened: OpenLine, target: Target, named: Profile | None
) -> tuple[Diagnosis, DriveFields | None]:
    """The diagnosis of a drive on an open line, and how a document about it begins."""
    from tui.drive.profile import library
    from tui.session.diagnosis.asking import profile_remembered
    from tui.session.diagnosis.diagnosis import diagnosed
    from tui.session.diagnosis.examining import examine_line

    line, device = opened.line, target.device
    profile = named or await asyncio.to_thread(profile_remembered, line.link, device)
    if profile is None and device in opened.profiles:
        profile = await asyncio.to_thread(library.load, opened.profiles[device])
    changed = opened.known.text if opened.known is not None else ""
    found = diagnosed(await examine_line(line, device, profile, changed=changed))
    fields = None
    if found.sight.heard.answered:
        fields = await _looked_after(opened, target, profile, found)
    return found, fields


async def _looked_after(
    opened: OpenLine, target: Target, profile: Profile | None, found: Diagnosis
) -> DriveFields | None:
    """Report the reaction of a drive that was polled and is polled no longer.

    On a bad line its timeout is read once, at the end.
    """
    from tui.drive.profile import library
    from tui.session.drive import DriveSession
    from tui.session.timeout_report import Timeout

    from ..shared.output import drive_fields
    from ..shared.pending_timeouts import look_after

    identity: DriveIdentity | None = None
    if profile is None:
        identity = await _identity(opened, target.device, found.sight.identity)
        if identity is None or identity.profile is None:
            return None
        profile = await asyncio.to_thread(library.load, identity.profile)
    session = DriveSession(opened.line, target.device, profile, identity)
    farewell = look_after(opened, session, target.line_text)
    if found.well:
        await farewell.learn()
    else:
        session.timeout = Timeout(known=False)
    return drive_fields(target.line_text, session)


async def _identity(
    opened: OpenLine, device: int, found: DriveIdentity | None
) -> DriveIdentity | None:
    from tui.bus.errors import LineError
    from tui.session.connect.identify import identify_drive

    try:
        found = found or await identify_drive(opened.line, device)
    except LineError:
        return None
    mind_the_drive(opened, device, found)
    return found


def _unopened(target: Target, named: Profile | None, error: Exception) -> Diagnosis:
    """The diagnosis of a line that cannot be opened. Raises LinkSyntaxError."""
    from dataclasses import replace

    from tui.bus.errors import LineError
    from tui.bus.link import parse_link
    from tui.session.diagnosis.asking import evidence_of_port
    from tui.session.diagnosis.diagnosis import diagnosed

    assert isinstance(error, LineError)
    seen = evidence_of_port(parse_link(target.line_text), target.device, error)
    return diagnosed(replace(seen, profile=named))


def _tell(target: Target, found: Diagnosis, fields: DriveFields | None, as_json: bool) -> None:
    from ..shared.diagnosis_documents import why_document
    from ..shared.output import print_json

    if as_json:
        print_json(why_document(target.line_text, target.device, fields, found))
        return
    say(found.text)
    if (measure := found.sight.measure) is not None:
        say(
            f"Sent {measure.requested} short reads in {measure.seconds:.1f} s; nothing was written."
        )
    if found.certainty != "certain":
        say(f"This is {found.certainty}. It could also be:")
        for other in found.others:
            say(f"  - {other}", indent=4)
    if found.steps:
        say("Next steps:")
    for step in found.steps:
        say(f"  - {step}", indent=4)
