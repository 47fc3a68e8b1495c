"""Requests that one device accepts: functions, lengths, windows, sub-functions, broadcasts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from msgspec import Meta

from .bounds import ByteValue, RegisterAddress, RegisterCount, Text
from .coils import ReadCoils, ReadDiscrete, WriteCoil, WriteCoils
from .requests import (
    BROADCAST,
    LISTEN_ONLY,
    Diagnose,
    Read,
    ReadInput,
    ReadWrite,
    Request,
    WriteMany,
    WriteOne,
)

STANDARD_EXCEPTIONS: Mapping[int, str] = {
    1: "the device does not support the function",
    2: "the device has no such address, or does not allow it now",
    3: "a value or a length is not allowed",
    4: "the device cannot do it in its present state",
    5: "the device needs more time",
    6: "the device is busy",
    7: "the device refuses",
    8: "a memory fault of the device",
    10: "the gateway has no path to the device",
    11: "the device behind the gateway did not answer",
}


@dataclass(frozen=True, slots=True)
class Window:
    """An area that may be read or written as a block on a device of single words.

    A block has `min_words` to `max_words` words. With `fixed_start` it begins at `address`, else
    anywhere inside the `max_words` words that begin there.
    """

    address: RegisterAddress
    min_words: RegisterCount
    max_words: RegisterCount
    fixed_start: bool

    def holds(self, address: int, count: int) -> bool:
        """Return True if a block of `count` words at `address` keeps to the window."""
        if not self.min_words <= count <= self.max_words:
            return False
        if self.fixed_start:
            return address == self.address
        return self.address <= address and address + count <= self.address + self.max_words


ByteValues = Annotated[frozenset[ByteValue], Meta(max_length=256)]
Windows = Annotated[tuple[Window, ...], Meta(max_length=256)]


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one device; lengths in words, `exceptions` the meaning of its codes."""

    functions: ByteValues
    max_read: RegisterCount
    max_write: RegisterCount
    max_read_23: RegisterCount
    max_write_23: RegisterCount
    single_words_only: bool = False
    read_windows: Windows = ()
    write_windows: Windows = ()
    subfunctions: Annotated[frozenset[RegisterAddress], Meta(max_length=256)] = frozenset()
    broadcast_functions: ByteValues = frozenset()
    max_read_4: RegisterCount = 1
    """Words of one read by function 4."""
    max_read_1: RegisterCount = 1
    max_read_2: RegisterCount = 1
    max_write_15: RegisterCount = 1
    """Coils of one request, and discrete inputs of one read by function 2."""
    answers_all: bool = False
    """True if it refuses unknown registers; else it may be silent, also to a longer read."""
    exceptions: Annotated[Mapping[ByteValue, Text], Meta(max_length=256)] = field(
        default_factory=lambda: STANDARD_EXCEPTIONS
    )


CAUTIOUS = Limits(
    functions=frozenset({3, 17, 43}), max_read=1, max_write=0, max_read_23=0, max_write_23=0
)
"""For a device without a description: one word by function 3, and its identity by 17 and 43."""

MAX_READ, MAX_WRITE, MAX_READ_23, MAX_WRITE_23 = 125, 123, 125, 121
"""The longest that Modbus itself allows, in words."""


def send_refusal(
    request: Request, limits: Limits, *, read_only: bool = False, held: str = ""
) -> str:
    """Why a request must not be sent, as a sentence; empty when it may.

    `held` is why nothing is to be written to the line now.
    """
    if not 0 <= request.device <= 255:
        return f"Device {request.device} does not exist; devices are 1 to 255."
    if read_only and request.changes:
        return "The line is read-only: nothing is written."
    if held and request.changes:
        return held
    text = out_of_range(request)
    if text:
        return text
    if request.device == BROADCAST:
        if request.function not in limits.broadcast_functions:
            return f"Function {request.function} cannot be broadcast to these devices."
    elif request.function not in limits.functions:
        return f"Device {request.device} does not support function {request.function}."
    return _too_long(request, limits)


def out_of_range(request: Request) -> str:
    """Return why no Modbus device can be sent this."""
    match request:
        case Read(address=address, count=count):
            return _bad_span(address, count, MAX_READ)
        case WriteOne(address=address, value=value):
            return _bad_span(address, 1, 1) or _bad_words((value,), _most_of(request))
        case WriteMany(address=address, values=values):
            bad = _bad_span(address, len(values), MAX_WRITE)
            return bad or _bad_words(values, _most_of(request))
        case ReadWrite(address=address, count=count, write_address=target, values=values):
            return (
                _bad_span(address, count, MAX_READ_23)
                or _bad_span(target, len(values), MAX_WRITE_23)
                or _bad_words(values)
            )
        case Diagnose(subfunction=subfunction, data=data):
            return _bad_words((subfunction, data))
        case _:
            return ""


def _bad_span(address: int, count: int, most: int) -> str:
    if not 0 <= address <= 0xFFFF:
        return f"Register {address} does not exist; registers are 0 to 65535."
    if not 1 <= count <= most:
        return f"{count} words cannot be requested; a request has 1 to {most}."
    if address + count > 0x10000:
        return f"{count} words from register {address} on end after register 65535."
    return ""


def _most_of(request: Request) -> int:
    return 1 if isinstance(request, WriteCoil | WriteCoils) else 0xFFFF


def _bad_words(values: tuple[int, ...], most: int = 0xFFFF) -> str:
    for value in values:
        if not 0 <= value <= most:
            return f"{value} does not fit in a word; words are 0 to {most}."
    return ""


def _too_long(request: Request, limits: Limits) -> str:
    """Return why this device cannot be sent it although Modbus allows it."""
    match request:
        case ReadDiscrete(count=count):
            return _bad_bits("read", count, limits.max_read_2)
        case ReadCoils(count=count):
            return _bad_bits("read", count, limits.max_read_1)
        case WriteCoils(values=values):
            return _bad_bits("written", len(values), limits.max_write_15)
        case ReadInput(address=address, count=count):
            return _bad_block("read", address, count, limits.max_read_4, (), limits)
        case Read(address=address, count=count):
            return _bad_block("read", address, count, limits.max_read, limits.read_windows, limits)
        case WriteMany(address=address, values=values):
            return _bad_block(
                "written", address, len(values), limits.max_write, limits.write_windows, limits
            )
        case ReadWrite(count=count, values=values):
            if count > limits.max_read_23 or len(values) > limits.max_write_23:
                return (
                    f"Function 23 of device {request.device} reads {limits.max_read_23} and "
                    f"writes {limits.max_write_23} words at most."
                )
        case Diagnose(subfunction=subfunction):
            if subfunction == LISTEN_ONLY:
                return "Listen-only mode would silence the device until it is switched off."
            if subfunction not in limits.subfunctions:
                return f"Device {request.device} has no sub-function {subfunction} of function 8."
    return ""


def _bad_bits(verb: str, count: int, most: int) -> str:
    if count > most:
        return f"{count} coils or inputs cannot be {verb} at once; the device accepts {most}."
    return ""


def _bad_block(
    verb: str, address: int, count: int, most: int, windows: tuple[Window, ...], limits: Limits
) -> str:
    if count == 1 and most >= 1:
        return ""
    if limits.single_words_only:
        if any(window.holds(address, count) for window in windows):
            return ""
        return (
            f"{count} words from register {address} on cannot be {verb} at once: the device "
            "accepts single words and its own blocks."
        )
    if count > most:
        return f"{count} words cannot be {verb} at once; the device accepts {most}."
    return ""
