"""The one owner of a line: queues requests, sends them one at a time, hands back the replies."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine, Sequence
from typing import Any

from .limits import Limits
from .link import Link
from .model import (
    Counters,
    DeviceState,
    Identification,
    LineState,
    LineStatus,
    Priority,
    Reply,
    Timing,
)
from .trace import Frame

__all__ = [
    "Counters",
    "DeviceState",
    "Frame",
    "Identification",
    "Line",
    "LineState",
    "LineStatus",
    "Priority",
    "Reply",
    "Timing",
    "Worker",
]


class Worker:
    """A coroutine at work in the line's loop."""

    name: str
    error: BaseException | None

    def cancel(self) -> None:
        """Ask the work to end; may be called from any thread."""
        raise NotImplementedError

    def done(self) -> bool:
        """Whether the work has ended, by itself, by cancel() or by an error."""
        raise NotImplementedError


class Line:
    """A line shared by everything that talks to its devices."""

    def __init__(
        self,
        link: Link,
        *,
        read_only: bool = False,
        timing: Timing | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.link = link
        self.read_only = read_only

    def open(self, *, wait: float | None = None) -> None:
        raise NotImplementedError

    def close(self) -> None:
        raise NotImplementedError

    @property
    def state(self) -> LineState:
        raise NotImplementedError

    @property
    def counters(self) -> Counters:
        raise NotImplementedError

    @property
    def trace(self) -> tuple[Frame, ...]:
        raise NotImplementedError

    def describe(self, device: int, limits: Limits) -> None:
        raise NotImplementedError

    def device_state(self, device: int) -> DeviceState:
        raise NotImplementedError

    async def read(
        self, device: int, address: int, count: int = 1, *, priority: Priority = Priority.POLL
    ) -> Reply:
        raise NotImplementedError

    async def write(
        self,
        device: int,
        address: int,
        values: Sequence[int],
        *,
        priority: Priority = Priority.OPERATOR_WRITE,
        multiple: bool | None = None,
    ) -> float:
        raise NotImplementedError

    async def read_write(
        self,
        device: int,
        read_address: int,
        count: int,
        write_address: int,
        values: Sequence[int],
        *,
        priority: Priority = Priority.OPERATOR_WRITE,
    ) -> Reply:
        raise NotImplementedError

    async def diagnose(
        self,
        device: int,
        subfunction: int,
        data: int = 0,
        *,
        priority: Priority = Priority.OPERATOR_READ,
    ) -> int:
        raise NotImplementedError

    async def identify(
        self, device: int, *, priority: Priority = Priority.OPERATOR_READ
    ) -> Identification:
        raise NotImplementedError

    async def broadcast(
        self,
        address: int,
        values: Sequence[int],
        *,
        limits: Limits,
        priority: Priority = Priority.OPERATOR_WRITE,
    ) -> float:
        raise NotImplementedError

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> Worker:
        raise NotImplementedError

    def on_state(self, listener: Callable[[LineState], None]) -> Callable[[], None]:
        raise NotImplementedError
