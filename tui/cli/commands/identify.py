"""`drivepanel identify`: who answers at an address."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from tui.drive.plain import plain

from ..shared.errors import told
from ..shared.options import device_option, json_option, line_argument, on_line, read_only_option
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine


@click.command()
@line_argument
@device_option
@read_only_option
@json_option
@told
def identify(line_text: str, device: int, read_only: bool, as_json: bool) -> None:
    """Ask a drive who it is (function 43)."""
    from tui.session.connect.identify import identify_drive as ask

    from ..shared.output import print_json

    async def work(opened: OpenLine) -> DriveIdentity:
        return await ask(opened.line, device)

    found = on_line(line_text, work, read_only=read_only)
    if as_json:
        keys = ("device", "vendor", "reference", "version", "name", "profile")
        print_json({key: getattr(found, key) for key in keys})
        return
    say(f"Device     {found.device}")
    for title, text in (
        ("Vendor", found.vendor),
        ("Reference", found.reference),
        ("Version", found.version_text),
        ("Name", found.name),
        ("Profile", found.profile or _choices(found)),
    ):
        say(f"{title:<10} {plain(text) or '-----'}")


def _choices(found: DriveIdentity) -> str:
    fits = ", ".join(found.candidates)
    return f"not known; it may be {fits}" if fits else "not known; name one with -p"
