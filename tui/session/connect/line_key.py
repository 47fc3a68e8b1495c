"""Key of a line, equal for all spellings of the line."""

from __future__ import annotations

import re

from tui.bus.errors import LinkSyntaxError

from .host_names import host_key

SIMULATED_PREFIX = "sim:"
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
