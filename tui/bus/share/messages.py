"""Messages between programs that share a line: tagged, with the length before each.

Times are those of the machine's monotonic clock, which all its programs share.
"""

from __future__ import annotations

import asyncio
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ..bounds import (
    MOST_DEVICES,
    MOST_FRAMES,
    MOST_PROGRAMS,
    MOST_STRETCH,
    ByteString,
    CareBytes,
    DeviceId,
    DeviceIds,
    MonotonicTime,
    Notice,
    Number,
    ProgramId,
    Seconds,
    Shares,
    StopCount,
    StopsByDevice,
    StopTimes,
    Text,
    Word,
)
from ..keep_alive import KeepAlive
from ..limits import Limits
from ..line_events import DeviceWritten
from ..model import DeviceCounters, DeviceState, LineCounters, LineState, Priority
from ..notes import LineNote
from ..program import Program
from ..trace import Frame
from .carried import ErrorForm, Polled, Subscribe, Unsubscribe

VERSION = 11
"""Of the messages; programs of different versions do not share a line."""
LONGEST_MESSAGE = 1 << 22
"""Bytes of one message; a longer message is invalid."""
LENGTH = 4


class Message(msgspec.Struct, frozen=True, tag=True):
    """A message between programs."""


class Hello(Message, frozen=True):
    """A program requests to attach."""

    version: Number
    program: Program
    label: Text
    """The line as requested, with its settings."""
    stops: StopsByDevice
    """The stops that it knows of, by device and program."""
    stopped: StopTimes = {}
    """When each device was stopped last, as far as it knows."""


class Welcome(Message, frozen=True):
    """The owner admits a program."""

    owner: Program
    label: Text
    """The line with its actual settings."""
    requested: bool = True
    """True if these are the requested settings."""
    gone: bool = False
    """True if it counted as exited in the meantime: it commands nothing any more."""


class TurnedAway(Message, frozen=True):
    """The owner rejects a program, with the reason."""

    why: Text


class Describe(Message, frozen=True):
    """Requests that a device accepts."""

    device: DeviceId
    limits: Limits


class Asking(Message, frozen=True):
    """A request for the line."""

    number: Number
    kind: Word
    fields: Annotated[dict[Word, Any], Meta(max_length=8)]
    priority: Priority
    replaceable: bool
    max_age: Seconds
    stamp: StopCount
    """The count of stops of the device that the asker knew of."""
    requested: MonotonicTime
    limits: Limits | None = None
    """Limits if they differ from the device's: of a broadcast."""
    within: Seconds | None = None
    """Timeout in seconds, if the requester sets it."""


class Withdraw(Message, frozen=True):
    """The requester no longer waits for a request."""

    number: Number


class Answer(Message, frozen=True):
    """Reply of the line; `time` when its last byte was on the wire."""

    number: Number
    pdu: ByteString
    time: MonotonicTime


class Failed(Message, frozen=True):
    """Result of a request that failed."""

    number: Number
    form: ErrorForm


class StopGiven(Message, frozen=True):
    """A program stops devices: all earlier commands to them are canceled."""

    devices: DeviceIds
    counts: Annotated[tuple[StopCount, ...], Meta(max_length=MOST_DEVICES)]
    """Stops of each device given by the program so far."""
    by: Text
    program: Program
    when: MonotonicTime | None = None
    """When; None: just now."""

    def __post_init__(self) -> None:
        if len(self.counts) != len(self.devices):
            raise ValueError("not one count for each device")


class Alive(Message, frozen=True):
    """A program's heartbeat: one that sends none for long is disconnected. Also acknowledges
    stops."""


class Pulse(Message, frozen=True):
    """Sent instead of a Hello: this connection carries the heartbeat of an attached program."""

    program: ProgramId


class Claim(Message, frozen=True):
    """A program takes command of a device, or releases it."""

    device: DeviceId
    take: bool


class Armed(Message, frozen=True):
    """A program may write to a device until a time, or until it leaves the line."""

    device: DeviceId
    stamp: StopCount
    """The count of stops of the device when it was armed."""
    until: MonotonicTime | None = None
    care: CareBytes = b""
    """The care for the device; empty if that has not changed."""


