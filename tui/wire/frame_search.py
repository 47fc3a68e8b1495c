"""Whole frames among many bytes: the checksums of all beginnings worked out at a time.

Byte after byte a lump of noise takes a line's thread hundreds of milliseconds, in which no stop
goes out. Here one long number holds one bit of the checksum of every beginning.
"""

from __future__ import annotations

from .frames import MAX_FRAME, MIN_FRAME

_BITS = 16
_BYTE_VALUES = bytes(range(256))
_PLANES = tuple(bytes(48 + (value >> bit & 1) for value in _BYTE_VALUES) for bit in range(8))
"""By bit, the translation of bytes to `0` and `1`."""


def _rows() -> tuple[tuple[int, ...], ...]:
    """By bit of a checksum, which bits of (checksum ^ byte) come into it with the next byte."""
    steps = [_step(1 << bit) for bit in range(8)]
    return tuple(tuple(k for k in range(8) if steps[k] >> bit & 1) for bit in range(_BITS))


def _step(low: int) -> int:
    """Return the effect of a register's low byte after eight shifts."""
    for _ in range(8):
        low = (low >> 1) ^ (0xA001 if low & 1 else 0)
    return low


_ROWS = _rows()


def frame_ends(data: bytes | bytearray) -> dict[int, int]:
    """By beginning, the end of the shortest whole frame there, by is_whole()."""
    count = len(data)
    if count < MIN_FRAME:
        return {}
    # the byte with the lowest index in the lowest bit
    text = bytes(data)[::-1]
    planes = [int(text.translate(plane), 2) for plane in _PLANES]
    every = (1 << count) - 1
    register = [every] * _BITS
    found: dict[int, int] = {}
    for length in range(1, min(count, MAX_FRAME) + 1):
        mixed = [register[bit] ^ plane for bit, plane in enumerate(planes)]
        register = [_next(bit, register, mixed) for bit in range(_BITS)]
        planes = [plane >> 1 for plane in planes]
        if length < MIN_FRAME:
            continue
        held = 0
        for number in register:
            held |= number
        # beginnings whose frame would end behind the last byte are none
        whole = ~held & ((1 << (count - length + 1)) - 1)
        while whole:
            lowest = whole & -whole
            whole ^= lowest
            start = lowest.bit_length() - 1
            found.setdefault(start, start + length)
    return found


def _next(bit: int, register: list[int], mixed: list[int]) -> int:
    value = register[bit + 8] if bit < 8 else 0
    for row in _ROWS[bit]:
        value ^= mixed[row]
    return value
