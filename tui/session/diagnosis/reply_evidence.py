"""Replies to the requests to one drive, taken from the frames of its line; pure functions."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from tui.bus.errors import ChecksumFault, DeviceException, LineError, NoAnswer, WrongReply
from tui.bus.trace import Frame
from tui.wire.frames import is_whole

REFUSED = 0x80
"""Bit that a refusal adds to its function."""
REGISTER_READS = (3, 4)
TCP_HEAD = 6
"""Bytes of Modbus TCP before the address."""
ECHO_NOTE = "echo"
LATE_NOTE = "late"
"""Beginning of the note on a frame that arrived while no reply was due."""


@dataclass(frozen=True, slots=True)
class ReplyEvidence:
    """Counts of the replies to the requests to one drive."""

    requested: int = 0
    answered: int = 0
    late: int = 0
    """Answers that arrived after the timeout."""
    echoed: int = 0
    """Requests that returned unchanged."""
    exceptions: tuple[int, ...] = ()
    functions: tuple[int, ...] = ()
    """Functions of replies that differ from the requested one."""
    misshapen: int = 0
    """Answers with the requested function and a wrong length."""
    others: tuple[int, ...] = ()
    """Addresses that answered instead of the drive, in order."""
    damaged: int = 0
    """Answers with a correct beginning that fail their checksum or are cut short.
    Over Modbus TCP, frames whose length does not fit."""
    garbage: int = 0
    """Number of bytes outside any frame."""
    compared: tuple[int, int] = (0, 0)
    """For reads that returned only garbage: bytes received, and bytes due."""

    @property
    def nothing(self) -> bool:
        """True if no byte was received, except an echo."""
        return not (
            self.answered
            or self.late
            or self.exceptions
            or self.functions
            or self.misshapen
            or self.others
            or self.damaged
            or self.garbage
        )


def evidence_of_frames(frames: Iterable[Frame], device: int, *, tcp: bool = False) -> ReplyEvidence:
    """Return the frames about a device; those of other requests are skipped."""
    found, request = ReplyEvidence(), b""
    exchange: list[Frame] = []
    for frame in frames:
        if frame.direction == "in":
            exchange.append(frame)
            continue
        found = _with(found, request, exchange, tcp)
        exchange = []
        request = frame.data if _device(frame.data, tcp) == device else b""
    return _with(found, request, exchange, tcp)


def is_whole_tcp(data: bytes) -> bool:
    """True for a frame of Modbus TCP with as many bytes as its header says."""
    length = int.from_bytes(data[TCP_HEAD - 2 : TCP_HEAD], "big")
    return length > 1 and len(data) == TCP_HEAD + length and data[2:4] == b"\0\0"


def _device(data: bytes, tcp: bool) -> int:
    at = TCP_HEAD if tcp else 0
    return data[at] if len(data) > at else -1


def _with(
    found: ReplyEvidence, request: bytes, answers: Iterable[Frame], tcp: bool
) -> ReplyEvidence:
    """Return the counts with one more exchange."""
    if not request:
        return found
    found = replace(found, requested=found.requested + 1)
    requested = request[TCP_HEAD:] if tcp else request[:-2]
    loose, alone = b"", True
    for frame in answers:
        data = frame.data
        if not tcp and data == request:
            found = replace(found, echoed=found.echoed + 1)
        elif is_whole_tcp(data) if tcp else is_whole(data):
            body = data[TCP_HEAD:] if tcp else data[:-2]
            found = _with_whole(found, requested, body, late=frame.note.startswith(LATE_NOTE))
            alone = False
        elif tcp:
            found = replace(found, damaged=found.damaged + 1)
        else:
            loose += data
    return _with_loose(found, requested, loose, alone=alone)


def _with_whole(
    found: ReplyEvidence, requested: bytes, body: bytes, *, late: bool
) -> ReplyEvidence:
    """Return the counts with one more intact frame: address, function and data."""
    device, function = body[0], body[1]
    if device != requested[0]:
        return replace(found, others=_once(found.others, device))
    if function == requested[1] | REFUSED:
        return replace(found, exceptions=(*found.exceptions, body[-1]))
    if function != requested[1]:
        return replace(found, functions=_once(found.functions, function))
    if function in REGISTER_READS and len(body) != due_bytes(requested) - 2:
        return replace(found, misshapen=found.misshapen + 1)
    if late:
        return replace(found, late=found.late + 1)
    return replace(found, answered=found.answered + 1)


def _with_loose(
    found: ReplyEvidence, requested: bytes, loose: bytes, *, alone: bool
) -> ReplyEvidence:
    if not loose:
        return found
    if loose[:2] in (requested[:2], bytes([requested[0], requested[1] | REFUSED])):
        return replace(found, damaged=found.damaged + 1)
    found = replace(found, garbage=found.garbage + len(loose))
    if requested[1] in REGISTER_READS and alone:
        came, due = found.compared
        found = replace(found, compared=(came + len(loose), due + due_bytes(requested)))
    return found


def due_bytes(requested: bytes) -> int:
    """Return the bytes of the reply to a read, from address to checksum; of the request if it is
    not a read."""
    return 5 + 2 * int.from_bytes(requested[4:6], "big")


def _once(known: tuple[int, ...], new: int) -> tuple[int, ...]:
    return known if new in known else (*known, new)


def _differs(received: bytes, function: int) -> bool:
    return len(received) > 1 and received[1] != function


def evidence_of_errors(outcomes: Iterable[LineError | None], device: int) -> ReplyEvidence:
    """Return the same counts from the results of requests, None for an answer, if frames are
    missing."""
    found = ReplyEvidence()
    for outcome in outcomes:
        found = replace(found, requested=found.requested + 1)
        match outcome:
            case None:
                found = replace(found, answered=found.answered + 1)
            case DeviceException(code=code):
                found = replace(found, exceptions=(*found.exceptions, code))
            case ChecksumFault(received=received, function=function):
                request = bytes([device, function, 0, 0, 0, 1])
                found = _with_loose(found, request, received, alone=True)
            case WrongReply(received=received) if is_whole(received) and received[0] != device:
                found = replace(found, others=_once(found.others, received[0]))
            case WrongReply(received=received, function=function) if _differs(received, function):
                found = replace(found, functions=_once(found.functions, received[1]))
            case WrongReply():
                found = replace(found, misshapen=found.misshapen + 1)
            case NoAnswer(detail=detail):
                found = replace(found, echoed=found.echoed + ("echo" in detail))
            case _:
                found = replace(found, requested=found.requested - 1)
    return found
