"""Requests as frozen values: their bytes, what their reply must look like, what it holds.

Bytes are made and read by pymodbus' protocol data units; lengths and echoes are checked here
before anything is read from a reply.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from pymodbus.pdu.diag_message import DiagnosticBase
from pymodbus.pdu.mei_message import ReadDeviceInformationRequest
from pymodbus.pdu.other_message import ReportDeviceIdRequest
from pymodbus.pdu.pdu import ModbusPDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadHoldingRegistersResponse,
    ReadInputRegistersRequest,
    ReadWriteMultipleRegistersRequest,
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)

from .expectation import IDENTIFY, MEI_IDENTIFICATION, REPORT_ID, Expectation

DATA_ECHOED = frozenset({0x00, 0x01, 0x03, 0x0A, 0x14})
"""Sub-functions of 8 whose reply repeats the data; the others answer with a value."""
HARMLESS_SUBFUNCTIONS = frozenset({0x00, 0x02, *range(0x0B, 0x14)})
"""Sub-functions of 8 that change nothing in the device."""
LISTEN_ONLY = 0x04
BROADCAST = 0


@dataclass(frozen=True, slots=True)
class Request(ABC):
    """One request to one device; `device` 0 is a broadcast."""

    function: ClassVar[int]
    device: int

    @abstractmethod
    def message(self) -> ModbusPDU:
        """The protocol data unit that carries the request."""

    @abstractmethod
    def expectation(self) -> Expectation:
        """Return the form of the reply."""

    @property
    def register(self) -> int:
        """The first register of the request, 0 for functions without one."""
        return 0

    @property
    def changes(self) -> bool:
        """True if the request changes anything in the device; such a request is sent once."""
        return False

    @property
    def written(self) -> tuple[int, tuple[int, ...]]:
        """The first place that the request writes, and the words; no words if it writes none.

        A register is its own place, a coil has one behind all registers: see wire_place().
        """
        return 0, ()

    def words(self, _pdu: bytes) -> tuple[int, ...]:
        """The registers in a checked reply; none if the function reads none."""
        return ()

    def pdu(self) -> bytes:
        """Function code and data as they go on the wire."""
        return bytes([self.function]) + self.message().encode()


@dataclass(frozen=True, slots=True)
class Read(Request):
    """Function 3: read `count` registers."""

    function: ClassVar[int] = 3
    step: ClassVar[int] = 1
    """Registers or coils by which two replies must differ to differ in length."""
    address: int
    count: int

    def message(self) -> ModbusPDU:
        return ReadHoldingRegistersRequest(address=self.address, count=self.count)

    def expectation(self) -> Expectation:
        return _words_expected(self.function, self.count)

    def words(self, pdu: bytes) -> tuple[int, ...]:
        return words_of(pdu)

    def pdu_of(self, words: Sequence[int]) -> bytes:
        """The reply with these words."""
        data = b"".join(word.to_bytes(2, "big") for word in words)
        return bytes([self.function, len(data)]) + data

    @property
    def register(self) -> int:
        return self.address


@dataclass(frozen=True, slots=True)
class ReadInput(Read):
    """Function 4: read `count` input registers."""

    function: ClassVar[int] = 4

    def message(self) -> ModbusPDU:
        return ReadInputRegistersRequest(address=self.address, count=self.count)


@dataclass(frozen=True, slots=True)
class WriteOne(Request):
    """Function 6: write one register; the reply repeats the request."""

    function: ClassVar[int] = 6
    address: int
    value: int

    def message(self) -> ModbusPDU:
        return WriteSingleRegisterRequest(address=self.address, registers=[self.value])

    def expectation(self) -> Expectation:
        pdu = self.pdu()
        return Expectation(self.function, pdu, len(pdu))

    @property
    def register(self) -> int:
        return self.address

    @property
    def written(self) -> tuple[int, tuple[int, ...]]:
        return self.address, (self.value,)

    @property
    def changes(self) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class WriteMany(Request):
    """Function 16: write registers; the reply repeats address and count."""

    function: ClassVar[int] = 16
    address: int
    values: tuple[int, ...]

    def message(self) -> ModbusPDU:
        return WriteMultipleRegistersRequest(
            address=self.address, count=len(self.values), registers=self.values
        )

    def expectation(self) -> Expectation:
        return Expectation(self.function, self.pdu()[:5], 5)

    @property
    def register(self) -> int:
        return self.address

    @property
    def written(self) -> tuple[int, tuple[int, ...]]:
        return self.address, self.values

    @property
    def changes(self) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class ReadWrite(Request):
    """Function 23: write registers, then read `count` others."""

    function: ClassVar[int] = 23
    address: int
    count: int
    write_address: int
    values: tuple[int, ...]

    def message(self) -> ModbusPDU:
        return ReadWriteMultipleRegistersRequest(
            read_address=self.address,
            read_count=self.count,
            write_address=self.write_address,
            write_registers=self.values,
        )

    def expectation(self) -> Expectation:
        return _words_expected(self.function, self.count)

    def words(self, pdu: bytes) -> tuple[int, ...]:
        return words_of(pdu)

    @property
    def register(self) -> int:
        return self.address

    @property
    def written(self) -> tuple[int, tuple[int, ...]]:
        return self.write_address, self.values

    @property
    def changes(self) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class Diagnose(Request):
    """Function 8: `subfunction` with one word of data."""

    function: ClassVar[int] = 8
    subfunction: int
    data: int

    def message(self) -> ModbusPDU:
        message = DiagnosticBase(message=self.data)
        message.sub_function_code = self.subfunction
        return message

    def expectation(self) -> Expectation:
        echoed = 5 if self.subfunction in DATA_ECHOED else 3
        return Expectation(self.function, self.pdu()[:echoed], 5)

    @property
    def changes(self) -> bool:
        return self.subfunction not in HARMLESS_SUBFUNCTIONS


@dataclass(frozen=True, slots=True)
class Identify(Request):
    """Function 43/14: objects of the device from `first_object` on."""

    function: ClassVar[int] = IDENTIFY
    read_code: int = 1
    first_object: int = 0

    def message(self) -> ModbusPDU:
        return ReadDeviceInformationRequest(read_code=self.read_code, object_id=self.first_object)

    def expectation(self) -> Expectation:
        return Expectation(
            self.function, bytes([IDENTIFY, MEI_IDENTIFICATION, self.read_code]), None
        )


@dataclass(frozen=True, slots=True)
class ReportId(Request):
    """Function 17: the device's own name, in a format of its maker."""

    function: ClassVar[int] = REPORT_ID

    def message(self) -> ModbusPDU:
        return ReportDeviceIdRequest()

    def expectation(self) -> Expectation:
        return Expectation(self.function, bytes([self.function]), None)


