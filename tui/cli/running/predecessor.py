"""The newest backup of a drive or of its predecessor, for `restore --dry-run`."""

from __future__ import annotations

import asyncio
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from ..shared.errors import USAGE, Failure

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.drive.settings.parameter_set import ParameterSet
    from tui.drive.settings.restore_plan import Held, RestorePlan
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..shared.say import Messages

NO_BACKUP_FOUND = (
    "No backup of drive {device} on this line, or of a predecessor, is in this folder or in the"
    " backup folder. From a record, make one: drivepanel backup replay:FILE,at=TIME SET -d {device}"
    " -p PROFILE"
)


async def chosen_set(opened: OpenLine, session: DriveSession) -> tuple[Path, ParameterSet]:
    """Return the newest backup of this address. Raises Failure if there is none."""
    from tui.session.settings.predecessor import predecessor_set

    # a simulated line has a temporary port
    line = opened.text if opened.simulation is not None else session.line_text
    found = await asyncio.to_thread(predecessor_set, session.profile, line, session.device)
    if found is None:
        raise Failure(NO_BACKUP_FOUND.format(device=session.device), USAGE)
    return found


def say_predecessor(
    session: DriveSession, held: Held, old: Profile, values: ParameterSet, messages: Messages
) -> None:
    """Report how a drive compares with that of a set: identity, rating, firmware, settings."""
    from tui.drive.settings.replacement import (
        changed_settings,
        factory_count,
        identity_lines,
    )
    from tui.session.read.upload import head_of

    profile = session.profile
    for text in identity_lines(profile, head_of(session), held.raws, old, values):
        messages.tell(text)
    codes = changed_settings(profile, old, values)
    messages.tell(factory_count(profile, codes, held.raws, held.lacking).text)


def say_next_commands(
    line: str, session: DriveSession, path: Path, plan: RestorePlan, messages: Messages
) -> None:
    """Report the commands that write the set and test the drive; nothing is done."""
    if any(item.reason == "rating" for item in plan.items_of_kind("skip")):
        messages.tell("Motor data is left out. After comparing the nameplates, add --rating.")
    where, file, device = shlex.quote(line), shlex.quote(str(path)), session.device
    accepted = " --accept-line" if session.line.held else ""
    messages.tell("Nothing was written. To write it, and then to test the drive:")
    messages.tell(f"  drivepanel restore {where} {file} -d {device} --arm{accepted}")
    messages.tell(f"  drivepanel accept TEST.toml {where} -d {device} --arm{accepted}")
