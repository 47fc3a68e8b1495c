"""The state folder, and small JSON files in it, of whatever content."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

from tui.drive.small_file import read_small_text

NOWHERE = Path(os.devnull) / "no home folder is known: name a folder in DRIVEPANEL_STATE"
"""In place of the state folder where there is none: whatever is tried there fails, and says why."""
FOLDER_MODE = 0o700
LONGEST_STORED = 1_000_000
"""Bytes of a file that may be one of these."""


def make_folder(folder: Path) -> None:
    """See that a folder is there; those that are made are their owner's alone. Raises OSError."""
    if NOWHERE in (folder, *folder.parents):
        raise OSError(errno.ENOENT, NOWHERE.name)
    missing = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    for path in reversed(missing):
        path.mkdir(mode=FOLDER_MODE, exist_ok=True)
    if not folder.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))


def stored_json(file: Path) -> object:
    """Return the contents of a file; None if it is missing, damaged, too long, too deep or not a
    file."""
    try:
        return json.loads(read_small_text(file, LONGEST_STORED))
    except (OSError, ValueError, RecursionError):
        return None


def store_json(file: Path, what: object) -> None:
    """Put a file down, whole or not at all. Raises OSError."""
    make_folder(file.parent)
    part = file.with_suffix(".part")
    # what Unicode cannot hold, such as half a character, is kept as an escape
    part.write_text(json.dumps(what, indent=1), encoding="utf-8")
    part.replace(file)