def _words_expected(function: int, count: int) -> Expectation:
    return Expectation(function, bytes([function, 2 * count]), 2 + 2 * count)


def words_of(pdu: bytes) -> tuple[int, ...]:
    """Words of a checked reply of function 3, 4 or 23."""
    response = ReadHoldingRegistersResponse()
    response.decode(pdu[1:])
    return tuple(response.registers)


def diagnostic_of(pdu: bytes) -> int:
    """The data word of a checked reply of function 8."""
    return int.from_bytes(pdu[3:5], "big")


REFERENCE = 1
"""The object of function 43/14 with the reference of the drive."""
_WORDS = re.compile(rb"[ -~]{3,}")


def own_words_of(pdu: bytes) -> bytes:
    """The longest text in a checked reply of function 17; the bytes around it are its maker's.

    Without a text, all bytes in hexadecimal, as 16#2AFF.
    """
    text = max(_WORDS.findall(pdu[2:]), key=len, default=b"").strip()
    return text or (b"16#" + pdu[2:].hex().upper().encode() if len(pdu) > 2 else b"")


@dataclass(frozen=True, slots=True)
class Objects:
    """Objects of one or several replies of function 43/14."""

    conformity: int = 0
    objects: Mapping[int, bytes] = field(default_factory=dict)
    next_object: int | None = 0
    """The object with which the next request begins; None if nothing follows."""
    trouble: str = ""
    """Reason if they form no identification; else empty."""

    def with_more(self, pdu: bytes) -> Objects:
        """These objects, and those of a checked reply that follows."""
        objects = dict(self.objects)
        trouble, at = "", 7
        for _ in range(pdu[6]):
            length = pdu[at + 1]
            number, content = pdu[at], bytes(pdu[at + 2 : at + 2 + length])
            if objects.setdefault(number, content) != content:
                both = f"{_quoted(objects[number])} and {_quoted(content)}"
                trouble = f"object {number} came with two contents, {both}"
            at += 2 + length
        follows = pdu[5] if pdu[4] else None
        if follows is not None and follows <= (self.next_object or 0):
            trouble = trouble or "its identification does not end"
        return Objects(pdu[3], objects, follows, trouble)


def _quoted(content: bytes) -> str:
    return repr(content.decode("ascii", errors="replace"))
