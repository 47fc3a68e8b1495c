"""What programs that share a line tell each other: tagged messages, length before each.

Times are those of the machine's monotonic clock, which all its programs share.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from ..errors import (
    ChecksumFault,
    DeviceException,
    LineBusy,
    LineClosed,
    LineError,
    LineLost,
    NoAnswer,
    RequestRefused,
    Superseded,
    WrongReply,
)
from ..limits import Limits
from ..model import DeviceState, LineCounters, LineState, Priority
from ..requests import Diagnose, Identify, Read, ReadInput, ReadWrite, Request, WriteMany, WriteOne
from ..shared_facts import Program

VERSION = 1
"""Of the messages; programs of different versions do not share a line."""
LONGEST = 1 << 18
"""Bytes of one message; more is no message of ours."""
LENGTH = 4


class Message(msgspec.Struct, frozen=True, tag=True):
    """Something that one program tells another."""


class Hello(Message, frozen=True):
    """A program wants to attach."""

    version: int
    program: Program
    label: str
    """The line as it was meant, with its settings."""
    stops: dict[int, int]
    """The counts of stops that it knows."""


class Welcome(Message, frozen=True):
    """The owner takes a program in."""

    owner: Program
    label: str
    """The line as it is open."""
    asked: bool = True
    """Whether it is open with the settings that were meant."""


class TurnedAway(Message, frozen=True):
    """The owner takes a program not in, and why."""

    why: str


class Describe(Message, frozen=True):
    """What a device may be sent."""

    device: int
    limits: Limits


class Ask(Message, frozen=True):
    """A request for the line."""

    number: int
    kind: str
    fields: dict[str, Any]
    priority: int
    replaceable: bool
    max_age: float
    stamp: int
    """The count of stops of the device that the asker knew of."""
    limits: Limits | None = None
    """Where they are not those of the device: of a broadcast."""


class Withdraw(Message, frozen=True):
    """Nobody waits for a request any more."""

    number: int


class Answer(Message, frozen=True):
    """What the line answered; `time` when its last byte was on the wire."""

    number: int
    pdu: bytes
    time: float


class ErrorForm(msgspec.Struct, frozen=True, omit_defaults=True):
    """An error as a message carries it; which fields count is its kind's own business."""

    text: str = ""
    device: int = 0
    function: int = 0
    address: int = 0
    detail: str = ""
    received: bytes = b""
    code: int = 0
    meaning: str = ""
    register: int = 0
    retry_in: float | None = None


class Failed(Message, frozen=True):
    """What became of a request that was not answered well."""

    number: int
    error: str
    form: ErrorForm


class StopGiven(Message, frozen=True):
    """Somebody stops devices: all that was meant for them before is void."""

    devices: tuple[int, ...]
    by: str
    program: Program


class Claim(Message, frozen=True):
    """A program wants to command a device, or no longer."""

    device: int
    take: bool


class Denied(Message, frozen=True):
    """Another program commands the device."""

    device: int
    holder: Program


class Question(Message, frozen=True):
    """A program asks the one that commands a device to leave it."""

    device: int
    program: Program


class Reply(Message, frozen=True):
    """The answer to a Question, to `program`."""

    device: int
    program: str
    yes: bool
    why: str = ""


class Hush(Message, frozen=True):
    """A device is left alone, or with no reason no longer."""

    device: int
    why: str


class Told(Message, frozen=True):
    """Something that every person on the line is to read."""

    device: int
    text: str


class Wish(Message, frozen=True):
    """The share of the line's time that a program's polls take, by device.

    `trace` where it shows frames.
    """

    shares: dict[int, float]
    trace: bool


class Facts(Message, frozen=True):
    """What all must know; sent when it changes."""

    programs: tuple[Program, ...]
    commanders: dict[int, str]
    """Ids of the programs that command, by device."""
    stops: dict[int, int]
    hushed: dict[int, tuple[str, str]]
    """Who leaves which device alone, and why."""


