"""Cycles of a monitor that the process which holds the line reads for it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import suppress

import pytest

from tests.waiting import until
from tui.bus.errors import LineError, NoAnswer, RequestRefused
from tui.bus.model import Reply
from tui.bus.poll_plan import PlannedRead, PolledTurn, PollPlan, Subscription
from tui.session.drive import DriveSession
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.rates import SLOW_FACTOR
from tui.session.monitor.snapshot import Snapshot
from tui.session.monitor.steady_cycles import LONGEST_STEADY
from tui.session.shown import Quality

from .fakes import OneDrive, parameter, profile_of

SPEED, OTHER, FIRST_SLOW = 20, 30, 1000
SLOW = 20
PATIENCE = 20.0

PROFILE = profile_of(
    parameter("SPEED", SPEED),
    parameter("OTHER", OTHER),
    *(parameter(f"SLOW{i}", FIRST_SLOW + 100 * i) for i in range(SLOW)),
    monitoring={
        "values": [
            {"parameter": "SPEED"},
            {"parameter": "OTHER"},
            *({"parameter": f"SLOW{i}", "rate": "slow"} for i in range(SLOW)),
        ]
    },
)


class Holder:
    """The process that holds the line: gives cycles when a test says so."""

    def __init__(self, line: OneDrive) -> None:
        self.line = line
        self.plans: list[PollPlan] = []
        self.ended = 0
        self.refuses = False
        self.answers = True
        self.errors: dict[int, LineError] = {}
        """Replies to reads that begin at an address."""
        self.without: set[int] = set()
        self.age = 0.0
        self._turn = 0
        self._subscription: Subscription | None = None

    def subscribe(self, plan: PollPlan) -> Subscription | None:
        if self.refuses:
            raise RequestRefused("beyond the limits")
        if not self.answers:
            return None
        self.plans.append(plan)
        self._turn = 0
        self._subscription = Subscription(plan, self._leave)
        return self._subscription

    def _leave(self) -> None:
        self.ended += 1
        self._subscription = None

    @property
    def polls(self) -> bool:
        return self._subscription is not None

    def give(self) -> None:
        """Give the next cycle."""
        assert self._subscription is not None
        turn = self._turn % len(self._subscription.plan.turns)
        self._turn += 1
        begun = time.monotonic() - self.age
        replies: dict[PlannedRead, Reply | LineError] = {}
        for read in self._subscription.plan.turns[turn]:
            if read.address in self.errors:
                replies[read] = self.errors[read.address]
                break
            if read.address not in self.without:
                words = self.line.devices[1].held(read.address, read.count)
                replies[read] = Reply(words, begun)
        self._subscription.hear(PolledTurn(turn, begun, replies))

    def lose(self) -> None:
        """End as a process that is killed."""
        lost, self._subscription = self._subscription, None
        assert lost is not None
        lost.lose()


class Steady:
    """A monitor with a holder of its line."""

    def __init__(self) -> None:
        registers = {FIRST_SLOW + 100 * i: i for i in range(SLOW)}
        self.line = OneDrive({SPEED: 500, OTHER: 7, **registers})
        self.holder = Holder(self.line)
        self.line.pace.carrier = self.holder
        self.session = DriveSession(self.line, 1, PROFILE)
        self.monitor = Monitor(self.session)
        self.snapshots: list[Snapshot] = []
        self.monitor.listen(self.snapshots.append)

    async def until(self, holds: Callable[[], bool]) -> None:
        await until(holds, PATIENCE)

    async def start(self, period: float = 0.01) -> None:
        self.monitor.start(period=period)
        await self.until(lambda: self.holder.polls)

    async def cycle(self) -> Snapshot:
        """Send a cycle, and return the snapshot of the monitor."""
        count = len(self.snapshots)
        self.line.requests.clear()
        self.holder.give()
        await self.until(lambda: len(self.snapshots) > count)
        return self.snapshots[count]


@pytest.fixture
async def steady() -> AsyncIterator[Steady]:
    made = Steady()
    yield made
    made.monitor.stop()
    for task in asyncio.all_tasks() - {asyncio.current_task()}:
        with suppress(asyncio.CancelledError):
            await task


async def test_steady_cycle_sends_no_request_and_returns_values_in_turn(steady: Steady) -> None:
    await steady.start()
    first = steady.snapshots[-1]
    assert first.readings["SLOW3"].raw == 3  # all is read from here first
    (plan,) = steady.holder.plans
    assert (plan.device, len(plan.turns), plan.period) == (1, SLOW_FACTOR, 0.05)
    for number in range(SLOW_FACTOR):
        steady.line.devices[1].words[SPEED] = 600 + number
        steady.line.devices[1].words.update({FIRST_SLOW + 100 * i: 50 + i for i in range(SLOW)})
        snapshot = await steady.cycle()
        assert snapshot.readings["SPEED"].raw == 600 + number
        assert snapshot.readings["SPEED"].quality is Quality.GOOD
        assert steady.line.requested == []
        assert not snapshot.error
    found = steady.snapshots[-1].readings
    assert [found[f"SLOW{i}"].raw for i in range(SLOW)] == [50 + i for i in range(SLOW)]
    assert len(steady.holder.plans) == 1


async def test_values_have_their_time_on_the_wire(steady: Steady) -> None:
    await steady.start()
    for _ in range(3):
        await steady.cycle()
    await asyncio.sleep(0.2)
    steady.holder.age = 0.1
    snapshot = await steady.cycle()
    reading = snapshot.readings["SPEED"]
    assert time.monotonic() - reading.time >= 0.1
    # it does not answer a command given in between
    assert snapshot.time == reading.time


async def test_value_written_in_the_meantime_is_read_again(steady: Steady) -> None:
    await steady.start()
    await steady.cycle()
    await asyncio.sleep(0.15)
    steady.session.image.doubt("SPEED")
    steady.holder.age = 0.1
    steady.line.devices[1].words[SPEED] = 900
    snapshot = await steady.cycle()
    assert snapshot.readings["SPEED"].raw == 900
    assert (SPEED, 1) in steady.line.requested
    assert snapshot.readings["SPEED"].time > snapshot.readings["OTHER"].time


async def test_missing_values_of_a_cycle_are_read_directly(steady: Steady) -> None:
    await steady.start()
    steady.holder.without = {OTHER}
    snapshot = await steady.cycle()
    assert not snapshot.error
    assert steady.line.requested == [(OTHER, 1)]
    # the plan is the same: nothing is to be changed about it
    assert len(steady.holder.plans) == 1


async def test_drive_is_read_directly_after_an_error_until_complete(
    steady: Steady,
) -> None:
    await steady.start()
    await steady.cycle()
    steady.holder.errors, steady.holder.age = {SPEED: NoAnswer(1, 3, SPEED)}, 0.1
    given = time.monotonic()
    snapshot = await steady.cycle()
    assert snapshot.time >= given
    assert (snapshot.contact, snapshot.rate) == ("silent", 0.0)
    assert "did not answer" in snapshot.error
    assert not steady.holder.polls
    await steady.until(lambda: steady.holder.polls)
    assert not steady.snapshots[-1].error
    assert (SPEED, 1) in steady.line.requested
    # the slow values go on where they were
    before, after = steady.holder.plans
    assert after.turns == (*before.turns[2:], *before.turns[:2])


async def test_full_read_is_sent_directly(steady: Steady) -> None:
    await steady.start()
    await steady.cycle()
    steady.session.request_full_read()
    await steady.cycle()
    brought = {turn.address for turn in steady.holder.plans[0].turns[1]}
    direct = {address for address, _ in steady.line.requested}
    assert direct == {FIRST_SLOW + 100 * i for i in range(SLOW)} - brought
    await steady.cycle()
    assert steady.line.requested == []
    assert len(steady.holder.plans) == 1


async def test_changed_period_or_values_make_a_new_plan(steady: Steady) -> None:
    await steady.start()
    await steady.cycle()
    steady.monitor.period = 0.25
    await steady.cycle()
    await steady.until(lambda: len(steady.holder.plans) == 2)
    assert steady.holder.plans[-1].period == 0.25
    steady.session.followed = ("SLOW0",)
    await steady.cycle()
    assert len(steady.holder.plans) == 2  # it is among them already
    refused = steady.line.devices[1].words
    del refused[FIRST_SLOW]
    steady.session.request_full_read()
    await steady.cycle()
    await steady.until(lambda: len(steady.holder.plans) == 3)
    planned = {read.address for turn in steady.holder.plans[-1].turns for read in turn}
    assert FIRST_SLOW not in planned
    assert steady.holder.ended == 2


async def test_drive_is_read_directly_if_the_holder_is_gone(steady: Steady) -> None:
    await steady.start()
    await steady.cycle()
    steady.holder.answers = False
    steady.line.requests.clear()
    steady.holder.lose()
    count = len(steady.snapshots)
    await steady.until(lambda: len(steady.snapshots) > count + 2)
    assert (SPEED, 1) in steady.line.requested
    assert not steady.snapshots[-1].error
    steady.holder.answers = True
    await steady.until(lambda: steady.holder.polls)
    await steady.cycle()


async def test_refused_plan_is_not_submitted_again(steady: Steady) -> None:
    steady.holder.refuses = True
    steady.monitor.start(period=0.01)
    await steady.until(lambda: len(steady.snapshots) > 3)
    steady.holder.refuses = False
    await steady.until(lambda: len(steady.snapshots) > 6)
    assert steady.holder.plans == []
    assert not steady.snapshots[-1].error


async def test_drive_paused_at_times_is_read_directly(steady: Steady) -> None:
    steady.monitor.freely = lambda: False
    steady.monitor.start(period=0.01)
    await steady.until(lambda: len(steady.snapshots) > 3)
    assert steady.holder.plans == []
    steady.monitor.freely = lambda: True
    await steady.until(lambda: steady.holder.polls)
    steady.monitor.pause_reason = lambda: "left alone"
    snapshot = await steady.cycle()
    assert (snapshot.error, snapshot.contact) == ("left alone", "not_polled")
    assert not steady.holder.polls


async def test_end_of_watching_ends_the_plan(steady: Steady) -> None:
    await steady.start()
    steady.monitor.stop()
    await steady.until(lambda: not steady.holder.polls)


async def test_rarely_read_drive_is_read_directly(steady: Steady) -> None:
    steady.monitor.start(period=LONGEST_STEADY + 1.0)
    await steady.until(lambda: len(steady.snapshots) == 1)
    await asyncio.sleep(0)
    assert steady.holder.plans == []


async def test_single_program_submits_no_plan(steady: Steady) -> None:
    steady.line.pace.carrier = None
    steady.monitor.start(period=0.01)
    await steady.until(lambda: len(steady.snapshots) > 3)
    assert steady.holder.plans == []