class RequestDenied(Message, frozen=True):
    """Another program commands the device."""

    device: DeviceId
    holder: Program


class DriveRequested(Message, frozen=True):
    """A program requests a device from its commander."""

    device: DeviceId
    program: Program


class RequestGranted(Message, frozen=True):
    """The answer to a DriveRequested, to `program`."""

    device: DeviceId
    program: ProgramId
    yes: bool
    why: Text = ""


class PollPause(Message, frozen=True):
    """Polling of a device is paused; an empty reason resumes it."""

    device: DeviceId
    why: Notice


class Notified(Message, frozen=True):
    """A notice for every person on the line."""

    device: DeviceId
    text: Text


class PollWish(Message, frozen=True):
    """A client's share of the line's time for polls, by device; `trace` is True if it shows
    frames."""

    shares: Shares
    trace: bool


class Facts(Message, frozen=True):
    """State that all programs need; sent on change."""

    programs: Annotated[tuple[Program, ...], Meta(max_length=MOST_PROGRAMS)]
    commanders: Annotated[dict[DeviceId, ProgramId], Meta(max_length=MOST_DEVICES)]
    """Ids of the programs that command, by device."""
    stops: StopsByDevice
    """Stops given to each device, by program."""
    paused: Annotated[dict[DeviceId, tuple[ProgramId, Notice]], Meta(max_length=MOST_DEVICES)]
    """Program that paused polling of each device, and why."""
    stopped: StopTimes = {}
    """When each device was stopped last."""
    departed: Annotated[tuple[Program, ...], Meta(max_length=MOST_PROGRAMS)] = ()
    """Programs that have left the line, the last ones last."""


class News(Message, frozen=True):
    """State of the line, sent repeatedly; also the owner's heartbeat."""

    state: LineState
    counters: LineCounters
    devices: Annotated[dict[DeviceId, DeviceState], Meta(max_length=MOST_DEVICES)]
    """Those that have changed."""
    shares: Shares
    """The share of the line's time for polls of all other programs, by device."""
    failure: ErrorForm | None = None
    """The error of a line that is lost."""
    frames: Annotated[tuple[Frame, ...], Meta(max_length=MOST_FRAMES)] = ()
    counted: Annotated[dict[DeviceId, DeviceCounters], Meta(max_length=MOST_DEVICES)] = {}
    """Counts of the devices whose counts have changed."""
    stretch: Annotated[float, Meta(ge=1.0, le=MOST_STRETCH)] = 1.0
    """The factor by which the periods of all polls are lengthened."""


class Goodbye(Message, frozen=True):
    """A client leaves. The owner closes the connection: after the port, if it was the last client.

    Instead of a Hello, it requests the end of a keeper without clients.
    """


AnyMessage = (
    Hello | Welcome | TurnedAway | Describe | Asking | Withdraw | Answer | Failed | StopGiven
    | Alive | Pulse | Claim | RequestDenied | DriveRequested | RequestGranted | Notified | PollPause
    | PollWish | Facts | News | Goodbye | Armed | LineNote | KeepAlive | Subscribe
    | Unsubscribe | Polled | DeviceWritten
)  # fmt: skip

_ENCODER = msgspec.msgpack.Encoder()
_DECODER: msgspec.msgpack.Decoder[AnyMessage] = msgspec.msgpack.Decoder(AnyMessage)


class NoMessage(Exception):
    """Bytes that form no valid message."""


def packed(message: AnyMessage) -> bytes:
    """A message with its length, as sent over the socket."""
    data = _ENCODER.encode(message)
    return len(data).to_bytes(LENGTH, "big") + data


async def next_message(reader: asyncio.StreamReader, head: bytes = b"") -> AnyMessage:
    """The message after its length, `head` if read. Raises NoMessage, EOFError, OSError."""
    length = int.from_bytes(head or await reader.readexactly(LENGTH), "big")
    if length > LONGEST_MESSAGE:
        raise NoMessage(f"{length} bytes")
    return unpacked(await reader.readexactly(length))


def unpacked(data: bytes) -> AnyMessage:
    """A message without its length. Raises NoMessage."""
    try:
        return _DECODER.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise NoMessage(str(error)) from error
