"""Requests of Modbus clients to a gateway, parsed from bytes, and answers as bytes.

Pure functions. Lengths and counts are held strictly: a request that is not exactly what its
function says is refused with exception 3, never half understood.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tui.wire.frames import BIT_READS, COIL_ON, at_place, bits_of, packed_bits, wire_place

from ..expectation import IDENTIFY, MEI_IDENTIFICATION
from ..limits import MAX_READ, MAX_READ_23, MAX_WRITE, MAX_WRITE_23

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, DEVICE_FAILURE = 1, 2, 3, 4
BUSY, NO_PATH, NO_RESPONSE = 6, 10, 11
WRITE_FUNCTIONS = frozenset({5, 6, 15, 16, 22, 23})
"""Functions that change something in a device."""
LONGEST_OBJECTS = 246
"""Bytes of objects in one answer of function 43/14."""
REGULAR, EXTENDED = 0x03, 0x80
"""Objects below the first number are basic, below the second regular, the rest extended."""


class Unanswerable(Exception):
    """A request that is refused with an exception `code`."""

    def __init__(self, code: int, why: str = "") -> None:
        self.code = code
        super().__init__(why or f"exception {code}")


@dataclass(frozen=True, slots=True)
class ReadRequested:
    """Function 1, 2, 3 or 4."""

    function: int
    address: int
    count: int


@dataclass(frozen=True, slots=True)
class WriteRequested:
    """Function 5, 6, 15, 16 or 23; the last reads `count` words from `read_address` on afterwards.

    `address` is a register, or the place of a coil.
    """

    function: int
    address: int
    values: tuple[int, ...]
    read_address: int = 0
    count: int = 0

    @property
    def words(self) -> Mapping[int, int]:
        """Words to be written, by register or place of a coil."""
        return {self.address + offset: word for offset, word in enumerate(self.values)}


@dataclass(frozen=True, slots=True)
class DiagnoseRequested:
    """Function 8 with one word of data."""

    subfunction: int
    data: int


@dataclass(frozen=True, slots=True)
class IdentifyRequested:
    """Function 43/14: objects of a stream from `first` on, or the one of read code 4."""

    read_code: int
    first: int


GatewayRequested = ReadRequested | WriteRequested | DiagnoseRequested | IdentifyRequested


def parse_request(pdu: bytes) -> GatewayRequested:
    """Parse the bytes of a request. Raises Unanswerable."""
    function, data = pdu[0], pdu[1:]
    match function:
        case 1 | 2 | 3 | 4:
            address, count = _unpacked(">HH", data)
            _check_span(address, count, MAX_READ)
            return ReadRequested(function, address, count)
        case 5:
            address, value = _unpacked(">HH", data)
            if value not in (0, COIL_ON):
                raise Unanswerable(ILLEGAL_VALUE, f"coil value {value}")
            return WriteRequested(function, wire_place(1, address), (value // COIL_ON,))
        case 6:
            address, value = _unpacked(">HH", data)
            return WriteRequested(function, address, (value,))
        case 15:
            return _write_coils(data)
        case 16:
            return _write_many(data)
        case 23:
            return _read_write(data)
        case 8:
            return DiagnoseRequested(*_unpacked(">HH", data))
        case 43:
            kind, read_code, first = _unpacked(">BBB", data)
            if kind != MEI_IDENTIFICATION:
                raise Unanswerable(ILLEGAL_FUNCTION)
            if not 1 <= read_code <= 4:
                raise Unanswerable(ILLEGAL_VALUE)
            return IdentifyRequested(read_code, first)
        case _:
            # no drive has masked writes
            raise Unanswerable(ILLEGAL_FUNCTION, f"function {function}")


def _write_many(data: bytes) -> WriteRequested:
    address, count, size = _unpacked(">HHB", data[:5])
    return WriteRequested(16, address, _values(address, count, size, data[5:], MAX_WRITE))


def _write_coils(data: bytes) -> WriteRequested:
    address, count, size = _unpacked(">HHB", data[:5])
    _check_span(address, count, MAX_WRITE)
    if size != (count + 7) // 8 or len(data) - 5 != size:
        raise Unanswerable(ILLEGAL_VALUE, "a request of another length")
    return WriteRequested(15, wire_place(1, address), bits_of(data[5:], count))


def _read_write(data: bytes) -> WriteRequested:
    read_address, read_count, address, count, size = _unpacked(">HHHHB", data[:9])
    _check_span(read_address, read_count, MAX_READ_23)
    values = _values(address, count, size, data[9:], MAX_WRITE_23)
    return WriteRequested(23, address, values, read_address, read_count)


def _unpacked(form: str, data: bytes) -> tuple[int, ...]:
    if len(data) != struct.calcsize(form):
        raise Unanswerable(ILLEGAL_VALUE, "a request of another length")
    return struct.unpack(form, data)


def _values(address: int, count: int, size: int, data: bytes, most: int) -> tuple[int, ...]:
    _check_span(address, count, most)
    if size != 2 * count or len(data) != size:
        raise Unanswerable(ILLEGAL_VALUE, "a request of another length")
    return struct.unpack(f">{count}H", data)


def _check_span(address: int, count: int, most: int) -> None:
    if not 1 <= count <= most:
        raise Unanswerable(ILLEGAL_VALUE, f"{count} words")
    if address + count > 0x10000:
        raise Unanswerable(ILLEGAL_ADDRESS, "beyond register 65535")


# Answers


def exception_pdu(function: int, code: int) -> bytes:
    """The answer that refuses a function."""
    return bytes([function & 0x7F | 0x80, code])


def words_pdu(function: int, words: Sequence[int]) -> bytes:
    """The answer of a read; a coil or input is a word of 0 or 1."""
    if function in BIT_READS:
        bits = packed_bits(words)
        return bytes([function, len(bits)]) + bits
    return bytes([function, 2 * len(words)]) + struct.pack(f">{len(words)}H", *words)


def written_pdu(requested: WriteRequested) -> bytes:
    """The answer of function 5, 6, 15 or 16."""
    second = requested.values[0] if requested.function in (5, 6) else len(requested.values)
    second *= COIL_ON if requested.function == 5 else 1
    return struct.pack(">BHH", requested.function, at_place(requested.address)[1], second)


def diagnosed_pdu(subfunction: int, data: int) -> bytes:
    """The answer of function 8."""
    return struct.pack(">BHH", 8, subfunction, data)


def identified_pdu(
    requested: IdentifyRequested, conformity: int, objects: Mapping[int, bytes]
) -> bytes:
    """The answer of function 43/14, with the object that follows. Raises Unanswerable."""
    ends = {1: REGULAR, 2: EXTENDED}
    wanted = {number: value for number, value in sorted(objects.items())
              if number < ends.get(requested.read_code, 0x100)}  # fmt: skip
    if requested.read_code == 4:
        if requested.first not in wanted:
            raise Unanswerable(ILLEGAL_ADDRESS)
        wanted = {requested.first: wanted[requested.first]}
    elif requested.first in wanted:
        wanted = {number: value for number, value in wanted.items() if number >= requested.first}
    body, count, more = b"", 0, 0
    for number, value in wanted.items():
        data = bytes([number, len(value)]) + value
        if len(body) + len(data) > LONGEST_OBJECTS:
            more = number
            break
        body, count = body + data, count + 1
    follows = bytes([0xFF if more else 0, more, count])
    return bytes([IDENTIFY, MEI_IDENTIFICATION, requested.read_code, conformity]) + follows + body
