"""Comparison of a parameter set's file with the open drive; reads nothing."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tui.drive.errors import DriveError
from tui.drive.profile.profile import Profile
from tui.drive.settings.set_file import read_set
from tui.drive.settings.writable import is_setting

from ..dialogs.pick_file import FileAbout


def about_set(path: Path, profile: Profile, raws: Mapping[str, int]) -> FileAbout:
    """Of which drive it is, and how many settings it has otherwise than the drive holds.

    `raws` is what is known of the drive by now: what was not read yet differs from nothing.
    """
    try:
        values = read_set(path, path.name)
    except DriveError:
        return FileAbout(reported="invalid file", alarm=True)
    head = values.head
    named = head.identity.get("name") or head.family or head.profile
    drive = f"{head.device:>2} {named}" if head.device else named
    if head.profile != profile.id:
        return FileAbout(drive, "other family", alarm=True)
    known = [code for code in values.raws if code in raws and profile.get(code)]
    different = [code for code in known if raws[code] != values.raws[code]]
    count = sum(is_setting(profile, profile[code]) for code in different)
    if not known:
        return FileAbout(drive, "not compared")
    return FileAbout(
        drive, f"{count} {'differs' if count == 1 else 'differ'}" if count else "equal"
    )
