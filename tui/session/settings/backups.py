"""Files of parameter sets in the folders of backups."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.settings.set_file import load_set
from tui.drive.small_file import read_small_text

from ..connect.line_key import line_key
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


def newest_set(
    families: Collection[str], line: str, device: int
) -> tuple[Path, ParameterSet] | None:
    """Return the newest set of these families at an address, with its file; reads files.

    The set names the line and the address, so it is not one of another machine.
    """
    key = line_key(line)
    # a folder may have many sets of other drives: parsing each of them for each drive takes long
    own = re.compile(rf"^\s*device\s*=\s*{device}\b", re.MULTILINE)
    for path in files_in([Path.cwd(), state_folder()]):
        with suppress(DriveError, OSError, UnicodeDecodeError):
            text = read_small_text(path)
            if own.search(text) is None:
                continue
            values = load_set(text, path.name, library.load)
            head = values.head
            known = head.profile in families and head.device == device and head.line
            if known and line_key(head.line) == key:
                return path, values
    return None


def newest_backup(session: DriveSession) -> Path | None:
    """Return the newest parameter set of a drive in the folders of backups; reads their files."""
    found = newest_set([session.profile.id], session.line_text, session.device)
    return found[0] if found is not None else None
