"""What programs that share a line tell each other: tagged messages, length before each.

Times are those of the machine's monotonic clock, which all its programs share.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import msgspec

from ..limits import Limits
from ..model import DeviceCounters, DeviceState, LineCounters, LineState, Priority
from ..program import Program
from ..requests import (
    Diagnose,
    Identify,
    Read,
    ReadInput,
    ReadWrite,
    ReportId,
    Request,
    WriteMany,
    WriteOne,
)
from .failures import ErrorForm

VERSION = 3
"""Of the messages; programs of different versions do not share a line."""
LONGEST_MESSAGE = 1 << 18
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
    stops: dict[int, dict[str, int]]
    """The stops that it knows of, by device and program."""
    stopped: dict[int, float] = {}
    """When each device was stopped last, as far as it knows."""


class Welcome(Message, frozen=True):
    """The owner takes a program in."""

    owner: Program
    label: str
    """The line as it is open."""
    asked: bool = True
    """Whether it is open with the settings that were meant."""
    gone: bool = False
    """Whether it was taken for gone meanwhile: it commands nothing any more."""


class TurnedAway(Message, frozen=True):
    """The owner takes a program not in, and why."""

    why: str


class Describe(Message, frozen=True):
    """What a device may be sent."""

    device: int
    limits: Limits


class Asking(Message, frozen=True):
    """A request for the line."""

    number: int
    kind: str
    fields: dict[str, Any]
    priority: int
    replaceable: bool
    max_age: float
    stamp: int
    """The count of stops of the device that the asker knew of."""
    asked: float
    """When the program asked."""
    limits: Limits | None = None
    """Where they are not those of the device: of a broadcast."""
    within: float | None = None
    """Seconds in which the answer is to begin, where the asker says it."""


class Withdraw(Message, frozen=True):
    """Nobody waits for a request any more."""

    number: int


class Answer(Message, frozen=True):
    """What the line answered; `time` when its last byte was on the wire."""

    number: int
    pdu: bytes
    time: float


class Failed(Message, frozen=True):
    """What became of a request that was not answered well."""

    number: int
    error: str
    form: ErrorForm


class StopGiven(Message, frozen=True):
    """Somebody stops devices: all that was meant for them before is void."""

    devices: tuple[int, ...]
    counts: tuple[int, ...]
    """How often the program has stopped each of them by now."""
    by: str
    program: Program
    when: float | None = None
    """When; None: just now."""


class RollCall(Message, frozen=True):
    """The owner stood still, and asks who is there: what was said meanwhile comes before it."""

    number: int


class Here(Message, frozen=True):
    """The answer to a RollCall; nothing goes out past the owner any more."""

    number: int


class Alive(Message, frozen=True):
    """A program's sign of life: one that gives none for long is let go."""


class Claim(Message, frozen=True):
    """A program wants to command a device, or no longer."""

    device: int
    take: bool


class Denied(Message, frozen=True):
    """Another program commands the device."""

    device: int
    holder: Program


class AskedFor(Message, frozen=True):
    """A program asks the one that commands a device to leave it."""

    device: int
    program: Program


class Granting(Message, frozen=True):
    """The answer to a AskedFor, to `program`."""

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


class PollWish(Message, frozen=True):
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
    stops: dict[int, dict[str, int]]
    """How many stops each device was given, by program."""
    hushed: dict[int, tuple[str, str]]
    """Who leaves which device alone, and why."""
    stopped: dict[int, float] = {}
    """When each device was stopped last."""


class News(Message, frozen=True):
    """What the line does; sent again and again, and the owner's sign of life."""

    state: LineState
    counters: LineCounters
    devices: dict[int, DeviceState]
    """Those that have changed."""
    shares: dict[int, float]
    """The share of the line's time that all other programs' polls take, by device."""
    frames: tuple[tuple[float, str, bytes, str], ...] = ()
    counted: dict[int, DeviceCounters] = {}
    """Counts of the devices whose counts have changed."""


class Goodbye(Message, frozen=True):
    """The owner ends; a reply may still come for `quiet` seconds."""

    quiet: float


AnyMessage = (
    Hello | Welcome | TurnedAway | Describe | Asking | Withdraw | Answer | Failed | StopGiven
    | Alive | Claim | RollCall | Here | Denied | AskedFor | Granting | Told | Hush | PollWish
    | Facts | News | Goodbye
)  # fmt: skip

_ENCODER = msgspec.msgpack.Encoder()
_DECODER: msgspec.msgpack.Decoder[AnyMessage] = msgspec.msgpack.Decoder(AnyMessage)

REQUEST_KINDS: Mapping[str, type[Request]] = {
    kind.__name__: kind
    for kind in (Read, ReadInput, WriteOne, WriteMany, ReadWrite, Diagnose, Identify, ReportId)
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
    if length > LONGEST_MESSAGE:
        raise NoMessage(f"{length} bytes")
    return unpacked(await reader.readexactly(length))


def message_of(data: bytes) -> AnyMessage:
    """The one message in bytes with its length before it. Raises NoMessage."""
    if int.from_bytes(data[:LENGTH], "big") != len(data) - LENGTH:
        raise NoMessage(f"{len(data)} bytes")
    return unpacked(data[LENGTH:])


def unpacked(data: bytes) -> AnyMessage:
    """A message without its length. Raises NoMessage."""
    try:
        return _DECODER.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise NoMessage(str(error)) from error


def request_form(request: Request) -> tuple[str, dict[str, Any]]:
    """A request as a message carries it."""
    return type(request).__name__, msgspec.to_builtins(request, builtin_types=(bytes,))


def asked_request(message: Asking) -> Request:
    """The request that a message carries. Raises NoMessage."""
    kind = REQUEST_KINDS.get(message.kind)
    if kind is None:
        raise NoMessage(f"request {message.kind!r}")
    try:
        request = msgspec.convert(message.fields, kind)
        bytes([request.device])
        request.pdu()
    except Exception as error:
        # a request that cannot be put into bytes, for whichever reason, is none
        raise NoMessage(str(error)) from error
    return request


def priority_of(number: int) -> Priority:
    """A priority that a message carries. Raises NoMessage."""
    try:
        return Priority(number)
    except ValueError as error:
        raise NoMessage(str(error)) from error
