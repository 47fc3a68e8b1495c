"""Small JSON files in the state folder."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from tui.drive.small_file import read_small_text, replace_file

NOWHERE = Path(os.devnull) / "no home folder is known: name a folder in DRIVEPANEL_STATE"
"""Path for a missing state folder: every use of it fails, with its name as the reason."""
FOLDER_MODE = 0o700
LONGEST_STORED = 1_000_000
"""Most bytes of such a file; a longer one is not read."""


def make_folder(folder: Path) -> None:
    """Create a folder and its parents if missing, for the owner only (mode 700). Raises OSError."""
    if NOWHERE in (folder, *folder.parents):
        raise OSError(errno.ENOENT, NOWHERE.name)
    missing = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    for path in reversed(missing):
        path.mkdir(mode=FOLDER_MODE, exist_ok=True)
    if not folder.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))


def stored_json(file: Path) -> object:
    """Return the contents of a JSON file; None if it cannot be read or decoded, or is too long."""
    try:
        text = read_small_text(file, LONGEST_STORED)
        import json  # imported late: speeds up a start without such files

        return json.loads(text)
    except (OSError, ValueError, RecursionError):
        return None


def store_json(file: Path, what: object) -> None:
    """Write a JSON file completely or not at all. Raises OSError."""
    import json

    make_folder(file.parent)
    # JSON escapes keep lone surrogates, which UTF-8 cannot encode
    replace_file(file, json.dumps(what, indent=1).encode(), flushed=False)
