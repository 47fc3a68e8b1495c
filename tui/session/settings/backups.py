"""Files of parameter sets in the folders of backups."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tui.drive.errors import DriveError
from tui.drive.settings.set_file import read_set

from ..paths import state_folder

if TYPE_CHECKING:
    from ..drive import DriveSession

FILES_LISTED = 200
"""Files that are listed at most."""
SUFFIX = ".toml"


def files_in(folders: Iterable[Path]) -> list[Path]:
    """The files of these folders with the right ending, newest first; none is read."""
    found: dict[Path, float] = {}
    for folder in folders:
        try:
            for path in folder.iterdir():
                if path.suffix == SUFFIX and path.is_file():
                    found[path] = path.stat().st_mtime
        except OSError:
            continue
    return sorted(found, key=lambda path: -found[path])[:FILES_LISTED]


def newest_backup(session: DriveSession) -> Path | None:
    """Return the newest parameter set of a drive in the folders of backups; reads their files.

    The file names the family, the line and the address, so it is not one of another machine.
    """
    wanted = (session.profile.id, session.line_text, session.device)
    for path in files_in([Path.cwd(), state_folder()]):
        with suppress(DriveError):
            head = read_set(path, path.name).head
            if (head.profile, head.line, head.device) == wanted:
                return path
    return None
