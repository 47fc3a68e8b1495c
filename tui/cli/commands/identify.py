"""`drivepanel identify`: who answers at an address."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from tui.drive.plain import plain

from ..shared.devices import several_devices_option
from ..shared.drives import each_drive
from ..shared.errors import DONE, told
from ..shared.line_argument import mind_the_drive
from ..shared.options import (
    Target,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.say import say_row

if TYPE_CHECKING:
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine

TITLES = 11
"""Width of the column of titles, with its gap."""


@click.command()
@line_argument
@several_devices_option
@read_only_option
@json_option
@told
def identify(line_text: str, device: tuple[int, ...], read_only: bool, as_json: bool) -> None:
    """Ask a drive who it is (function 43)."""
    from tui.session.connect.identify import identify_drive as ask

    target = Target(line_text, device[0], None, others=device[1:])

    async def one(opened: OpenLine, drive: Target) -> tuple[dict[str, Any], int]:
        identity = await ask(opened.line, drive.device)
        mind_the_drive(opened, drive.device, identity)
        words = await _model_words(opened, identity)
        if not as_json:
            _say_identity(identity, words)
        keys = ("device", "vendor", "reference", "version", "name", "profile")
        told = {key: getattr(identity, key) for key in keys}
        return {"line": line_text, **told, "model": _model(identity, words)}, DONE

    async def work(opened: OpenLine) -> int:
        return await each_drive(target, lambda drive: one(opened, drive), as_json=as_json)

    if status := on_line(line_text, work, read_only=read_only):
        raise click.exceptions.Exit(status)


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
        say_row(title, plain(text) or "-----", TITLES)


async def _model_words(opened: OpenLine, identity: DriveIdentity) -> Mapping[str, int]:
    """Raw values of the words that tell the model, where its family has them."""
    if identity.profile is None:
        return {}
    from tui.bus.errors import LineError
    from tui.drive.errors import DriveError
    from tui.drive.model import model_codes
    from tui.drive.profile import library
    from tui.session.drive import DriveSession
    from tui.session.read.reader import Reader

    try:
        profile = await asyncio.to_thread(library.load, identity.profile)
        if not (codes := model_codes(profile)):
            return {}
        found = await Reader(DriveSession(opened.line, identity.device, profile)).read(codes)
    except (DriveError, LineError):
        return {}  # who it is was asked for and is known; its model is more than that
    return {code: one.raw for code, one in found.items() if one.raw is not None}


def _model(identity: DriveIdentity, words: Mapping[str, int]) -> dict[str, Any] | None:
    """The model by the drive's own code word; null where there is none."""
    if identity.profile is None or not words:
        return None
    from tui.drive.model import model_of, model_told
    from tui.drive.profile import library

    profile = library.load(identity.profile)
    model = model_of(profile, words)
    return {
        "code": words.get(profile.data.identification.model_parameter),
        "text": model_told(profile, words),
        "reference": (model.reference or None) if model else None,
        "voltage": (model.voltage or None) if model else None,
        "power_kw": (model.power_kw or None) if model else None,
        "variant": (model.variant or None) if model else None,
        "class_b": model.class_b if model else None,
    }


def _model_row(identity: DriveIdentity, words: Mapping[str, int]) -> list[tuple[str, str]]:
    model = _model(identity, words)
    return [("Model", model["text"])] if model else []


def _choices(found: DriveIdentity) -> str:
    fits = ", ".join(found.candidates)
    return f"not known; it may be {fits}" if fits else "not known; name one with -p"
