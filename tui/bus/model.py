"""Values of a line's interface: priorities, states, replies, counters, timing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Annotated, Literal, NamedTuple

from msgspec import Meta

from .bounds import (
    MOST_DEVICES,
    ByteValue,
    DeviceId,
    MonotonicTime,
    Number,
    ProgramShares,
    Seconds,
    Text,
)
from .errors import BytesSwapped, ChecksumFault, DeviceException, NoAnswer, WrongReply


class Priority(IntEnum):
    """Order of sending; within one priority, first come first served."""

    STOP = 0
    FEED = 1
    """A read without which a drive would trip on its communication timeout."""
    OPERATOR_WRITE = 2
    OPERATOR_READ = 3
    POLL = 4
    BACKGROUND = 5
    PATIENT = 6
    """Background work with a longer timeout, for a slow or a disturbed device."""


class LineStatus(Enum):
    """Status of a line; it can be used only while CONNECTED."""

    CLOSED = "closed"
    CONNECTING = "connecting"
    CONNECTED = "connected"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class LineState:
    """State of a line; times are those of the line's clock (time.monotonic)."""

    status: LineStatus
    reason: Text
    """One sentence for a person; empty if there is nothing to report."""
    since: MonotonicTime
    next_try: MonotonicTime | None = None
    """Time of the next attempt on a lost line."""


Contact = Literal["answers", "not_polled", "silent", "refused", "damaged", "swapped"]
"""Result of the last request to a device; `not_polled` if none was sent, `swapped` if the bytes
of its words arrive swapped."""


def contact_of(error: BaseException) -> Contact:
    """Result of a request that failed by an error; `not_polled` if none was sent."""
    match error:
        case NoAnswer():
            return "silent"
        case ChecksumFault() | WrongReply():
            return "damaged"
        case BytesSwapped():
            return "swapped"
        case DeviceException():
            return "refused"
        case _:
            return "not_polled"


@dataclass(frozen=True, slots=True)
class DeviceState:
    """Knowledge of the line about one device."""

    answers: bool | None
    """True if its last request was answered; None before the first."""
    failures: Number
    """Requests not answered in a row."""
    silent_since: MonotonicTime | None
    next_try: MonotonicTime | None
    """When polls are sent again; None when they are sent now."""
    turnaround: Seconds | None
    """Seconds from the end of a request to the start of its reply, longest of the recent ones."""
    usual_turnaround: Seconds | None
    """The median of the same."""
    heard: MonotonicTime | None
    """When its last reply ended, on the line's clock; None before the first."""
    lateness: Seconds = 0.0
    """Longest delay of a reply after its timeout in seconds; decreases with replies in time."""
    copies_within: Seconds = 0.0
    """Seconds after a reply in which a second copy may come; 0 if none ever did."""
    refused: bool = False
    """True if its last reply was a refusal."""

    @property
    def contact(self) -> Contact:
        """Result of the last request to it."""
        if self.answers is None:
            return "not_polled"
        if not self.answers:
            return "silent"
        return "refused" if self.refused else "answers"


@dataclass(frozen=True, slots=True)
class Reply:
    """A checked reply; `time` when its last byte was on the wire."""

    words: tuple[int, ...]
    """Registers that the reply contains, if it contains any."""
    time: float
    pdu: bytes = b""
    """Function and data as received; empty for a broadcast, which no device answers."""


@dataclass(frozen=True, slots=True)
class IdentificationObjects:
    """Objects of function 43/14; `conformity` as the device gives it."""

    conformity: int
    objects: Mapping[int, bytes]


