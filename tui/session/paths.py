"""What the panel keeps between runs: its folder, and the lines used lately."""

from __future__ import annotations

import json
import os
from pathlib import Path

RECENT_LENGTH = 8


def state_folder() -> Path:
    """The folder for what the panel keeps; `DRIVEPANEL_STATE` names another."""
    if configured := os.environ.get("DRIVEPANEL_STATE"):
        return Path(configured)
    from platformdirs import user_state_path

    return user_state_path("drivepanel", appauthor=False)


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
    file = _recent_file()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(".part")
        part.write_text(json.dumps(lines, indent=1), encoding="utf-8")
        part.replace(file)
    except OSError:
        return


def _recent_file() -> Path:
    return state_folder() / "recent-lines.json"