class News(Message, frozen=True):
    """What the line does; sent again and again, and the owner's sign of life."""

    state: LineState
    counters: LineCounters
    devices: dict[int, DeviceState]
    """Those that have changed."""
    shares: dict[int, float]
    """The share of the line's time that all other programs' polls take, by device."""
    frames: tuple[tuple[float, str, bytes, str], ...] = ()


class Goodbye(Message, frozen=True):
    """The owner ends; a reply may still come for `quiet` seconds."""

    quiet: float


AnyMessage = (
    Hello | Welcome | TurnedAway | Describe | Ask | Withdraw | Answer | Failed | StopGiven | Claim
    | Denied | Question | Reply | Told | Hush | Wish | Facts | News | Goodbye
)  # fmt: skip

_ENCODER = msgspec.msgpack.Encoder()
_DECODER: msgspec.msgpack.Decoder[AnyMessage] = msgspec.msgpack.Decoder(AnyMessage)

KINDS: Mapping[str, type[Request]] = {
    kind.__name__: kind
    for kind in (Read, ReadInput, WriteOne, WriteMany, ReadWrite, Diagnose, Identify)
}


class NoMessage(Exception):
    """Bytes that are no message of ours."""


def packed(message: AnyMessage) -> bytes:
    """A message as it goes over the socket."""
    data = _ENCODER.encode(message)
    return len(data).to_bytes(LENGTH, "big") + data


async def next_message(reader: asyncio.StreamReader) -> AnyMessage:
    """The next message. Raises NoMessage, EOFError where the other end is gone, OSError."""
    length = int.from_bytes(await reader.readexactly(LENGTH), "big")
    if length > LONGEST:
        raise NoMessage(f"{length} bytes")
    data = await reader.readexactly(length)
    try:
        return _DECODER.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise NoMessage(str(error)) from error


def request_form(request: Request) -> tuple[str, dict[str, Any]]:
    """A request as a message carries it."""
    return type(request).__name__, msgspec.to_builtins(request, builtin_types=(bytes,))


def request_of(message: Ask) -> Request:
    """The request that a message carries. Raises NoMessage."""
    kind = KINDS.get(message.kind)
    if kind is None:
        raise NoMessage(f"request {message.kind!r}")
    try:
        return msgspec.convert(message.fields, kind)
    except msgspec.MsgspecError as error:
        raise NoMessage(str(error)) from error


def priority_of(number: int) -> Priority:
    """A priority that a message carries. Raises NoMessage."""
    try:
        return Priority(number)
    except ValueError as error:
        raise NoMessage(str(error)) from error


_PLAIN: Mapping[str, type[LineError]] = {
    kind.__name__: kind for kind in (RequestRefused, LineBusy, LineLost, LineClosed)
}


_MADE: Mapping[str, Callable[[ErrorForm], LineError]] = {
    "NoAnswer": lambda e: NoAnswer(e.device, e.function, e.address, e.detail, retry_in=e.retry_in),
    "ChecksumFault": lambda e: ChecksumFault(e.device, e.function, e.address, e.detail, e.received),
    "WrongReply": lambda e: WrongReply(e.device, e.function, e.address, e.detail, e.received),
    "DeviceException": lambda e: DeviceException(
        e.device, e.function, e.address, e.code, e.meaning
    ),
    "Superseded": lambda e: Superseded(e.device, e.register),
}
"""How each error with fields of its own is made anew."""


def failure(number: int, error: BaseException) -> Failed:
    """What became of a request, as a message carries it."""
    name = type(error).__name__
    if name not in _MADE:
        return Failed(number, name if name in _PLAIN else "LineError", ErrorForm(str(error)))
    held = {
        key: getattr(error, key)
        for key in ErrorForm.__struct_fields__
        if key != "text" and hasattr(error, key)
    }
    return Failed(number, name, ErrorForm(str(error), **held))


def error_of(message: Failed) -> LineError:
    """The error that a message carries."""
    if (make := _MADE.get(message.error)) is not None:
        return make(message.form)
    return _PLAIN.get(message.error, LineError)(message.form.text)
