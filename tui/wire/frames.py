"""Frames of Modbus RTU: the checksum, whole frames, requests for registers, bytes as text."""

from __future__ import annotations

from collections.abc import Sequence

MIN_FRAME = 4
MAX_FRAME = 256
"""Bytes of the shortest and the longest frame, checksum included."""


def _table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
        table.append(crc)
    return tuple(table)


_CRC = _table()


def crc16(data: bytes | bytearray) -> int:
    """Checksum of bytes: polynomial 16#A001, start 16#FFFF; 0 over a frame and its checksum."""
    table, crc = _CRC, 0xFFFF
    for byte in data:
        crc = (crc >> 8) ^ table[(crc ^ byte) & 0xFF]
    return crc


def sealed(body: bytes) -> bytes:
    """A whole frame: the body with its checksum, low byte first."""
    return body + crc16(body).to_bytes(2, "little")


def frame(device: int, pdu: bytes) -> bytes:
    """The frame of a request or reply: device, function and data, checksum."""
    return sealed(bytes([device]) + pdu)


def is_whole(data: bytes | bytearray) -> bool:
    """Return True if the bytes end with the checksum of the others."""
    return len(data) >= MIN_FRAME and crc16(data) == 0


def read_frame(device: int, address: int, count: int) -> bytes:
    """A read of so many words by function 3."""
    return frame(device, bytes([3]) + _words(address, count))


def write_frame(device: int, address: int, words: Sequence[int]) -> bytes:
    """A write of words by function 16."""
    head = bytes([16]) + _words(address, len(words))
    return frame(device, head + bytes([2 * len(words)]) + _words(*words))


def read_write_frame(
    device: int, read_address: int, count: int, write_address: int, words: Sequence[int]
) -> bytes:
    """A write of words with a read of others in the same exchange, by function 23."""
    head = bytes([23]) + _words(read_address, count, write_address, len(words))
    return frame(device, head + bytes([2 * len(words)]) + _words(*words))


def hex_text(data: bytes) -> str:
    """The bytes as manuals print them: `01 03 18 75`."""
    return data.hex(" ").upper()


def _words(*words: int) -> bytes:
    return b"".join((word & 0xFFFF).to_bytes(2, "big") for word in words)
