"""Keys of the panel that unblock a command, for every text that names them."""

from __future__ import annotations

from collections.abc import Mapping

from tui.drive.command_blocked import CommandBlocked, UnblockHint

KEYS: Mapping[UnblockHint, str] = {
    "set-up": "6 opens Control.",
    "take-control": "t takes the control.",
}
"""By remedy, the key of the panel."""


def way_by_key(held: CommandBlocked) -> str:
    """Return the remedy for a screen: its key, else the remedy of the profile."""
    return KEYS.get(held.way, held.remedy)


def block_reason_text(held: CommandBlocked) -> str:
    """Return the reason against a command and its remedy, as used outside the panel too."""
    key = KEYS.get(held.way, "")
    return " ".join(
        part for part in (held.text, held.remedy, f"In the panel {key}" if key else "") if part
    )
