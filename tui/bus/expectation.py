"""Form of the reply to a request, down to every byte that the request determines."""

from __future__ import annotations

from dataclasses import dataclass, field

from tui.wire.frames import hex_text

EXCEPTION = 0x80
IDENTIFY, REPORT_ID = 43, 17
MEI_IDENTIFICATION = 14
_MEI_HEADER = 7
"""Function, MEI type, read code, conformity, more follows, next object, number of objects."""


@dataclass(frozen=True, slots=True)
class Expectation:
    """A reply without device and checksum: its first bytes and its length.

    `length` None means function 43 or 17, whose reply says its length itself. Two requests to one
    device with equal expectations have replies that cannot be distinguished.
    """

    function: int
    prefix: bytes
    length: int | None
    padding: int = field(default=0, compare=False)
    """Bits of the last byte that no coil has: they are 0. They distinguish no two replies."""

    def extent(self, data: bytes | bytearray, start: int = 0) -> int | None:
        """Length of the reply that begins at `start`, 0 if none does, None if bytes are missing."""
        head = data[start : start + len(self.prefix)]
        if head != self.prefix[: len(head)]:
            return 0
        if len(head) < len(self.prefix):
            return None
        if self.length is not None:
            last = data[start + self.length - 1 : start + self.length]
            return 0 if last and last[0] & self.padding else self.length
        if self.function == REPORT_ID:
            return 2 + data[start + 1] if len(data) > start + 1 else None
        return identification_extent(data, start)

    def fits(self, pdu: bytes) -> bool:
        """Return True if a whole reply is what was asked for."""
        return bool(pdu) and self.extent(pdu) == len(pdu)

    def mismatch(self, pdu: bytes) -> str:
        """Why a whole frame is not the reply, in words."""
        if not pdu or pdu[0] != self.function:
            came = str(pdu[0]) if pdu else "none"
            return f"function {came} instead of {self.function}"
        if self.length is not None and len(pdu) != self.length:
            return f"{len(pdu)} bytes instead of {self.length}"
        if pdu.startswith(self.prefix) and pdu[-1] & self.padding:
            return "bits after the last coil are set"
        return f"{hex_text(pdu[1:6])} where {hex_text(self.prefix[1:])} was due"


def identification_extent(data: bytes | bytearray, start: int = 0) -> int | None:
    """Length of a reply of function 43/14 from its object lengths, None if bytes are missing."""
    if len(data) < start + _MEI_HEADER:
        return None
    at = start + _MEI_HEADER
    for _ in range(data[at - 1]):
        if len(data) < at + 2:
            return None
        at += 2 + data[at + 1]
        if at - start > 253:
            return 0
    return at - start


def exception_extents(function: int) -> tuple[int, ...]:
    """Lengths that an exception reply may have; function 43 has it with or without its MEI type."""
    return (2, 3) if function == IDENTIFY else (2,)


def exception_code(function: int, pdu: bytes) -> int | None:
    """The code of an exception reply to `function`, None if it is none."""
    if len(pdu) not in exception_extents(function) or pdu[0] != function | EXCEPTION:
        return None
    if len(pdu) == 3 and pdu[1] != MEI_IDENTIFICATION:
        return None
    return pdu[-1]
