"""What the panel keeps between runs: its folder, the lines used lately, whom they were asked."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

RECENT_LENGTH = 8
ADDRESSES_LENGTH = 50
"""Lines whose addresses are remembered."""


NOWHERE = Path(os.devnull) / "no home folder is known: name a folder in DRIVEPANEL_STATE"
"""In place of the state folder where there is none: whatever is tried there fails, and says why."""
FOLDER_MODE = 0o700


def state_folder() -> Path:
    """The folder for what the panel keeps; `DRIVEPANEL_STATE` names another."""
    if configured := os.environ.get("DRIVEPANEL_STATE"):
        return Path(configured)
    from platformdirs import user_state_path

    try:
        folder = user_state_path("drivepanel", appauthor=False)
    except RuntimeError:
        return NOWHERE
    # without a home it would lie wherever the panel happens to be started
    return folder if folder.is_absolute() else NOWHERE


def make_folder(folder: Path) -> None:
    """See that a folder is there; those that are made are their owner's alone. Raises OSError."""
    if NOWHERE in (folder, *folder.parents):
        raise OSError(errno.ENOENT, NOWHERE.name)
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    for one in reversed(missing):
        one.mkdir(mode=FOLDER_MODE, exist_ok=True)
    if not folder.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))


def recent_lines() -> list[str]:
    """Lines used lately, the last one first; none where the file is missing or damaged."""
    try:
        stored = json.loads(_recent_file().read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    return [text for text in stored if isinstance(text, str)] if isinstance(stored, list) else []


def remember_line(text: str) -> None:
    """Put a line first among the recent ones; a folder that cannot be written is no error."""
    lines = [text, *(line for line in recent_lines() if line != text)][:RECENT_LENGTH]
    _keep(_recent_file(), lines)


def addresses_asked(key: str) -> str:
    """The addresses that were asked last on a line, as they were typed; empty where none were."""
    asked = _all_addresses().get(key, "")
    return asked if isinstance(asked, str) else ""


def remember_addresses(key: str, text: str) -> None:
    """Keep the addresses to ask on a line; a folder that cannot be written is no error."""
    known = {line: asked for line, asked in _all_addresses().items() if line != key}
    latest = {key: text, **known}
    _keep(_addresses_file(), dict(list(latest.items())[:ADDRESSES_LENGTH]))


def _all_addresses() -> dict[str, object]:
    try:
        stored = json.loads(_addresses_file().read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return stored if isinstance(stored, dict) else {}


def _keep(file: Path, what: object) -> None:
    try:
        make_folder(file.parent)
        part = file.with_suffix(".part")
        part.write_text(json.dumps(what, indent=1), encoding="utf-8")
        part.replace(file)
    except OSError:
        return


def _addresses_file() -> Path:
    return state_folder() / "addresses.json"


def _recent_file() -> Path:
    return state_folder() / "recent-lines.json"
