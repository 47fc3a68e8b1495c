"""Reads of one device that the process which holds the line repeats for a program."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Annotated, Literal, Protocol

import msgspec
from msgspec import Meta

from .bounds import MonotonicTime, RegisterAddress
from .errors import LineError
from .model import Reply

MOST_TURNS, MOST_READS = 16, 250
"""Turns of a plan, and reads of one turn."""
SHORTEST_PERIOD, LONGEST_PERIOD = 0.05, 60.0
"""Bounds of a plan's period in seconds; slower reads need no plan."""
USUAL_TURNAROUND = 0.005
"""Turnaround of a device in seconds, until it is measured."""


class PlannedRead(msgspec.Struct, frozen=True, array_like=True):
    """One read of registers, or by another function of coils, inputs or input registers."""

    address: RegisterAddress
    count: Annotated[int, Meta(ge=1, le=125)]
    function: Literal[1, 2, 3, 4] = 3


PlannedTurn = Annotated[tuple[PlannedRead, ...], Meta(min_length=1, max_length=MOST_READS)]


class PollPlan(msgspec.Struct, frozen=True):
    """Cycles of reads of one device: a turn in each period, one turn after the other."""

    device: Annotated[int, Meta(ge=1, le=255)]
    turns: Annotated[tuple[PlannedTurn, ...], Meta(min_length=1, max_length=MOST_TURNS)]
    period: Annotated[float, Meta(ge=SHORTEST_PERIOD, le=LONGEST_PERIOD)]
    """Seconds from one cycle to the next; longer on a full line."""
    begin: MonotonicTime
    """When the first cycle begins."""

    @property
    def rates(self) -> dict[PlannedRead, float]:
        """Rate of each read per second."""
        each = 1.0 / (self.period * len(self.turns))
        found: dict[PlannedRead, float] = {}
        for turn in self.turns:
            for read in turn:
                found[read] = found.get(read, 0.0) + each
        return found


class PolledTurn:
    """The replies of one cycle, each taken once."""

    def __init__(
        self, turn: int, begun: float, replies: Mapping[PlannedRead, Reply | LineError]
    ) -> None:
        self.turn, self.begun = turn, begun
        self._left = dict(replies)
        self._missed = False
        times = (reply.time for reply in replies.values() if isinstance(reply, Reply))
        self.ended = max(times, default=begun)
        """The time of the last reply."""
        self.block: int | None = None
        """In a replay, the register from which it read values of a block; None without one."""

    @property
    def differs(self) -> bool:
        """True if the reads that were wanted are not those of the plan."""
        return self._missed or bool(self._left)

    def take(self, read: PlannedRead, after: float) -> Reply | None:
        """The reply to a read if it is newer than `after`; raises the error of a failed read."""
        if read not in self._left:
            self._missed = True
            return None
        found = self._left.pop(read)
        if isinstance(found, LineError):
            raise found
        return found if found.time > after else None

    def take_more(self, read: PlannedRead) -> Reply | None:
        """The reply to a read beyond the plan, as `take`; None if the program must send it."""
        return None


class Subscription:
    """One plan that the holder of the line carries out; used in the line's loop.

    If cycles arrive faster than they are used, only the last one counts.
    """

    def __init__(self, plan: PollPlan, leave: Callable[[], None]) -> None:
        self.plan = plan
        self.ended = False
        self._leave = leave
        self._latest: PolledTurn | None = None
        self._moved = asyncio.Event()

    async def next(self, within: float) -> PolledTurn | None:
        """The next cycle; None if the plan has ended, or if none comes within so many seconds."""
        if self._latest is None and not self.ended:
            with suppress(TimeoutError):
                async with asyncio.timeout(within):
                    await self._moved.wait()
        self._moved.clear()
        found, self._latest = self._latest, None
        return found

    def hear(self, turn: PolledTurn) -> None:
        """Take the cycle that has arrived."""
        self._latest = turn
        self._moved.set()

    def lose(self) -> None:
        """End the plan: the process that carries it out has exited, or does not answer."""
        self.ended = True
        self._moved.set()

    def end(self) -> None:
        """Cancel the plan."""
        if not self.ended:
            self.lose()
            self._leave()


class PollCarrier(Protocol):
    """Carries plans to the process that holds the line."""

    def subscribe(self, plan: PollPlan) -> Subscription | None:
        """Have a plan carried out; None if that process does not answer.

        Raises RequestRefused for a plan beyond the limits of its device.
        """
