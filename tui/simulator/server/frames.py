"""Modbus RTU frames as a drive sees them: checksum and the length that a request announces.

Pure functions. The checksum is implemented separately from that of tui.wire: an independent
simulated drive does not share a defect with the line.
"""

from __future__ import annotations


def _table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
        table.append(crc)
    return tuple(table)


_CRC = _table()
_MIN_FRAME = 4
_LENGTHS = {1: 8, 2: 8, 3: 8, 4: 8, 5: 8, 6: 8, 7: 4, 8: 8, 11: 4, 12: 4, 17: 4, 22: 10, 43: 7}
_COUNTED = {15: (6, 9), 16: (6, 9), 23: (10, 13)}
"""Functions whose request has a byte count: its position, and the number of bytes not counted."""


def checksum(data: bytes) -> int:
    """Return the checksum of a frame's bytes: polynomial 16#A001, start 16#FFFF."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc >> 8) ^ _CRC[(crc ^ byte) & 0xFF]
    return crc


def seal(body: bytes) -> bytes:
    """Return the frame of a body: with its checksum, low byte first."""
    return body + checksum(body).to_bytes(2, "little")


def is_sealed(frame: bytes) -> bool:
    """Return True if the bytes are one frame with a correct checksum."""
    return len(frame) >= _MIN_FRAME and checksum(frame[:-2]) == int.from_bytes(frame[-2:], "little")


def request_length(head: bytes) -> int | None:
    """Return the length of a request from its first bytes; None if they do not show it."""
    if len(head) < 2:
        return None
    if counted := _COUNTED.get(head[1]):
        place, rest = counted
        return rest + head[place] if len(head) > place else None
    return _LENGTHS.get(head[1])
