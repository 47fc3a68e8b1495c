"""Serial ports of this computer: their list, their users, and opening one for Modbus."""

from __future__ import annotations

import errno
import os
import re
import stat
import sys
from contextlib import suppress
from typing import NamedTuple

import serial
from serial.tools import list_ports as system_ports

from ..errors import PortBusy, PortMissing, PortRefused

BUSY = frozenset({errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK})
MISSING = frozenset({errno.ENOENT, errno.ENODEV, errno.ENXIO, errno.ENOTDIR})
DENIED = frozenset({errno.EACCES, errno.EPERM})
PSEUDO_TERMINALS = range(136, 144)
"""Major device numbers of the slave sides of pseudo-terminals on Linux."""
MEMORY = 1
"""Major device number on Linux of /dev/null and its like, which every program has open."""


class PortInfo(NamedTuple):
    """A serial port that a person may choose."""

    path: str
    description: str


def list_ports() -> list[PortInfo]:
    """The serial ports of this machine, in the order of their names."""
    ports = (
        PortInfo(port.device, "" if port.description in (None, "n/a") else port.description)
        for port in system_ports.comports()
    )
    return sorted(ports, key=lambda port: _by_number(port.path))


def _by_number(path: str) -> list[tuple[int, str]]:
    """A key that puts ttyUSB2 before ttyUSB10."""
    return [
        (int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path)
    ]


def is_pseudo_terminal(path: str) -> bool:
    """Return True if a path is the slave side of a pseudo-terminal, which has no parity."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return False
    if not stat.S_ISCHR(found.st_mode):
        return False
    if sys.platform.startswith("linux"):
        return os.major(found.st_rdev) in PSEUDO_TERMINALS
    return re.fullmatch(r"/dev/(ttys\d+|pts/\d+|tty[p-w]\w)", os.path.realpath(path)) is not None


def _is_no_port(path: str) -> bool:
    """Return True if there is something that is surely no serial port: a file, a folder,
    /dev/null."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return False
    if not stat.S_ISCHR(found.st_mode):
        return True
    return sys.platform.startswith("linux") and os.major(found.st_rdev) == MEMORY


OURS = {"tui": "drivepanel", "tui.keeper": "drivepanel, the keeper of the line"}
"""Modules of this package that are run by their names, and what people call them."""


def holder(path: str) -> str | None:
    """Name and process id of the program that holds a port, None if the system does not report
    them.

    Linux only: the owner of the lock on the port, else another process that has it open.
    """
    if _is_no_port(path):
        return None
    try:
        found = os.stat(path)
        pids = _lock_owners(found) or _openers(os.path.realpath(path))
    except (OSError, ValueError):
        return None
    others = [pid for pid in pids if pid != os.getpid()]
    names = [f"{_name(pid)} (pid {pid})" for pid in others or pids]
    return ", ".join(names) or None


def _lock_owners(port: os.stat_result) -> list[int]:
    """Processes with a lock on the port, from /proc/locks."""
    wanted = f"{os.major(port.st_dev):02x}:{os.minor(port.st_dev):02x}:{port.st_ino}"
    owners = []
    with suppress(OSError), open("/proc/locks", encoding="ascii") as locks:
        for line in locks:
            fields = line.split()
            if wanted in fields and "->" not in fields:
                owners.append(int(fields[fields.index(wanted) - 1]))
    return [pid for pid in owners if pid > 0]


def _openers(path: str) -> list[int]:
    """Processes that have the port open, as far as the system lets this user see."""
    with suppress(OSError):
        processes = [entry for entry in os.scandir("/proc") if entry.name.isdecimal()]
        return [int(entry.name) for entry in processes if _has_open(entry.path, path)]
    return []


def _has_open(process: str, path: str) -> bool:
    with suppress(OSError), os.scandir(f"{process}/fd") as descriptors:
        for descriptor in descriptors:
            with suppress(OSError):
                if os.readlink(descriptor.path) == path:
                    return True
    return False


