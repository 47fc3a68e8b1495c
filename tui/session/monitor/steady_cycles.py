"""Cycles of a monitor that the keeper of the line reads for it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from tui.bus.errors import RequestRefused
from tui.bus.poll_plan import (
    MOST_READS,
    PlannedRead,
    PlannedTurn,
    PollCarrier,
    PolledTurn,
    PollPlan,
    Subscription,
)

from ..drive import DriveSession
from ..read.decoded import sources_of
from ..read.reader import Reader
from ..read.rotation import Rotation
from ..reading import Reading

PATIENCE, PATIENCE_CYCLES = 5.0, 3
"""Seconds, and cycles, to wait for the keeper's next cycle before this program reads the drive."""

LONGEST_STEADY = 10.0
"""Longest period in seconds of cycles that the keeper reads. For longer periods, one message per
request costs little, and this program can skip a cycle at the last moment."""

Turns = tuple[tuple[str, ...], ...]
"""Slow values by cycle; all turns together read each of them once."""


@dataclass(frozen=True, slots=True)
class SteadyPlan:
    """Codes to read in steady cycles; `period` in seconds."""

    fast: tuple[str, ...]
    seldom: tuple[str, ...]
    period: float


class CycleSource(Protocol):
    """Cycles of a record, for a replay."""

    async def next(self, reads: Sequence[PlannedRead], at: float, period: float) -> PolledTurn:
        """Wait for the end of the next cycle of these reads; it is due `at` a time."""

    def last(self, reads: Sequence[PlannedRead]) -> PolledTurn | None:
        """Return the cycle of these reads that ended last; None if that is too long ago."""


class SteadyCycles:
    """Has the keeper read a drive while the cycles stay the same.

    Without a keeper, the program reads the drive itself. For the line's loop only.
    """

    def __init__(self, session: DriveSession, reader: Reader) -> None:
        self._line = session.line
        self._device = session.device
        self._clock = session.clock
        self._reader = reader
        self._plan: SteadyPlan | None = None
        self._turns: Turns = ()
        self._reads: Sequence[PlannedTurn] = ()
        self._shift = self._next = 0
        """First turn of the subscription, and the turn after the last one received."""
        self._subscription: Subscription | None = None
        self._unfit = False
        """True if the keeper cannot carry out this plan."""
        self.recorded: CycleSource | None = None
        """Cycles of a replay, each with all its values; None on a live line."""
        self.received: PolledTurn | None = None
        """The cycle received from the keeper; None if this program reads the cycle."""

    def turn(self, due: Rotation, seldom: tuple[str, ...]) -> tuple[str, ...]:
        """Return the slow values of the current cycle."""
        if self.recorded is not None:
            return due.set_turn(seldom)  # as they were read then, whatever their rate
        if self.received is None or due.owes:
            return due.turn(seldom, self._reader.groups)
        index = (self.received.turn + self._shift) % len(self._turns)
        self._next = index + 1
        return due.set_turn(self._turns[index])

    @property
    def begun(self) -> float:
        """Start of the current cycle, in seconds of the monotonic clock."""
        cycle = self.received
        return self._clock.monotonic() if cycle is None else self._clock.line_time(cycle.begun)

    def ended(self, readings: Iterable[Reading]) -> float:
        """End of the current cycle: with its last reply, if the keeper read it (monotonic)."""
        if self.received is None:
            return self._clock.monotonic()
        times = (reading.time for reading in readings)
        return max((self._clock.line_time(self.received.ended), *times))

    async def next_recorded(self, codes: Iterable[str], at: float, period: float) -> bool:
        """Wait for the next cycle of a record; return False on a live line."""
        if self.recorded is None:
            return False
        self.received = await self.recorded.next(self._reads_of(codes), at, period)
        return True

    def begin_recorded(self, codes: Iterable[str]) -> None:
        """Begin with the last cycle of a record, if this is a replay."""
        if self.recorded is not None:
            self.received = self.recorded.last(self._reads_of(codes))

    def _reads_of(self, codes: Iterable[str]) -> tuple[PlannedRead, ...]:
        """Return the reads of these codes, with those that set their scales."""
        profile, known = self._reader.profile, tuple(codes)
        sources = (source for code in known for source in sources_of(profile[code]))
        return self._reader.planned((*known, *sources))

    async def next(self, plan: SteadyPlan, due: Rotation, at: float) -> bool:
        """Wait for the keeper's next cycle; return False if this program must read it."""
        last, self.received = self.received, None
        if (carrier := self._line.pace.carrier) is None:
            self.end()
            return False
        if self._unfit and plan == self._plan:
            return False
        stays = self._subscription is not None and not self._subscription.ended
        if not stays or plan != self._plan or (last is not None and last.differs):
            self._follow(carrier, plan, due.turns(plan.seldom, self._reader.groups), at)
        if self._subscription is None:
            return False
        wait = max(PATIENCE, PATIENCE_CYCLES * plan.period * self._line.pace.stretch)
        self.received = await self._subscription.next(wait)
        if self.received is None:
            self.end()
        return self.received is not None

    def _follow(self, carrier: PollCarrier, plan: SteadyPlan, turns: Turns, at: float) -> None:
        """Subscribe to this plan at the keeper, unless it carries it out already."""
        reads = [self._reader.planned((*plan.fast, *turn)) for turn in turns]
        shift = self._next % len(turns)
        subscription, before = self._subscription, self._plan
        self._plan, self._turns = plan, turns
        same = before is not None and (reads, plan.period) == (self._reads, before.period)
        if same and subscription is not None and not subscription.ended:
            return
        self.end()
        fits = plan.period <= LONGEST_STEADY and all(0 < len(read) <= MOST_READS for read in reads)
        self._unfit = not fits
        if not fits:
            return
        self._reads, self._shift = reads, shift
        # slow values continue with the turn after the last one, so that none is read twice
        wanted = PollPlan(self._device, (*reads[shift:], *reads[:shift]), plan.period, at)
        try:
            self._subscription = carrier.subscribe(wanted)
        except RequestRefused:
            self._unfit = True  # a read of this program reports the reason

    def end(self) -> None:
        """End the subscription, if there is one."""
        self.received = None
        if self._subscription is not None:
            self._subscription.end()
            self._subscription = None
