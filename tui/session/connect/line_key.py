"""Key of a line, equal for all spellings of the line and of its host.

A name server that is unreachable would delay a stop. Names are those of the hosts file.
"""

from __future__ import annotations

import os
import re
import socket
from functools import lru_cache
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path

from tui.bus.errors import LinkSyntaxError

SIMULATED_PREFIX = "sim:"
REPLAY_PREFIX = "replay:"
_LABEL_SETTINGS = re.compile(r"\s\d+(\s8[NEO][12](\stimeout=\S+)?)?$", re.IGNORECASE)
"""Settings behind a path as a screen shows them: `/dev/ttyUSB0 19200 8E1`."""
_WINDOWS_PORT = re.compile(r"(?:\\\\\.\\)?(COM\d+)", re.IGNORECASE)


def line_key(text: str) -> str:
    """The line without its spelling: a port's lasting name, a host in small letters, no settings.

    Takes what a person typed, or a line's label. A port is called by its adapter where that has a
    name of its own, else by its real path, as links lead now; a host by its number where the hosts
    file has its name. An invalid line is its own key.
    """
    from tui.bus.link import RtuTcpLink, SerialLink, TcpLink, parse_link

    text = text.strip()
    if text.casefold().startswith(SIMULATED_PREFIX):
        return _simulated(text)
    if is_replay(text):
        return REPLAY_PREFIX + os.path.abspath(text[len(REPLAY_PREFIX) :].partition(",at=")[0])
    try:
        link = parse_link(text)
    except LinkSyntaxError:
        return text.casefold()
    match link:
        case SerialLink(path=path):
            return f"serial:{_port(path)}"
        case TcpLink(host=host, port=port, unit=unit):
            # with a unit, device 1 may be another drive than without
            only = "" if unit is None else f",unit={unit}"
            return f"tcp:{host_key(host)}:{port}{only}"
        case RtuTcpLink(host=host, port=port):
            return f"rtu-tcp:{host_key(host)}:{port}"


def is_replay(text: str) -> bool:
    """True if a LINE is the replay of a record."""
    return text.casefold().startswith(REPLAY_PREFIX)


def _port(path: str) -> str:
    if found := _WINDOWS_PORT.fullmatch(path):
        return found[1].upper()
    from tui.bus.transport.port_names import lasting_name

    return lasting_name(_LABEL_SETTINGS.sub("", path)).path


def _simulated(text: str) -> str:
    """A simulated line by its drives with their addresses, in the order of these."""
    from tui.simulator import SimulatorError, parse_drives

    try:
        drives = parse_drives(text[len(SIMULATED_PREFIX) :])
    except SimulatorError:
        return text.casefold()
    in_order = sorted(drives, key=lambda drive: drive.address)
    return SIMULATED_PREFIX + ",".join(f"{drive.profile}@{drive.address}" for drive in in_order)


HOSTS = Path("/etc/hosts")


def host_key(host: str) -> str:
    """The host in one spelling: an IP address, in brackets if it is IPv6, or a name."""
    name = host.casefold().rstrip(".")
    number = _number(name) or _number(_names().get(name, ""))
    if number is None:
        return name
    return f"[{number}]" if isinstance(number, IPv6Address) else str(number)


def _number(text: str) -> IPv4Address | IPv6Address | None:
    try:
        found = ip_address(text)
    except ValueError:
        return _short_number(text)
    mapped = found.ipv4_mapped if isinstance(found, IPv6Address) else None
    return mapped or found


def _short_number(text: str) -> IPv4Address | None:
    """Return an address that the system accepts as a number, also in short form: 127.1 is
    127.0.0.1."""
    if not text[:1].isdigit():
        return None
    try:
        return IPv4Address(socket.inet_aton(text))
    except OSError:
        return None


def _names() -> dict[str, str]:
    """IP addresses by name, from the present hosts file."""
    try:
        found = os.stat(HOSTS)
    except OSError:
        return {}
    return _read(HOSTS, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=2)
def _read(path: Path, _changed: int, _size: int) -> dict[str, str]:
    from tui.drive.small_file import read_small_text

    names: dict[str, str] = {}
    try:
        lines = read_small_text(path).splitlines()
    except (OSError, UnicodeDecodeError):
        return names
    for line in lines:
        number, *called = line.partition("#")[0].split() or [""]
        for name in called:
            key = name.casefold().rstrip(".")
            # a name with an IPv4 and an IPv6 address is reached by IPv4, as most devices are
            if key not in names or (":" in names[key] and ":" not in number):
                names[key] = number
    return names
