"""A drive that answered on the line, and what the Connection screen says of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from tui.widgets.drawing import cut
from tui.widgets.palette import ALARM, FAINT, FAULT, PLAIN, RUNNING, STRONG

if TYPE_CHECKING:
    from tui.session.fleet import FoundDrive

FOUND_STYLES = {"running": RUNNING, "fault": FAULT, "unknown": ALARM}
WHO_WIDTH, VERSION_WIDTH, PROFILE_WIDTH = 16, 4, 13
ROOM_FOR_PROFILE = 60
"""Columns of the list from which it names the profile beside the reference."""


FoundState = tuple[str, str]
"""What a drive does in words, and the kind of that."""


def profile_text(drive: FoundDrive) -> str:
    """The name of its profile, with a sign where it is a guess; empty without one."""
    if drive.session is None:
        return ""
    return drive.session.profile.name + (" ?" if drive.guessed else "")


def about_drive(drive: FoundDrive) -> str:
    """Vendor, reference, version, name and profile of a drive."""
    identity = drive.identity
    version = f"version {identity.version_text}" if identity.version else ""
    profile = f"profile {profile_text(drive)}" if drive.session else "no profile"
    parts = (identity.vendor, identity.reference, version, identity.name, profile)
    return f"Device {identity.device}: " + ", ".join(part for part in parts if part)


def next_step(drive: FoundDrive) -> str:
    """What to do with a drive."""
    others = [
        c for c in drive.identity.candidates if drive.session and c != drive.session.profile.id
    ]
    if drive.guessed and others:
        return (
            "It does not say what it is. Enter watches it; if it is another drive, type"
            f" {' or '.join(others)} beside Profile, then s."
        )
    return "Enter watches it."


def drive_line(drive: FoundDrive, state: FoundState, width: int) -> Text:
    """A drive in one line: address, reference, version, name, profile, state."""
    identity = drive.identity
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f" {identity.device:>3} ", FAINT)
    text.append(
        cut(identity.reference or profile_text(drive) or "unknown drive", WHO_WIDTH), STRONG
    )
    about, name = " ", identity.name or identity.version_text
    if width >= ROOM_FOR_PROFILE:
        profile = profile_text(drive) if identity.reference else ""
        about, name = f" {cut(profile, PROFILE_WIDTH)} ", identity.name
        about += f"{cut(identity.version_text, VERSION_WIDTH)} "
    room = max(0, width - text.cell_len - len(about) - len(state[0]) - 1)
    text.append(about + (cut(name, room) if room > 1 else " " * room) + " ", FAINT)
    text.append(state[0], FOUND_STYLES.get(state[1], PLAIN))
    return text
