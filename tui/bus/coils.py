"""Requests for coils and discrete inputs, and the choice of a request by its address space.

A coil or input is a word of 0 or 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from pymodbus.pdu.bit_message import (
    ReadCoilsRequest,
    ReadDiscreteInputsRequest,
    WriteMultipleCoilsRequest,
    WriteSingleCoilRequest,
)
from pymodbus.pdu.pdu import ModbusPDU

from tui.wire.frames import SPACE_SIZE, bits_of, packed_bits, wire_place

from .errors import RequestRefused
from .expectation import Expectation
from .requests import Read, ReadInput, Request, WriteMany, WriteOne


@dataclass(frozen=True, slots=True)
class ReadCoils(Read):
    """Function 1: read `count` coils, each a word of 0 or 1."""

    function: ClassVar[int] = 1
    step: ClassVar[int] = 8

    def message(self) -> ModbusPDU:
        return ReadCoilsRequest(address=self.address, count=self.count)

    def expectation(self) -> Expectation:
        size = (self.count + 7) // 8
        prefix = bytes([self.function, size])
        return Expectation(self.function, prefix, 2 + size, 0xFF << (self.count - 1) % 8 + 1 & 0xFF)

    def words(self, pdu: bytes) -> tuple[int, ...]:
        return bits_of(pdu[2:], self.count)

    def pdu_of(self, words: Sequence[int]) -> bytes:
        data = packed_bits(words)
        return bytes([self.function, len(data)]) + data


@dataclass(frozen=True, slots=True)
class ReadDiscrete(ReadCoils):
    """Function 2: read `count` discrete inputs, each a word of 0 or 1."""

    function: ClassVar[int] = 2

    def message(self) -> ModbusPDU:
        return ReadDiscreteInputsRequest(address=self.address, count=self.count)


@dataclass(frozen=True, slots=True)
class WriteCoil(WriteOne):
    """Function 5: write one coil, `value` is 0 or 1; the reply repeats the request."""

    function: ClassVar[int] = 5

    def message(self) -> ModbusPDU:
        return WriteSingleCoilRequest(address=self.address, bits=[bool(self.value)])

    @property
    def written(self) -> tuple[int, tuple[int, ...]]:
        return wire_place(ReadCoils.function, self.address), (self.value,)


@dataclass(frozen=True, slots=True)
class WriteCoils(WriteMany):
    """Function 15: write coils, each value is 0 or 1; the reply repeats address and count."""

    function: ClassVar[int] = 15

    def message(self) -> ModbusPDU:
        return WriteMultipleCoilsRequest(address=self.address, bits=list(map(bool, self.values)))

    @property
    def written(self) -> tuple[int, tuple[int, ...]]:
        return wire_place(ReadCoils.function, self.address), self.values


_READS: Mapping[int, type[Read]] = {
    kind.function: kind for kind in (Read, ReadInput, ReadCoils, ReadDiscrete)
}
_NEAR: Mapping[int, type[Read]] = {1: ReadCoils, 2: ReadDiscrete, 5: ReadCoils, 15: ReadCoils}
"""The read of the same space, by function; that of registers for all others."""


def read_request(device: int, address: int, count: int, function: int) -> Read:
    """The request that reads by function 1, 2, 3 or 4."""
    return _READS[function](device, address, count)


def single_read(request: Request) -> Read:
    """The read of one register, coil or input at the place of another request."""
    return _NEAR.get(request.function, Read)(request.device, request.register, 1)


def write_request(
    device: int,
    address: int,
    values: Sequence[int],
    multiple: bool | None,
    functions: frozenset[int],
) -> WriteOne | WriteMany:
    """The request that writes the values by a function that the device supports; see Line.write.

    `address` is a register, or the place of a coil. Raises RequestRefused if the function for one
    value cannot carry them.
    """
    single, several = WriteOne, WriteMany
    first = wire_place(ReadCoils.function, 0)
    if first <= address < first + SPACE_SIZE:
        single, several, address = WriteCoil, WriteCoils, address - first
    if multiple is None:
        one_word = single.function in functions or several.function not in functions
        multiple = len(values) != 1 or not one_word
    if multiple:
        return several(device, address, tuple(values))
    if len(values) != 1:
        raise RequestRefused(f"Function {single.function} writes one word, not {len(values)}.")
    return single(device, address, values[0])
