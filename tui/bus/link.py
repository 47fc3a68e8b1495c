"""Links of a line: a serial port, Modbus TCP, or RTU over TCP; parsing and labels."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace

from tui.wire.frames import FAST, character_seconds, is_format, silent_seconds

from .errors import LinkSyntaxError

FORMS = (
    "serial:PATH[,BAUD[,FORMAT]] such as serial:/dev/ttyUSB0,19200,8E1, tcp:HOST[:PORT], "
    "or rtu-tcp:HOST:PORT; ,timeout=SECONDS at the end sets the longest wait for a reply; "
    ",unit=255 or ,unit=0 after tcp: is for a gateway that has one drive, as device 1"
)
MODBUS_PORT = 502
_OPTION = re.compile(r"(.*),\s*(timeout|unit)\s*=([^,]*)", re.IGNORECASE)
ONLY_UNITS = (255, 0)
"""Units that address the only drive of a gateway (Modbus Messaging on TCP/IP, 4.4.1.2)."""
ONLY_DEVICE = 1
"""The device that such a drive is on a line with a unit."""
SHORTEST_TIMEOUT, LONGEST_TIMEOUT = 0.02, 30.0
_PORT_NAME = re.compile(r"(?:/dev/.+|\\\\\.\\.+|COM\d+)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class SerialLink:
    """A serial port; `format` is data bits, parity (N, E, O) and stop bits."""

    path: str
    baud: int = 19200
    format: str = "8E1"
    timeout: float | None = None
    """Longest wait for a reply in seconds, if a person has set it."""


@dataclass(frozen=True, slots=True)
class TcpLink:
    """A Modbus TCP server: a drive with an Ethernet card, or a gateway."""

    host: str
    port: int = MODBUS_PORT
    timeout: float | None = None
    unit: int | None = None
    """The unit by which a gateway reaches its only drive, device 1 here; None for its address."""

    def unit_of(self, device: int) -> int:
        """The unit that requests to a device carry."""
        return device if self.unit is None or device != ONLY_DEVICE else self.unit


@dataclass(frozen=True, slots=True)
class RtuTcpLink:
    """A device server that carries the bytes of a serial line over TCP."""

    host: str
    port: int
    timeout: float | None = None


Link = SerialLink | TcpLink | RtuTcpLink


@dataclass(frozen=True, slots=True)
class UsualSettings:
    """Settings of a serial line if a text names none."""

    baud: int = 19200
    format: str = "8E1"


def parse_link(text: str, usual: UsualSettings | None = None) -> Link:
    """The link that a person typed; `usual` are the settings if none are named.

    Accepts `serial:PATH[,BAUD[,FORMAT]]`, a bare port (`/dev/ttyUSB0`, `COM3`, any path that
    exists), `tcp:HOST[:PORT]` and `rtu-tcp:HOST:PORT`, with IPv6 hosts in brackets. Each may end
    with `,timeout=SECONDS` (0.02..30) if a drive or a gateway is slow, and `tcp:` with `,unit=255`
    or `,unit=0` if the gateway answers only that unit. Raises LinkSyntaxError.
    """
    text = rest = text.strip()
    options: dict[str, str] = {}
    while match := _OPTION.fullmatch(rest):
        rest, name = match[1], match[2].casefold()
        if name in options:
            raise LinkSyntaxError(f"{text}: {name} is given twice. Write it once.")
        options[name] = match[3].strip()
    link = _parse(rest, usual)
    if "unit" in options:
        if not isinstance(link, TcpLink):
            raise LinkSyntaxError(f"{text}: only tcp: lines have a unit. Leave out unit=.")
        link = replace(link, unit=_unit(text, options["unit"]))
    if "timeout" in options:
        link = replace(link, timeout=_seconds(text, options["timeout"]))
    return link


def _unit(text: str, typed: str) -> int:
    if typed not in map(str, ONLY_UNITS):
        raise LinkSyntaxError(
            f"{text}: {typed!r} is not a unit for a gateway with one drive. Write unit=255 or "
            "unit=0. Drives at other units are devices: use -d."
        )
    return int(typed)


def _seconds(text: str, typed: str) -> float:
    try:
        seconds = float(typed)
    except ValueError:
        seconds = 0.0
    if not SHORTEST_TIMEOUT <= seconds <= LONGEST_TIMEOUT:
        raise LinkSyntaxError(
            f"{text}: {typed!r} is not a timeout. Write seconds from {SHORTEST_TIMEOUT:g} to "
            f"{LONGEST_TIMEOUT:g}, such as timeout=2."
        )
    return seconds


def _parse(text: str, usual: UsualSettings | None) -> Link:
    kind, colon, rest = text.partition(":")
    match kind.casefold() if colon else "":
        case "serial":
            return _serial(text, rest, usual or UsualSettings())
        case "tcp":
            host, port = _host_and_port(text, rest)
            return TcpLink(host, MODBUS_PORT if port is None else port)
        case "rtu-tcp":
            host, port = _host_and_port(text, rest)
            if port is None:
                raise LinkSyntaxError(f"{text}: the port is missing. Write rtu-tcp:{rest}:PORT.")
            return RtuTcpLink(host, port)
    path = text.partition(",")[0]
    if _PORT_NAME.fullmatch(path) or (path and os.path.exists(path)):
        return _serial(text, text, usual or UsualSettings())
    raise LinkSyntaxError(f"{text or 'An empty text'} is not a line. Write {FORMS}.")


def _serial(text: str, rest: str, usual: UsualSettings) -> SerialLink:
    path, *settings = (part.strip() for part in rest.split(","))
    if not path:
        raise LinkSyntaxError(f"{text}: the port is missing. Write {FORMS}.")
    if len(settings) > 2:
        raise LinkSyntaxError(f"{text}: too many settings. Write {FORMS}.")
    baud = settings[0] if settings else str(usual.baud)
    # check the length first: int() fails on very long numbers
    if not (re.fullmatch("[0-9]{1,9}", baud) and 50 <= int(baud) <= 4_000_000):
        raise LinkSyntaxError(f"{text}: {baud!r} is not a baud rate. Write one such as 19200.")
    format_ = settings[1].upper() if len(settings) > 1 else usual.format
    if not is_format(format_):
        raise LinkSyntaxError(
            f"{text}: {format_!r} is not a format. Write 8E1, 8N1, 8O1, 8N2 or the like; "
            "Modbus RTU needs eight data bits."
        )
    return SerialLink(path, int(baud), format_)


def _host_and_port(text: str, rest: str) -> tuple[str, int | None]:
    match = re.fullmatch(r"(?:\[([^\[\]]+)\]|([^:\[\]\s]+))(?::(\d{1,9}))?", rest.strip(), re.ASCII)
    if match is None:
        raise LinkSyntaxError(
            f"{text}: no host, or a host that cannot be understood. Write {FORMS}; "
            "an IPv6 address goes in brackets, [::1]."
        )
    host = match[1] or match[2]
    if match[3] is None:
        return host, None
    port = int(match[3])
    if not 1 <= port <= 65535:
        raise LinkSyntaxError(f"{text}: the port is 1 to 65535.")
    return host, port


def label(link: Link) -> str:
    """Return the link as it is written: `serial:/dev/ttyUSB0,19200,8E1`, `tcp:10.0.0.5:502`."""
    timeout = "" if link.timeout is None else f",timeout={link.timeout:g}"
    match link:
        case SerialLink(path, baud, format_):
            return f"serial:{path},{baud},{format_}{timeout}"
        case TcpLink(host, port, _, unit):
            only = "" if unit is None else f",unit={unit}"
            return f"tcp:{_bracketed(host)}:{port}{only}{timeout}"
        case RtuTcpLink(host, port):
            return f"rtu-tcp:{_bracketed(host)}:{port}{timeout}"


def absolute(link: Link) -> Link:
    """The same with the whole path of its port, for a process in another folder."""
    if isinstance(link, SerialLink) and os.path.exists(link.path):
        return replace(link, path=os.path.abspath(link.path))
    return link


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


_BEHIND_A_SERVER = FAST, "8E1"
"""The rate behind a device server is unknown; RTU over TCP counts as this."""


def character_time(link: Link) -> float:
    """Seconds for one character, 19 200 baud 8E1 behind a device server; 0 over Modbus TCP."""
    match link:
        case SerialLink(_, baud, format_):
            return character_seconds(baud, format_)
        case RtuTcpLink():
            return character_seconds(*_BEHIND_A_SERVER)
        case TcpLink():
            return 0.0


def silence(link: Link) -> float:
    """Seconds of silence between two frames; 0 over Modbus TCP."""
    match link:
        case SerialLink(_, baud, format_):
            return silent_seconds(baud, format_)
        case RtuTcpLink():
            return silent_seconds(*_BEHIND_A_SERVER)
        case TcpLink():
            return 0.0
