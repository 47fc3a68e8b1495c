"""Frames of Modbus RTU: checksum, times, search for whole frames, requests, bytes as text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

SPACES = (3, 4, 1, 2)
"""Functions that read the four address spaces: registers, input registers, coils, inputs."""
BIT_READS = (1, 2)
"""Functions whose replies have one bit for each coil or discrete input."""
SPACE_SIZE = 0x10000

COIL_ON = 0xFF00
"""Word of function 5 that switches a coil on; 0 switches it off."""


def wire_place(function: int, address: int) -> int:
    """Return the place of an address: one number in all spaces, that of a register unchanged."""
    return SPACES.index(function) * SPACE_SIZE + address


def at_place(place: int) -> tuple[int, int]:
    """Return the function that reads a place, and its address."""
    return SPACES[place // SPACE_SIZE], place % SPACE_SIZE


def packed_bits(bits: Sequence[int]) -> bytes:
    """Return coils as on the wire: the first one in the lowest bit of the first byte."""
    number = sum(1 << index for index, bit in enumerate(bits) if bit)
    return number.to_bytes((len(bits) + 7) // 8, "little")


def bits_of(data: bytes, count: int) -> tuple[int, ...]:
    """Return the first coils of bytes from the wire."""
    number = int.from_bytes(data, "little")
    return tuple(number >> index & 1 for index in range(count))


def raw_of_words(place: int, words: Sequence[int]) -> int:
    """Return the first of several words, or the number whose bits are these coils."""
    if at_place(place)[0] in BIT_READS:
        return int.from_bytes(packed_bits(words), "little")
    return words[0]


def written_text(place: int, words: Sequence[int]) -> str:
    """Return words in hexadecimal; coils as one number."""
    if at_place(place)[0] in BIT_READS:
        return f"16#{raw_of_words(place, words):0{(len(words) + 3) // 4}X}"
    return " ".join(f"16#{word:04X}" for word in words)


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
    """Return the checksum of bytes: polynomial 16#A001, start 16#FFFF.

    It is 0 for a frame including its checksum.
    """
    table, crc = _CRC, 0xFFFF
    for byte in data:
        crc = (crc >> 8) ^ table[(crc ^ byte) & 0xFF]
    return crc


def sealed(body: bytes) -> bytes:
    """Return a whole frame: the body with its checksum, low byte first."""
    return body + crc16(body).to_bytes(2, "little")


def frame(device: int, pdu: bytes) -> bytes:
    """Return the frame of a request or reply: device, function and data, checksum."""
    return sealed(bytes([device]) + pdu)


def is_whole(data: bytes | bytearray) -> bool:
    """Return True if the bytes end with the checksum of the others."""
    return len(data) >= MIN_FRAME and crc16(data) == 0


def read_frame(device: int, address: int, count: int) -> bytes:
    """Return a request to read words with function 3."""
    return frame(device, bytes([3]) + _words(address, count))


def write_frame(device: int, address: int, words: Sequence[int]) -> bytes:
    """Return a request to write words with function 16."""
    head = bytes([16]) + _words(address, len(words))
    return frame(device, head + bytes([2 * len(words)]) + _words(*words))


def read_write_frame(
    device: int, read_address: int, count: int, write_address: int, words: Sequence[int]
) -> bytes:
    """Return a request to write words and read others in the same exchange, with function 23."""
    head = bytes([23]) + _words(read_address, count, write_address, len(words))
    return frame(device, head + bytes([2 * len(words)]) + _words(*words))


def hex_text(data: bytes) -> str:
    """Return the bytes as manuals print them: `01 03 18 75`."""
    return data.hex(" ").upper()


def _words(*words: int) -> bytes:
    return b"".join((word & 0xFFFF).to_bytes(2, "big") for word in words)


MBAP_BYTES = 7
"""Bytes before the function code on Modbus TCP."""
SHORTEST_PDU = 2


@dataclass(frozen=True, slots=True)
class Pdu:
    """Device, function and its data."""

    device: int
    function: int
    body: bytes


def pdu_of(data: bytes, *, tcp: bool) -> Pdu | None:
    """Return the parts of a frame; None for bytes that form none."""
    if tcp:
        return Pdu(data[6], data[7], data[8:]) if len(data) > MBAP_BYTES else None
    return Pdu(data[0], data[1], data[2:-2]) if len(data) >= SHORTEST_PDU + 2 else None


_BITS = 16
_BYTE_VALUES = bytes(range(256))
_PLANES = tuple(bytes(48 + (value >> bit & 1) for value in _BYTE_VALUES) for bit in range(8))
"""By bit, the translation of bytes to `0` and `1`."""


def _rows() -> tuple[tuple[int, ...], ...]:
    """Return, by bit of a checksum, the bits of (checksum ^ byte) that determine it after the
    byte."""
    steps = [_step(1 << bit) for bit in range(8)]
    return tuple(tuple(k for k in range(8) if steps[k] >> bit & 1) for bit in range(_BITS))


def _step(low: int) -> int:
    """Return the effect of a register's low byte after eight shifts."""
    for _ in range(8):
        low = (low >> 1) ^ (0xA001 if low & 1 else 0)
    return low


_ROWS = _rows()


def frame_ends(data: bytes | bytearray) -> dict[int, int]:
    """Return, by beginning, the end of the shortest whole frame there, as by is_whole().

    Checked byte by byte, a block of noise would take the line's thread hundreds of milliseconds, in
    which no stop is sent. So one long number holds one checksum bit of every beginning.
    """
    count = len(data)
    if count < MIN_FRAME:
        return {}
    # the byte with the lowest index is in the lowest bit
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
        # beginnings whose frame would end after the last byte do not count
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


FAST = 19200
"""Baud rate above which the inter-frame gap is FAST_SILENCE."""
FAST_SILENCE = 0.00175
"""Seconds."""
SILENT_CHARACTERS = 3.5
_FORMAT = re.compile(r"8([NEO])([12])")


def is_format(text: str) -> bool:
    """Return True if a text is a character format of Modbus RTU: 8E1, 8N1, 8O1, 8N2 ..."""
    return _FORMAT.fullmatch(text) is not None


def bits_per_character(format_: str) -> int:
    """Return the bits on the wire for one character: start, data, parity and stop bits.

    Raises ValueError.
    """
    match = _FORMAT.fullmatch(format_)
    if match is None:
        raise ValueError(f"{format_!r} is not a serial format")
    return 1 + 8 + (match[1] != "N") + int(match[2])


def character_seconds(baud: int, format_: str) -> float:
    """Return the seconds for one character. Raises ValueError."""
    return bits_per_character(format_) / baud


def silent_seconds(baud: int, format_: str) -> float:
    """Return the inter-frame gap in seconds: 3.5 characters, 1.75 ms above 19 200 baud."""
    return FAST_SILENCE if baud > FAST else SILENT_CHARACTERS * character_seconds(baud, format_)
