"""State kept between runs: its folder, the lines used lately, their addresses."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from .stored import NOWHERE, store_json, stored_json

RECENT_LENGTH = 8
ADDRESSES_LENGTH = 50
"""Lines whose addresses are remembered."""


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


def recent_lines() -> list[str]:
    """Lines used lately, the last one first; none where the file is missing or damaged."""
    stored = stored_json(_recent_file())
    return [text for text in stored if isinstance(text, str)] if isinstance(stored, list) else []


def remember_line(text: str) -> None:
    """Put a line first among the recent ones; a folder that cannot be written is not an error."""
    lines = [text, *(line for line in recent_lines() if line != text)][:RECENT_LENGTH]
    _keep(_recent_file(), lines)


def address_text(key: str) -> str:
    """The addresses of the last search on a line, as they were typed; empty where none were."""
    requested = _all_addresses().get(key, "")
    return requested if isinstance(requested, str) else ""


def remember_addresses(key: str, text: str) -> None:
    """Keep the addresses to search on a line; a folder that cannot be written is not an error."""
    known = {line: requested for line, requested in _all_addresses().items() if line != key}
    latest = {key: text, **known}
    _keep(_addresses_file(), dict(list(latest.items())[:ADDRESSES_LENGTH]))


def _all_addresses() -> dict[str, object]:
    stored = stored_json(_addresses_file())
    return stored if isinstance(stored, dict) else {}


def _keep(file: Path, what: object) -> None:
    with suppress(OSError):
        store_json(file, what)


def _addresses_file() -> Path:
    return state_folder() / "addresses.json"


def _recent_file() -> Path:
    return state_folder() / "recent-lines.json"
