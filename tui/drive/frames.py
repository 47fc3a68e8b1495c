"""The bytes of Modbus RTU requests, for a person who wants to see what goes over the wire."""

from __future__ import annotations

from collections.abc import Sequence

_POLYNOMIAL = 0xA001


def crc16(data: bytes) -> int:
    """Checksum of a frame's bytes: polynomial 16#A001, start 16#FFFF."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (_POLYNOMIAL if crc & 1 else 0)
    return crc


def read_frame(device: int, address: int, count: int) -> bytes:
    """A read of so many words by function 3."""
    return _seal(bytes([device, 3]) + _words(address, count))


def write_frame(device: int, address: int, words: Sequence[int]) -> bytes:
    """A write of words by function 16."""
    head = bytes([device, 16]) + _words(address, len(words))
    return _seal(head + bytes([2 * len(words)]) + _words(*words))


def read_write_frame(
    device: int, read_address: int, count: int, write_address: int, words: Sequence[int]
) -> bytes:
    """A write of words with a read of others in the same exchange, by function 23."""
    head = bytes([device, 23]) + _words(read_address, count, write_address, len(words))
    return _seal(head + bytes([2 * len(words)]) + _words(*words))


def hex_text(frame: bytes) -> str:
    """The bytes as manuals print them: `01 03 18 75`."""
    return frame.hex(" ").upper()


def _words(*words: int) -> bytes:
    return b"".join((word & 0xFFFF).to_bytes(2, "big") for word in words)


def _seal(body: bytes) -> bytes:
    return body + crc16(body).to_bytes(2, "little")
