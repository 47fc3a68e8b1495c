"""`drivepanel identify`: who answers at an address."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..shared.drives import on_each_drive
from ..shared.errors import DONE, REFUSED_HERE, Failure
from ..shared.line_argument import mind_the_drive
from ..shared.options import (
    Target,
    hold_option,
    json_option,
    line_argument,
    read_only_option,
    several_devices_option,
)
from ..shared.output import drive_fields
from ..shared.pending_timeouts import look_after, timeout_field
from ..shared.registration import ON_LINE, command
from ..shared.rows import say_row, titled

if TYPE_CHECKING:
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.drive_documents import IdentityDocument
    from ..documents.parts import ModelField

IDENTITY_TITLES = titled(9)


@command("Show a drive's vendor, model and version.", group="Watch", statuses=ON_LINE)
@line_argument
@several_devices_option
@hold_option
@read_only_option
@json_option
def identify(
    line_text: str,
    device: tuple[int, ...],
    hold: float | None,
    read_only: bool,
    as_json: bool,
) -> None:
    """Show a drive's identity (function 43)."""
    from tui.session.connect.identify import identify_drive as ask
    from tui.session.timeout_report import Timeout

    from ..documents.drive_documents import IdentityDocument

    target = Target(line_text, device[0], None, others=device[1:])
    sessions: list[DriveSession] = []

    async def identify_drive(opened: OpenLine, drive: Target) -> tuple[IdentityDocument, int]:
        identity = await ask(opened.line, drive.device)
        mind_the_drive(opened, drive.device, identity)
        session = await asyncio.to_thread(_session, opened, identity)
        words = await _model_words(session)
        if not as_json:
            _say_identity(identity, words)
        timeout = timeout_field(Timeout(known=False))
        if session is not None:
            sessions.append(session)
            await look_after(opened, session, line_text).learn()
            if identity.profile is not None:  # that of a guessed family may be another one
                timeout = drive_fields(line_text, session)["timeout"]
        elif hold:
            raise Failure(
                f"Device {drive.device} does not identify itself, so it cannot be kept alive."
                " Use 'drivepanel hold' with -p.",
                REFUSED_HERE,
            )
        document = IdentityDocument(
            line=line_text,
            device=identity.device,
            profile=identity.profile,
            timeout=timeout,
            vendor=identity.vendor,
            reference=identity.reference,
            version=identity.version,
            name=identity.name,
            model=_model(identity, words),
            candidates=list(identity.candidates),
        )
        return document, DONE

    on_each_drive(
        target, identify_drive, as_json=as_json, read_only=read_only, hold=hold, held=sessions
    )


def _session(opened: OpenLine, identity: DriveIdentity) -> DriveSession | None:
    """A session with the drive, by the likeliest family of several alike; None where none fits."""
    from tui.drive.errors import DriveError
    from tui.drive.profile import library
    from tui.session.drive import DriveSession

    named = identity.profile or next(iter(identity.candidates), None)
    if named is None:
        return None
    try:
        return DriveSession(opened.line, identity.device, library.load(named), identity)
    except DriveError:
        return None  # the identity is known; a session is optional


def _say_identity(found: DriveIdentity, words: Mapping[str, int]) -> None:
    for title, text in (
        ("Device", str(found.device)),
        ("Vendor", found.vendor),
        ("Reference", found.reference),
        ("Version", found.version_text),
        ("Name", found.name),
        ("Profile", found.profile or _choices(found)),
        *_model_row(found, words),
    ):
        say_row(IDENTITY_TITLES, (title, text or "-----"))


async def _model_words(session: DriveSession | None) -> Mapping[str, int]:
    """Raw values of the words that show the model, if its family has them."""
    from tui.bus.errors import LineError
    from tui.drive.errors import DriveError
    from tui.drive.model import model_codes
    from tui.session.read.reader import Reader

    if session is None or session.known_identity.profile is None:
        return {}
    if not (codes := model_codes(session.profile)):
        return {}
    try:
        found = await Reader(session).read(codes)
    except (DriveError, LineError):
        return {}  # the identity is known; the model is optional
    return {code: reading.raw for code, reading in found.items() if reading.raw is not None}


def _model(identity: DriveIdentity, words: Mapping[str, int]) -> ModelField | None:
    """The model by the drive's own code word; null where there is none."""
    if identity.profile is None or not words:
        return None
    from tui.drive.model import model_of, model_read
    from tui.drive.profile import library

    from ..documents.parts import ModelField

    profile = library.load(identity.profile)
    model = model_of(profile, words)
    return ModelField(
        code=words.get(profile.data.identification.model_parameter),
        text=model_read(profile, words),
        reference=(model.reference or None) if model else None,
        voltage=(model.voltage or None) if model else None,
        power_kw=(model.power_kw or None) if model else None,
        variant=(model.variant or None) if model else None,
        class_b=model.class_b if model else None,
    )


def _model_row(identity: DriveIdentity, words: Mapping[str, int]) -> list[tuple[str, str]]:
    model = _model(identity, words)
    return [("Model", model.text)] if model else []


def _choices(found: DriveIdentity) -> str:
    fits = ", ".join(found.candidates)
    return f"not known; it may be {fits}: choose with -p" if fits else "not known; name one with -p"
