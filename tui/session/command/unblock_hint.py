"""Keys of the panel that unblock a command, for every text that names them."""

from __future__ import annotations

from collections.abc import Mapping

from tui.drive.command_blocked import CommandBlocked, UnblockHint

KEYS: Mapping[UnblockHint, str] = {
    "set-up": "Press 6 for Control.",
    "take-control": "Press t to take control.",
}
"""By remedy, the key of the panel."""
KEYS_OF_PANEL: Mapping[UnblockHint, str] = {
    "set-up": "In the panel, press 6 for Control.",
    "take-control": "In the panel, press t on Monitor to take control.",
}
"""The same for a text that is read outside the panel."""


def way_by_key(held: CommandBlocked) -> str:
    """Return the remedy for a screen: its key, else the remedy of the profile."""
    return KEYS.get(held.way, held.remedy)


def block_reason_text(held: CommandBlocked) -> str:
    """Return the reason against a command and its remedy, as used outside the panel too."""
    parts = (held.text, held.remedy, KEYS_OF_PANEL.get(held.way, ""))
    return " ".join(part for part in parts if part)
