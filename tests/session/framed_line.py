"""A line without a wire that makes frames, counts them, and has faults; its time is a test's."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    ExchangeError,
    LineError,
    LineLost,
    NoAnswer,
    WrongReply,
)
from tui.bus.fake import FakeLine
from tui.bus.limits import CAUTIOUS
from tui.bus.link import Link, TcpLink
from tui.bus.model import IdentificationObjects, LineCounters, LineStatus, Priority, Reply
from tui.bus.requests import Diagnose, Identify, ReportId, Request
from tui.bus.tally import Tally
from tui.bus.trace import Frame
from tui.session.clock import Clock
from tui.wire.frames import frame

BEGUN = 1000.0
KEPT = 110
"""Frames that the line keeps: those of 55 reads."""
ON_THE_WIRE, TURNAROUND = 0.002, 0.008
Piece = tuple[float, bytes, str]
"""Seconds since the request, bytes, and the note on them."""
Fault = Callable[[int, bytes, bytes], tuple[list[Piece], LineError | None]]
"""Makes of the number of a request, the request and its reply what arrives, and the error."""


class SteppedClock(Clock):
    """Time that passes only in sleeps, at once; `events` happen on the way."""

    def __init__(self) -> None:
        self.now = BEGUN
        self.events: list[tuple[float, Callable[[], None]]] = []
        """By their time, seconds after the beginning."""

    def monotonic(self) -> float:
        return self.now

    async def sleep(self, seconds: float) -> None:
        end = self.now + seconds
        while self.events and BEGUN + self.events[0][0] <= end:
            at, happen = self.events.pop(0)
            self.now = max(self.now, BEGUN + at)
            happen()
        self.now = end
        await asyncio.sleep(0)


def well(_number: int, _request: bytes, reply: bytes) -> tuple[list[Piece], LineError | None]:
    """A line without faults."""
    return [(TURNAROUND, reply, "")], None


class FramedLine(FakeLine):
    """One drive's line: each exchange takes time, leaves frames and counts."""

    def __init__(
        self, link: Link, registers: Mapping[int, Mapping[int, int]], fault: Fault = well
    ) -> None:
        self.time = SteppedClock()
        self.fault = fault
        self.tally = Tally(clock=self.time.monotonic)
        self.frames: deque[Frame] = deque(maxlen=KEPT)
        super().__init__(registers, link=link, clock=self.time.monotonic)
        self.diagnosed: dict[int, int] = {}
        """Results of function 8, by sub-function; others give their data back."""
        self.usual: float | None = TURNAROUND
        self.longest: float | None = 2 * TURNAROUND
        """Turnarounds that the line knows once the device was asked."""
        self.sent: list[str] = []
        """Each request, with its priority and its wait."""

    @property
    def trace(self) -> tuple[Frame, ...]:
        """The last frames."""
        return tuple(self.frames)

    @trace.setter
    def trace(self, value: tuple[Frame, ...]) -> None:
        """It begins empty."""

    @property
    def counters(self) -> LineCounters:
        """The counts of this moment."""
        return self.tally.frozen()

    @counters.setter
    def counters(self, value: LineCounters) -> None:
        """Those of a plain fake line are not used."""

    def hear(self, direction: Any, data: bytes, note: str = "") -> None:
        """Keep a frame of this moment."""
        self.tally.bytes_in += len(data) if direction == "in" else 0
        self.frames.append(Frame(self.time.now, direction, data, note))

    async def read(self, device: int, address: int, count: int = 1, **how: Any) -> Reply:
        self._say(f"{address}+{count} by {how.get('function', 3)}", device, how)
        return await super().read(device, address, count, **how)

    async def identify(self, device: int, **how: Any) -> IdentificationObjects:
        self._say(f"identity by {how.get('function', 43)}", device, how)
        return await super().identify(device, **how)

    async def diagnose(self, device: int, subfunction: int, data: int = 0, **how: Any) -> int:
        self._say(f"diagnosis {subfunction} {data}", device, how)
        return await super().diagnose(device, subfunction, data, **how)

    def _say(self, text: str, device: int, how: Mapping[str, Any]) -> None:
        within, priority = how.get("within"), how.get("priority", Priority.POLL)
        limit = "" if within is None else f" {within:.2f} s"
        self._wait = self.timing.first_timeout if within is None else within
        self.sent.append(f"{text} of {device} {priority.name}{limit}")

    async def _exchange(
        self, request: Request, kind: str, carry_out: Callable[[], Any], *how: Any
    ) -> Any:
        self._check(request, self.limits.get(request.device, CAUTIOUS), Priority.POLL)
        device, tally, number = request.device, self.tally, len(self.sent)
        data = self._framed(device, request.pdu())
        tally.count_sent(device, len(data))
        begun = self.time.now
        self.hear("out", data)
        result: Any = None
        try:
            result = carry_out()
            if isinstance(request, Diagnose):
                result = self.diagnosed.get(request.subfunction, result)
            body = _reply(request, result)
            error: LineError | None = None
        except DeviceException as refused:
            body = bytes([request.function | 0x80, refused.code])
            error = refused
        pieces: list[Piece] = []
        if self._device(device).silent:
            error = NoAnswer(device, request.function, request.register)
        else:
            pieces, found = self.fault(number, data, self._framed(device, body))
            error = found or error
        for at, piece, note in pieces:
            await self.time.sleep(max(0.0, begun + at - self.time.now))
            self.hear("in", piece, note)
        if isinstance(error, NoAnswer):
            await self.time.sleep(max(0.0, begun + self._wait - self.time.now))
        else:
            await self.time.sleep(ON_THE_WIRE)
        received = sum(len(piece) for _, piece, _ in pieces)
        tally.count_end(device, self.time.now - begun, received)
        if self.state.status is not LineStatus.CONNECTED:
            raise LineLost(self.state.reason)
        own = self._device(device)
        own.noted(error if isinstance(error, ExchangeError) else None, self.time.now)
        own.state = replace(own.state, turnaround=self.longest, usual_turnaround=self.usual)
        self._count(device, error)
        if error is not None:
            raise error
        return result

    def _count(self, device: int, error: LineError | None) -> None:
        match error:
            case NoAnswer():
                self.tally.count_silence(device, searched=False)
            case ChecksumFault():
                self.tally.count_checksum(device)
                self.tally.count_minute(device, "damaged")
            case WrongReply():
                self.tally.count_wrong(device)
                self.tally.count_minute(device, "foreign")
            case _:
                self.tally.count_reply(device, TURNAROUND)
                self.tally.count_good(device, was_heard=True)
        if isinstance(error, DeviceException):
            self.tally.count_exception(device, error.code)

    def _framed(self, device: int, pdu: bytes) -> bytes:
        if not isinstance(self.link, TcpLink):
            return frame(device, pdu)
        head = (len(self.sent) % 0x10000).to_bytes(2, "big") + b"\0\0"
        return head + (1 + len(pdu)).to_bytes(2, "big") + bytes([device]) + pdu


def _reply(request: Request, result: Any) -> bytes:
    """The reply with a result, from its function on."""
    match request:
        case Diagnose():
            return request.pdu()
        case Identify() | ReportId():
            texts = result.objects.items()
            listed = b"".join(bytes([number, len(text)]) + text for number, text in texts)
            return bytes([request.function, 14, 1, 1, 0, 0, len(texts)]) + listed
    words = b"".join(word.to_bytes(2, "big") for word in result)
    return bytes([request.function, len(words)]) + words
