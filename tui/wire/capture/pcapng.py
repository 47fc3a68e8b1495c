"""Blocks of a pcapng file: the three that a reader of frames needs. Pure functions.

The available libraries are unmaintained, need a C library, or contain all network protocols. The
required part of the format is small.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

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
