"""Facts about a serial port found without opening it: rights, holders, adapter latency."""

from __future__ import annotations

import os
import stat
import sys
from contextlib import suppress
from dataclasses import dataclass

from . import port_names
from .ports import holder, is_pseudo_terminal, other_openers


@dataclass(frozen=True, slots=True)
class PortSeen:
    """A serial port as the system shows it."""

    path: str
    there: bool = True
    permitted: bool = True
    """True if this user may read and write it."""
    group: str = ""
    """The group whose users may open it, if the port has one."""
    user: str = ""
    in_group: bool = False
    """True if the user was put into the group and has not logged in since."""
    holder: str = ""
    """Programs that hold it, this one aside; with their process ids."""
    others: str = ""
    """Other programs that have it open."""
    latency: int | None = None
    """Milliseconds for which its adapter may keep a byte back; None if it does not report it."""


def see_port(path: str) -> PortSeen:
    """Look at a port; nothing is opened and nothing is sent."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return PortSeen(path, there=False)
    group, in_group = _group(found)
    held = holder(path) or ""
    return PortSeen(
        path,
        permitted=os.access(path, os.R_OK | os.W_OK),
        group=group,
        user=_user(),
        in_group=in_group,
        holder="" if f"(pid {os.getpid()})" in held else held,
        others="" if is_pseudo_terminal(path) else other_openers(path),
        latency=latency_of(path),
    )


def latency_of(path: str) -> int | None:
    """The latency timer of an adapter in ms, if its driver has one."""
    name = os.path.basename(os.path.realpath(path))
    with suppress(ValueError):
        place = port_names.SYSTEM_PORTS / name / "device"
        return int(port_names.first_line(str(place), "latency_timer"))
    return None


def _group(found: os.stat_result) -> tuple[str, bool]:
    """The group that may use a port, and whether this user is in it since the next log-in only."""
    wanted = stat.S_IRGRP | stat.S_IWGRP
    if sys.platform == "win32" or found.st_mode & wanted != wanted:
        return "", False
    import grp

    try:
        group = grp.getgrgid(found.st_gid)
    except KeyError:
        return str(found.st_gid), False
    listed = _user() in group.gr_mem
    return group.gr_name, listed and found.st_gid not in (*os.getgroups(), os.getegid())


def _user() -> str:
    """The name of the user of this program."""
    if sys.platform == "win32":
        return os.environ.get("USERNAME", "")
    import pwd

    with suppress(KeyError):
        return pwd.getpwuid(os.geteuid()).pw_name
    return str(os.geteuid())
