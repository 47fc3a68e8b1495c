"""Frames as packets: as Modbus/TCP, which every reader decodes, or as raw serial frames.

As Modbus/TCP, each drive is a server of its own, at 192.0.2.N for the device N. That network and
the master's are reserved for documentation.

The blocks of a pcapng file are made here, because the available libraries are unmaintained, need a
C library, or contain all network protocols. The required part of the format is small.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from ..frames import hex_text, sealed

SECTION, INTERFACE, PACKET = 0x0A0D0D0A, 1, 6
BYTE_ORDER = 0x1A2B3C4D
LINK_IPV4 = 228
"""Packets that begin with the header of IPv4."""
LINK_USER_0 = 147
"""Packets of a format that the reader must know."""
COMMENT, INTERFACE_NAME, PROGRAM, RESOLUTION = 1, 2, 4, 9
"""Option numbers; PROGRAM belongs to a section, the next two to an interface."""
NANOSECONDS = bytes([9])
_UNKNOWN_LENGTH = 0xFFFF_FFFF_FFFF_FFFF
_LONGEST_TEXT = 4096

_Option = tuple[int, bytes]


def section_block(program: str) -> bytes:
    """Return the beginning of a file, made by `program`."""
    head = struct.pack("<IHHQ", BYTE_ORDER, 1, 0, _UNKNOWN_LENGTH)
    return _block(SECTION, head, [(PROGRAM, _text(program))])


def interface_block(link_type: int, name: str) -> bytes:
    """Return the type and source of the packets that follow; times are in nanoseconds."""
    options = [(INTERFACE_NAME, _text(name)), (RESOLUTION, NANOSECONDS)]
    return _block(INTERFACE, struct.pack("<HHI", link_type, 0, 0), options)


def packet_block(data: bytes, wall: float, comment: str = "") -> bytes:
    """Return a packet; `wall` is its time in seconds since 1970."""
    high, low = divmod(round(wall * 1e6) * 1000, 1 << 32)
    head = struct.pack("<IIIII", 0, high, low, len(data), len(data))
    return _block(PACKET, head + _padded(data), [(COMMENT, _text(comment))] if comment else [])


def _text(text: str) -> bytes:
    return text.encode("utf-8", "replace")[:_LONGEST_TEXT]


def _block(kind: int, body: bytes, options: Sequence[_Option]) -> bytes:
    parts = [struct.pack("<HH", code, len(value)) + _padded(value) for code, value in options]
    reported = b"".join([*parts, bytes(4)]) if parts else b""
    length = struct.pack("<I", 12 + len(body) + len(reported))
    return struct.pack("<I", kind) + length + body + reported + length


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


MASTER = bytes([198, 51, 100, 1])
DRIVES = bytes([192, 0, 2])
SERVER_PORT, FIRST_CLIENT_PORT = 502, 49152
READ_RAW = (
    'tshark -o \'uat:user_dlts:"User 0 (DLT=147)","mbrtu","0","","0",""\''
    " -o mbrtu.crc_verification:TRUE -r FILE"
)
"""Command that decodes a file of raw frames; Wireshark has the same setting under DLT_USER."""
_TCP, _PUSH_AND_ACK, _WINDOW, _TIME_TO_LIVE = 6, 0x18, 0xFFFF, 64
_NO_FRAGMENTS = 0x4000


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet of a file, and its comment."""

    data: bytes
    comment: str = ""


class PacketForm(Protocol):
    """Makes the packets of one line's frames, in their order."""

    link_type: int

    def frame_packet(self, device: int, pdu: bytes, *, request: bool) -> Packet:
        """Return the packet of a whole frame: function and data, without the checksum."""
        ...

    def noise_packet(self, data: bytes) -> Packet | None:
        """Return the packet of bytes outside any frame; None if the format has none."""
        ...


class RtuForm:
    """Raw frames with their checksums, and bytes outside any frame."""

    link_type = LINK_USER_0

    def frame_packet(self, device: int, pdu: bytes, *, request: bool) -> Packet:
        """Return the frame as it was on the line."""
        return Packet(sealed(bytes([device]) + pdu))

    def noise_packet(self, data: bytes) -> Packet | None:
        """Return the bytes unchanged."""
        return Packet(data, "forms no frame")


@dataclass(slots=True)
class _Connection:
    """One master's connection to one drive, with the bytes that each side has sent."""

    device: int
    transaction: int = 0
    sent: dict[bool, int] = field(default_factory=lambda: {True: 1, False: 1})
    """Number of bytes, by True for requests; they count from 1, as after a first packet."""


class ModbusTcpForm:
    """Frames as Modbus/TCP: device id, transactions, one connection per drive."""

    link_type = LINK_IPV4

    def __init__(self) -> None:
        self._connections: dict[int, _Connection] = {}
        self._noise = b""

    def frame_packet(self, device: int, pdu: bytes, *, request: bool) -> Packet:
        """Return the packet; its comment contains the bytes before it that form no frame."""
        connection = self._connections.setdefault(device, _Connection(device))
        if request:
            connection.transaction = (connection.transaction + 1) & 0xFFFF
        head = struct.pack(">HHHB", connection.transaction, 0, len(pdu) + 1, device)
        noise, self._noise = self._noise, b""
        comment = f"before it, no frame: {hex_text(noise)}" if noise else ""
        return Packet(_ip(connection, head + pdu, request=request), comment)

    def noise_packet(self, data: bytes) -> Packet | None:
        """Return None: the next packet contains the bytes in its comment."""
        self._noise += data
        return None


def _ip(connection: _Connection, data: bytes, *, request: bool) -> bytes:
    """Return the data with TCP and IPv4 headers."""
    drive = DRIVES + bytes([connection.device])
    ports = FIRST_CLIENT_PORT + connection.device, SERVER_PORT
    if request:
        places, (source, target) = MASTER + drive, ports
    else:
        places, (target, source) = drive + MASTER, ports
    sent, received = connection.sent[request], connection.sent[not request]
    connection.sent[request] = sent + len(data) & 0xFFFF_FFFF
    fields = struct.pack(
        ">HHIIBBHHH", source, target, sent, received, 5 << 4, _PUSH_AND_ACK, _WINDOW, 0, 0
    )
    pseudo = places + struct.pack(">BBH", 0, _TCP, len(fields) + len(data))
    tcp = _with_sum(fields, 16, pseudo, data) + data
    ip = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(tcp), 0, _NO_FRAGMENTS, _TIME_TO_LIVE, _TCP, 0)
    return _with_sum(ip + places, 10) + tcp


def _with_sum(head: bytes, at: int, before: bytes = b"", behind: bytes = b"") -> bytes:
    """Return a header with its checksum at a place; the sum includes the bytes around it."""
    data = before + head + behind
    data += bytes(len(data) % 2)
    words: tuple[int, ...] = struct.unpack(f">{len(data) // 2}H", data)
    total = sum(words)
    while total > 0xFFFF:
        total = (total & 0xFFFF) + (total >> 16)
    return head[:at] + (~total & 0xFFFF).to_bytes(2, "big") + head[at + 2 :]
