"""The F12 test at the first start on a terminal, while no line is open."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from tui.drive.plain import plain
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
    """Store that F12 arrives on this kind of terminal; ignore a folder that cannot be written."""
    tried = stored_json(_file())
    known = [*(tried if isinstance(tried, list) else []), terminal_name()]
    with suppress(OSError):
        store_json(_file(), sorted({item for item in known if isinstance(item, str)}))


def unknown_text(data: bytes) -> str:
    """Return the message for a sequence that no known terminal sends."""
    bytes_shown = ("ESC " if byte == 0x1B else plain(chr(byte)) for byte in data if byte < 0x7F)
    shown = "".join(bytes_shown)
    return (
        f"An unknown key arrived ({shown.strip()}). If it was F12, F12 does nothing on this"
        " terminal. Stop with Space, or set the terminal to send xterm keys."
    )


def _file() -> Path:
    return state_folder() / "terminals.json"
