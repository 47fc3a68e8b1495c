"""The cycles of a monitor that the process which holds the line reads for it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tui.bus.api import Priority
from tui.bus.errors import RequestRefused
from tui.bus.poll_plan import (
    MOST_READS,
    PlannedTurn,
    PollCarrier,
    PolledTurn,
    PollPlan,
    Subscription,
)

from ..drive import DriveSession
from ..read.reader import Reader
from ..read.rotation import Rotation
from ..reading import Reading

PATIENCE, PATIENCE_CYCLES = 5.0, 3
"""Seconds, and cycles, without one from there after which the drive is read from here again."""

LONGEST_STEADY = 10.0
"""Seconds of a period up to which cycles are read there: the way between costs longer ones nothing,
and from here each can be left out at the last moment."""

Turns = tuple[tuple[str, ...], ...]
"""The seldom values of each cycle, until all had their turn."""


@dataclass(frozen=True, slots=True)
class SteadyPlan:
    """Reads of steady cycles."""

    fast: tuple[str, ...]
    seldom: tuple[str, ...]
    period: float


class SteadyCycles:
    """Has the line's holder read a drive while each cycle is like the one before.

    A program that holds its line itself reads from here: nothing is between. Lives in the line's
    loop.
    """

    def __init__(self, session: DriveSession, reader: Reader) -> None:
        self._line = session.line
        self._device = session.device
        self._clock = session.clock
        self._reader = reader
        self._of: SteadyPlan | None = None
        self._turns: Turns = ()
        self._reads: Sequence[PlannedTurn] = ()
        self._shift = self._next = 0
        """The turn with which the subscription has begun, and the one after the last that came."""
        self._subscription: Subscription | None = None
        self._unfit = False
        """True if this plan is not one to be carried out there."""
        self.came: PolledTurn | None = None
        """The cycle that has come; None if this one is to be read from here."""

    def turn(self, due: Rotation, seldom: tuple[str, ...]) -> tuple[str, ...]:
        """The seldom values of the present cycle."""
        if self.came is None or due.owes:
            return due.turn(seldom, self._reader.groups)
        index = (self.came.turn + self._shift) % len(self._turns)
        self._next = index + 1
        return due.set_turn(self._turns[index])

    async def read(self, codes: Iterable[str]) -> dict[str, Reading]:
        """The readings of the present cycle; what did not come from there is read from here."""
        self._reader.polled = self.came
        try:
            return await self._reader.read(codes, priority=Priority.POLL)
        finally:
            self._reader.polled = None

    @property
    def begun(self) -> float:
        """When the present cycle begins, or was begun (monotonic)."""
        came = self.came
        return self._clock.monotonic() if came is None else self._clock.line_time(came.begun)

    def ended(self, readings: Iterable[Reading]) -> float:
        """When the present cycle ended: with its last reply, if that was read there (monotonic)."""
        if self.came is None:
            return self._clock.monotonic()
        times = (reading.time for reading in readings)
        return max((self._clock.line_time(self.came.ended), *times))

    async def next(self, plan: SteadyPlan, due: Rotation, at: float) -> bool:
        """Wait for a cycle from there; False if the next one is to be read from here then."""
        last, self.came = self.came, None
        if (carrier := self._line.pace.carrier) is None:
            self.end()
            return False
        if self._unfit and plan == self._of:
            return False
        stays = self._subscription is not None and not self._subscription.ended
        if not stays or plan != self._of or (last is not None and last.differs):
            self._follow(carrier, plan, due.turns(plan.seldom, self._reader.groups), at)
        if self._subscription is None:
            return False
        wait = max(PATIENCE, PATIENCE_CYCLES * plan.period * self._line.pace.stretch)
        self.came = await self._subscription.next(wait)
        if self.came is None:
            self.end()
        return self.came is not None

    def _follow(self, carrier: PollCarrier, plan: SteadyPlan, turns: Turns, at: float) -> None:
        """Have this plan carried out there, if it is not yet."""
        reads = [self._reader.planned((*plan.fast, *turn)) for turn in turns]
        shift = self._next % len(turns)
        subscription, before = self._subscription, self._of
        self._of, self._turns = plan, turns
        same = before is not None and (reads, plan.period) == (self._reads, before.period)
        if same and subscription is not None and not subscription.ended:
            return
        self.end()
        fits = plan.period <= LONGEST_STEADY and all(0 < len(read) <= MOST_READS for read in reads)
        self._unfit = not fits
        if not fits:
            return
        self._reads, self._shift = reads, shift
        # the seldom values go on with the turn after the last one
        wanted = PollPlan(self._device, (*reads[shift:], *reads[:shift]), plan.period, at)
        try:
            self._subscription = carrier.subscribe(wanted)
        except RequestRefused:
            self._unfit = True  # each read tells why

    def end(self) -> None:
        """Have nothing read there any more."""
        self.came = None
        if self._subscription is not None:
            self._subscription.end()
            self._subscription = None
