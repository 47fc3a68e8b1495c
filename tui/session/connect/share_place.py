"""Where programs of this user meet on a line, and what this one is called there."""

from __future__ import annotations

import os
import sys
import uuid
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tui.bus.program import Program

from ..paths import state_folder
from .line_key import line_key

if TYPE_CHECKING:
    from tui.bus.share.place import SharePlace

PROGRAM = "drivepanel"


def share_place(text: str) -> SharePlace | None:
    """The meeting place of a line as it was typed; None on a system without local sockets.

    The socket lies in the user's runtime folder, else in the state folder. The lock lies in the
    state folder, which no log-out takes away.
    """
    if os.name != "posix":
        return None
    from tui.bus.share.place import SharePlace

    state = state_folder()
    folders = [state / "run"]
    if runtime := os.environ.get("XDG_RUNTIME_DIR"):
        folders.insert(0, Path(runtime) / PROGRAM)
    return SharePlace(line_key(text), state / "lines", tuple(folders))


def this_program(name: str) -> Program:
    """This program as others on the line are told of it."""
    user = os.environ.get("USER") or os.environ.get("LOGNAME") or ""
    return Program(uuid.uuid4().hex, name, os.getpid(), user, _terminal())


def _terminal() -> str:
    """The terminal of this program; empty where it has none."""
    for stream in (sys.__stdin__, sys.__stdout__, sys.__stderr__):
        with suppress(OSError, ValueError, AttributeError):
            return os.ttyname(stream.fileno()).removeprefix("/dev/")  # type: ignore[union-attr]
    return ""