def _name(pid: int) -> str:
    """Return the name of a process; for a Python program that of its script."""
    try:
        with open(f"/proc/{pid}/comm", encoding="utf-8", errors="replace") as file:
            name = file.read().strip()
        if not name.startswith("python"):
            return name
        with open(f"/proc/{pid}/cmdline", encoding="utf-8", errors="replace") as file:
            arguments = file.read().split("\0")
    except OSError:
        return "a program"
    scripts = [part for part in arguments[1:] if part and not part.startswith("-")]
    script = os.path.basename(scripts[0]) if scripts else name
    return OURS.get(script, script)


def other_openers(path: str) -> str:
    """Other programs that have the port open; empty if none is found."""
    if _is_no_port(path):
        return ""
    pids = [pid for pid in _openers(os.path.realpath(path)) if pid != os.getpid()]
    return ", ".join(f"{_name(pid)} (pid {pid})" for pid in pids)


def open_serial(path: str, baud: int, format: str, *, alone: bool = True) -> serial.Serial:
    """Open a port for this program `alone`, raw, with the format of the line.

    A pseudo-terminal has no parity and is opened without: the returned port says so in its
    `parity`. Raises PortBusy, PortMissing, PortRefused.
    """
    if is_pseudo_terminal(path):
        # the C library refuses parity here, or ignores it silently
        return _open(path, baud, f"8N{format[2]}", alone=alone)
    port = _open(path, baud, format, alone=alone)
    if not _has_parity(port):
        port.close()
        raise PortRefused(path, f"it does not support parity {format[1]}.")
    return port


def _has_parity(port: serial.Serial) -> bool:
    """Return True if a port took the parity it was asked for; a refusal can be silent on POSIX."""
    if port.parity == serial.PARITY_NONE or sys.platform == "win32":
        return True
    import termios

    return bool(termios.tcgetattr(port.fileno())[2] & termios.PARENB)


def _open(path: str, baud: int, format_: str, *, alone: bool) -> serial.Serial:
    # an inter-byte timeout of 0 makes a read of nothing fail on POSIX instead of looking
    # like the end of the port
    posix = os.name == "posix"
    try:
        port = serial.Serial(
            path,
            baud,
            bytesize=int(format_[0]),
            parity=format_[1],
            stopbits=int(format_[2]),
            timeout=0,
            inter_byte_timeout=0 if posix else None,
            exclusive=alone or None,
        )
    except (OSError, ValueError) as error:
        raise port_error(path, baud, format_, error) from error
    except Exception as error:
        # termios.error is neither an OSError nor there on every system
        if type(error).__name__ != "error":
            raise
        raise port_error(path, baud, format_, error) from error
    # USB adapters collect bytes for 16 ms unless told not to; not every driver knows that
    with suppress(OSError, ValueError, NotImplementedError, AttributeError):
        port.set_low_latency_mode(True)
    return port


def port_error(
    path: str, baud: int, format_: str, error: Exception
) -> PortBusy | PortMissing | PortRefused:
    """Return the error for a port that could not be opened."""
    number = getattr(error, "errno", None)
    text = str(error)
    if number in BUSY:
        return PortBusy(path, holder(path))
    if number in MISSING or (os.name == "nt" and "FileNotFoundError" in text):
        return PortMissing(path, [port.path for port in list_ports()])
    if os.name == "nt" and "PermissionError" in text:
        return PortBusy(path)
    if number in DENIED:
        return PortRefused(path, _who_may(path))
    if _is_no_port(path):
        return PortRefused(path, "it is not a serial port. `drivepanel ports` lists those.")
    if number is None or number == errno.EINVAL:
        return PortRefused(path, f"it does not support {baud} baud {format_}.")
    return PortRefused(path, f"{os.strerror(number)}.")


def _who_may(path: str) -> str:
    """Why this user may not use a port, and how that is changed."""

    seen = see_port(path)
    user, group = seen.user, seen.group
    if not group:
        return (
            f"{user} may not use it, and no group of users may. `drivepanel why {path}` shows what"
            " to do."
        )
    if seen.in_group:
        return f"{user} is in its group {group} since the next log-in only: log out and in again."
    return (
        f"only the group {group} may use it, and {user} is not in it: sudo usermod -a -G"
        f" {group} {user}, then log in again."
    )


class PortSeen(NamedTuple):
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
    from . import port_names  # the panel starts without it

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
