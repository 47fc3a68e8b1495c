"""Address of a host, as far as this computer knows it without a name server.

A name server that is unreachable would delay a stop. Names are those of the hosts file.
"""

from __future__ import annotations

import os
import socket
from functools import lru_cache
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path

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
