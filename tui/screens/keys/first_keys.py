"""The first start on a terminal: whether its F12 arrives, tried while no line is open."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from tui.session.paths import state_folder
from tui.session.stored import store_json, stored_json

OFFER = "First start on this terminal: press F12, a stop key, to see whether it arrives."
ARRIVED = "F12 arrived: it stops motors from this terminal, as Space and F9 do."


def terminal_name() -> str:
    """Return the name that the terminal reports."""
    return os.environ.get("TERM", "")


def was_tried() -> bool:
    """Return True if F12 arrived on this kind of terminal before."""
    tried = stored_json(_file())
    return isinstance(tried, list) and terminal_name() in tried


def remember() -> None:
    """F12 arrived; a folder that cannot be written is not an error."""
    tried = stored_json(_file())
    known = [*(tried if isinstance(tried, list) else []), terminal_name()]
    with suppress(OSError):
        store_json(_file(), sorted({item for item in known if isinstance(item, str)}))


def unknown_text(data: bytes) -> str:
    """Return the message about a sequence that no known terminal sends."""
    shown = "".join("ESC " if byte == 0x1B else chr(byte) for byte in data if byte < 0x7F)
    return (
        f"A key arrived that the panel does not know ({shown.strip()}). If it was F12, it does"
        " nothing on this terminal: stop with Space, or set the terminal to send xterm's keys."
    )


def _file() -> Path:
    return state_folder() / "terminals.json"