TURNAROUND_EDGES = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Seconds at which one bar of the histogram of turnarounds ends and the next begins."""
_BARS = len(TURNAROUND_EDGES) + 1
TurnaroundBars = Annotated[tuple[Number, ...], Meta(min_length=_BARS, max_length=_BARS)]
ExceptionCounts = Annotated[Mapping[ByteValue, Number], Meta(max_length=256)]


@dataclass(frozen=True, slots=True)
class LastMinute:
    """Replies of the last minute, without those to a search for drives.

    A missed reply is `lost` once the drive answers again, after one or two misses or within 5 s.
    Until then, and while the drive stays silent, it is `silent`: a problem of the drive alone.
    """

    good: Number = 0
    """Right replies, refusals among them."""
    lost: Number = 0
    silent: Number = 0
    """Missed by a drive that has not answered since; of a device only, not of a line."""
    damaged: Number = 0
    """Damaged replies, and replies to another request."""
    foreign: Number = 0
    """Frames of another master or an unknown device; of a line only."""
    strays: Number = 0
    """Other whole frames that answer no request: second copies, but no late replies."""

    @property
    def replies(self) -> int:
        """Replies by which the line is judged."""
        return self.good + self.lost + self.damaged

    @property
    def share(self) -> float | None:
        """The share of good replies by which the line is judged; None without any."""
        return self.good / self.replies if self.replies else None

    @property
    def whole_share(self) -> float | None:
        """The share of good replies, those of a silent drive counted as missed."""
        awaited = self.replies + self.silent
        return self.good / awaited if awaited else None


@dataclass(frozen=True, slots=True)
class DeviceCounters:
    """Counts of one device since the line was opened; device 0 is all of them."""

    requests: Number = 0
    """Frames that were sent to it, repeated ones too."""
    replies: Number = 0
    """Whole and right replies, refusals among them."""
    timeouts: Number = 0
    checksum: Number = 0
    """Replies that came damaged."""
    wrong: Number = 0
    repeats: Number = 0
    """Requests that were sent again."""
    exceptions: ExceptionCounts = field(default_factory=dict)
    """Refusals by their code."""
    bytes_out: Number = 0
    bytes_in: Number = 0
    """Bytes that came while its reply was due, including unrelated ones."""
    busy_seconds: Seconds = 0.0
    turnarounds: TurnaroundBars = (0,) * _BARS
    """Replies by their turnaround: up to each edge, and beyond the last."""
    minute: LastMinute = LastMinute()


@dataclass(frozen=True, slots=True)
class LineCounters:
    """Counts of a line since it was opened."""

    requests: Number = 0
    replies: Number = 0
    timeouts: Number = 0
    """Unanswered requests to devices that have answered before or that a person requested."""
    searched: Number = 0
    """Unanswered requests of a search, to addresses without a known device."""
    checksum: Number = 0
    wrong: Number = 0
    exceptions: Number = 0
    resyncs: Number = 0
    """Replies found after or between bytes that did not belong to them."""
    stale: Number = 0
    """Whole frames that came when none was due; they were discarded."""
    bytes_out: Number = 0
    bytes_in: Number = 0
    busy_seconds: Seconds = 0.0
    framing: Number = 0
    """Characters without a stop bit; 0 if the port does not report them."""
    parity: Number = 0
    breaks: Number = 0
    overruns: Number = 0
    repeats: Number = 0
    """Requests that were sent again."""
    programs: ProgramShares = field(default_factory=dict)
    """Recent share of the line's time, by the id of the program."""
    devices: Annotated[Mapping[DeviceId, DeviceCounters], Meta(max_length=MOST_DEVICES)] = field(
        default_factory=dict
    )
    minute: LastMinute = LastMinute()


@dataclass(frozen=True, slots=True)
class Timing:
    """Seconds and counts that govern a line."""

    first_timeout: float = 1.0
    """Timeout until a device's turnaround is known, and the longest ever waited."""
    min_timeout: float = 0.15
    """The shortest timeout that measured turnarounds may lead to."""
    scan_timeout: float = 0.4
    """Timeout of background requests to a device that never answered yet."""
    patient_timeout: float = 0.8
    """The same for a second attempt."""
    late_reply: float = 2.0
    """Seconds after a request in which its reply may still come. Until then, a request is held
    back if that reply could be mistaken for its own."""
    turnaround_delay: float = 0.1
    """Quiet time after a broadcast."""
    retries: int = 1
    """Repeats of an operator's read without an answer, and of reads with a damaged one."""
    back_off_first: float = 1.0
    back_off_longest: float = 10.0
    reconnect_first: float = 0.5
    reconnect_longest: float = 5.0
    connect_timeout: float = 3.0
    frame_gap: float = 0.02
    """Least silence that ends a damaged reply: adapters hand over bytes in lumps (FTDI 16 ms)."""
    frame_gap_tcp: float = 0.08
    """The same for RTU over TCP."""
    wire_time: bool | None = None
    """True if bytes take the time of their baud: then a reply that began before the end of its
    request belongs to another request. None: on every serial port except a pseudo-terminal."""
    probes: bool = True
    """True if a drive must prove that its replies belong to their requests before they count."""
    queue_length: int = 256
    trace_length: int = 1000


class EndedExchange(NamedTuple):
    """One request and its result, as they were on the wire."""

    device: int
    request: bytes
    """Function and data; empty if there are only strays."""
    result: str
    """Value of a ResultKind; `copy` for a reply that may repeat the one before, `sent` for a frame
    whose reply nobody awaits."""
    reply: bytes
    """Function and data of a checked reply or an exception, else what was received."""
    sent: float
    """When the last byte of the request left (monotonic)."""
    end: float
    """When the last byte of the reply came, or the timeout ended (monotonic)."""
    wall: float
    """Time of day of `end` in seconds since 1970, by the clock as it was then."""
    program: str = ""
    """Id of the requesting program; empty for the holder of the line itself."""
    repeat: int = 0
    """Number of earlier tries; a reply may be a late one to the first of them."""
    strays: tuple[bytes, ...] = ()
    """Whole frames that came with the reply, or without any request, and are not part of it."""
