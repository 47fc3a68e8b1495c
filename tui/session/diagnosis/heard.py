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
"""Beginning of the note on a frame that came while none was due."""


@dataclass(frozen=True, slots=True)
class Heard:
    """Counts of what was heard of one drive, and in its place."""

    requested: int = 0
    answered: int = 0
    late: int = 0
    """Answers that came after the time for them was up."""
    echoed: int = 0
    """Requests that came back as they were sent."""
    exceptions: tuple[int, ...] = ()
    functions: tuple[int, ...] = ()
    """Functions that the drive answered with, where another was asked for."""
    misshapen: int = 0
    """Answers to the right function that are not as long as they must be."""
    others: tuple[int, ...] = ()
    """Addresses that answered in its place, in order."""
    damaged: int = 0
    """Answers that begin as they must and fail their checksum, or break off."""
    garbage: int = 0
    """Bytes that are part of no frame."""
    compared: tuple[int, int] = (0, 0)
    """Of reads that brought garbage alone: bytes that came, and bytes that were due."""

    @property
    def nothing(self) -> bool:
        """True if not one byte came back, an echo aside."""
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


def heard_of(frames: Iterable[Frame], device: int, *, tcp: bool = False) -> Heard:
    """Return the frames about a device; those of other requests are skipped."""
    found, request = Heard(), b""
    exchange: list[Frame] = []
    for frame in frames:
        if frame.direction == "in":
            exchange.append(frame)
            continue
        found = _with(found, request, exchange, tcp)
        exchange = []
        request = frame.data if _device(frame.data, tcp) == device else b""
    return _with(found, request, exchange, tcp)


def _device(data: bytes, tcp: bool) -> int:
    at = TCP_HEAD if tcp else 0
    return data[at] if len(data) > at else -1


def _with(found: Heard, request: bytes, answers: Iterable[Frame], tcp: bool) -> Heard:
    """Add one more exchange."""
    if not request:
        return found
    found = replace(found, requested=found.requested + 1)
    requested = request[TCP_HEAD:] if tcp else request[:-2]
    loose, alone = b"", True
    for frame in answers:
        data = frame.data
        if not tcp and data == request:
            found = replace(found, echoed=found.echoed + 1)
        elif tcp or is_whole(data):
            body = data[TCP_HEAD:] if tcp else data[:-2]
            found = _with_whole(found, requested, body, late=frame.note.startswith(LATE_NOTE))
            alone = False
        else:
            loose += data
    return _with_loose(found, requested, loose, alone=alone)


def _with_whole(found: Heard, requested: bytes, body: bytes, *, late: bool) -> Heard:
    """One whole frame more: address, function and data."""
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


def _with_loose(found: Heard, requested: bytes, loose: bytes, *, alone: bool) -> Heard:
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
    """Bytes of the frame that answers a read, from address to checksum; of a request without it."""
    return 5 + 2 * int.from_bytes(requested[4:6], "big")


def _once(known: tuple[int, ...], new: int) -> tuple[int, ...]:
    return known if new in known else (*known, new)


def heard_by_errors(outcomes: Iterable[LineError | None], device: int) -> Heard:
    """The same where no frames are at hand: from how the requests ended, None being an answer."""
    found = Heard()
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
            case WrongReply(received=received, function=function) if len(received) > 1:
                found = replace(found, functions=_once(found.functions, received[1]))
            case WrongReply():
                found = replace(found, misshapen=found.misshapen + 1)
            case NoAnswer(detail=detail):
                found = replace(found, echoed=found.echoed + ("echo" in detail))
            case _:
                found = replace(found, requested=found.requested - 1)
    return found
