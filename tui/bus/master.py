"""Exchange of one request and its reply over any kind of line: what is sent, and the result."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, Protocol

from .errors import LineLost
from .expectation import Expectation
from .model import Timing
from .tally import Tally
from .trace import Trace

MonotonicClock = Callable[[], float]


@dataclass(frozen=True, slots=True)
class Sending:
    """One request on its way, with the form of its reply.

    `expectation` None is a broadcast. See RtuExchange for `sure` and `skip`.
    """

    device: int
    pdu: bytes
    expectation: Expectation | None
    time_out: float
    sure: bool = True
    skip: int = 0
    look: Callable[[], None] = lambda: None
    """Called just before the first byte; raises if the request must not be sent any more."""


StrayKind = Literal["late", "copy", ""]
"""Origin of a frame that is not the awaited reply: a late reply, a copy of one, or unknown."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of the received bytes: a whole frame of any device, or bytes that form none."""

    data: bytes
    whole: bool

    @property
    def device(self) -> int:
        """The device of a whole frame."""
        return self.data[0]

    @property
    def pdu(self) -> bytes:
        """Function and data of a whole frame."""
        return self.data[1:-2]


class ResultKind(Enum):
    """Result of an exchange, by kind."""

    REPLY = "reply"
    EXCEPTION = "exception"
    DAMAGED = "damaged"
    WRONG = "wrong"
    NOTHING = "nothing"
    UNSURE = "unsure"
    """One copy of the request came back: it is the reply, or the adapter's echo."""


@dataclass(slots=True)
class ExchangeResult:
    """The end of an exchange, with everything that was received; times on the line's clock."""

    kind: ResultKind
    pdu: bytes = b""
    exception: int = 0
    detail: str = ""
    received: bytes = b""
    strays: list[Piece] = field(default_factory=list)
    """Whole frames that are neither the reply nor an echo."""
    instead: Piece | None = None
    """Over Modbus TCP: the reply of this transaction, if it is not that of its request."""
    resynchronised: bool = False
    """True if the reply was found after or between other bytes."""
    recognized: bool = False
    """True if damaged bytes are certainly the rest of the reply."""
    sent: float = 0.0
    """When the last byte of the request left."""
    end: float = 0.0
    """When the last byte came, or the timeout ended."""
    turnaround: float = 0.0
    """Seconds from the end of the request to the start of its reply."""


@dataclass(slots=True)
class LineContext:
    """Surroundings of a master: its clock, and where it logs and counts."""

    timing: Timing
    trace: Trace
    tally: Tally
    clock: MonotonicClock
    stray: Callable[[Piece, float], None]
    """Called with each whole frame that came when none was due."""


class Master(Protocol):
    """One opened line, one request at a time."""

    echo: bool | None
    """True if the adapter repeats what is sent; None until that is known."""
    failure: LineLost | None
    """Reason if the line can no longer be used."""

    async def quiet(self) -> None:
        """Wait until the next request may be sent. Raises LineLost."""

    async def exchange(self, sending: Sending) -> ExchangeResult:
        """Send a request and await its end. Raises LineLost."""

    async def send_finished(self, data: bytes) -> None:
        """Send a finished frame, await no reply, and leave the line quiet for it."""

    def close(self) -> None:
        """Give the line back."""


def settle(future: asyncio.Future[ExchangeResult] | None, result: ExchangeResult) -> None:
    """Give a result to the caller that waits for it."""
    if future is not None and not future.done():
        future.set_result(result)
