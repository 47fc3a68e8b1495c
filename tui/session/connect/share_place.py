"""Meeting place of this user's programs on a line, and the name of this program there."""

from __future__ import annotations

import os
import sys
import uuid
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tui.bus.errors import NotShared
from tui.bus.program import Program, pid_namespace

from ..paths import state_folder
from .line_key import line_key

if TYPE_CHECKING:
    from tui.bus.share.place import Owner, SharePlace

PROGRAM = "drivepanel"
SHARE_GROUP_SETTING = "DRIVEPANEL_SHARE_GROUP"
"""Environment variable: the group of users that may attach to lines opened by this program."""
FOLDER_SETTING = "DRIVEPANEL_SHARE_FOLDER"
LOCKS = "lines"
"""Folder of the locks inside the state folder."""
USUAL_GROUP_FOLDER = "/run/drivepanel"
"""Folder for users of a group, unless the environment names another; the administrator makes it."""


def group_folder() -> Path:
    """Return the folder for users of a group; it may not exist."""
    return Path(os.environ.get(FOLDER_SETTING) or USUAL_GROUP_FOLDER)


def share_place(text: str) -> SharePlace | None:
    """The meeting place of a typed line; None on a system without local sockets.

    The socket is in the user's runtime folder, else in the state folder. The lock is in the state
    folder, which persists after log-out. If a group may share the line, both are in the group's
    folder, so that its members find them.

    Raises NotShared if a named group has no such folder.
    """
    if os.name != "posix":
        return None
    from tui.bus.share.place import SharePlace

    key = line_key(text)
    folder = group_folder()
    if group := os.environ.get(SHARE_GROUP_SETTING):
        return SharePlace(key, folder, (folder,), group_number(group, folder))
    common = SharePlace(key, folder, (folder,), 0)
    if os.access(common.lock_path, os.R_OK | os.W_OK):
        return replace(common, group=common.lock_path.stat().st_gid)
    state = state_folder()
    folders = [state / "run"]
    if runtime := os.environ.get("XDG_RUNTIME_DIR"):
        folders.insert(0, Path(runtime) / PROGRAM)
    return SharePlace(key, state / LOCKS, tuple(folders))


def group_number(group: str, folder: Path) -> int:
    """Number of a group whose users share lines in a folder. Raises NotShared."""
    import grp

    try:
        number = grp.getgrnam(group).gr_gid
    except KeyError:
        text = f"There is no group {group}; a line is shared with a group of users."
        raise NotShared(text) from None
    try:
        found = folder.stat()
    except OSError:
        found = None
    if found is None or found.st_gid != number or not os.access(folder, os.W_OK):
        raise NotShared(
            f"To share lines with the group {group}, {folder} has to belong to it:"
            f" sudo install -d -m 2770 -g {group} {folder}"
        )
    return number


def this_program(name: str) -> Program:
    """This program as shown to others on the line."""
    user = os.environ.get("USER") or os.environ.get("LOGNAME") or ""
    # as other programs accept it: the environment holds any bytes
    texts = (text.encode(errors="replace").decode()[:200] for text in (name, user, _terminal()))
    shown, user, terminal = texts
    return Program(uuid.uuid4().hex, shown, os.getpid(), user, terminal, pid_namespace())


def _terminal() -> str:
    """Terminal of this program; empty if it has none."""
    for stream in (sys.__stdin__, sys.__stdout__, sys.__stderr__):
        with suppress(OSError, ValueError, AttributeError):
            return os.ttyname(stream.fileno()).removeprefix("/dev/")  # type: ignore[union-attr]
    return ""


def owners() -> list[Owner]:
    """The processes that at present hold lines of this user and of the group."""
    if os.name != "posix":
        return []
    from tui.bus.share.place import is_locked, owner_of_lock

    found = []
    for folder in (state_folder() / LOCKS, group_folder()):
        for lock in sorted(folder.glob("*.lock")):
            owner = owner_of_lock(lock)
            if owner is not None and owner.line and is_locked(lock):
                found.append(owner)
    return found
