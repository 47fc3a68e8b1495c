"""Interface that sends a request and waits for its reply, over any kind of line."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from .errors import LineLost
from .expectation import Expectation
from .model import Timing
from .result import ExchangeResult, Piece
from .tally import Tally
from .trace import Trace

MonotonicClock = Callable[[], float]


@dataclass(frozen=True, slots=True)
class Sending:
    """One request on its way: what it is and what counts as its answer.

    `expectation` None is a broadcast. See RtuExchange for `sure` and `skip`.
    """

    device: int
    pdu: bytes
    expectation: Expectation | None
    time_out: float
    sure: bool = True
    skip: int = 0
    look: Callable[[], None] = lambda: None
    """Called last before the first byte; raises where it must not go out any more."""


@dataclass(slots=True)
class LineContext:
    """Place for the log of a master."""

    timing: Timing
    trace: Trace
    tally: Tally
    clock: MonotonicClock
    stray: Callable[[Piece, float], None]
    """Told of every whole frame that came when none was due."""


class Master(Protocol):
    """One opened line, one request at a time."""

    echo: bool | None
    """True if the adapter repeats what is sent, None while not known."""
    failure: LineLost | None
    """Why the line cannot be used any more."""

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
