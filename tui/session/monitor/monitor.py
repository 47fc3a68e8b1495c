"""Cyclic polls of one drive in the line's own loop, independent of the screens.

The monitor keeps only the latest snapshot, and a screen reads it when it draws. Nothing is queued
for a screen, so a blocked terminal does not delay the polls.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from tui.bus.api import Contact, LineWorker, Priority, contact_of
from tui.bus.errors import LineClosed, LineError, LineLost
from tui.drive.errors import DriveError
from tui.drive.orders import deciding_codes
from tui.safety import SHARED_AGE

from ..drive import DriveSession
from ..drive_state import drive_state
from ..read.reader import Reader
from ..read.rotation import Rotation
from ..reading import Reading
from ..shown import Quality
from .block_notes import BlockNotes
from .rates import SLOW_FACTOR, Rates, bad_readings, codes_of_state, rates_of
from .snapshot import Snapshot, stale_after
from .steady_cycles import SteadyCycles, SteadyPlan
from .trend import (
    Trend,
    TrendCycle,
    TrendNotes,
    TrendPoint,
)

log = logging.getLogger(__name__)

SHORTEST_PERIOD = 0.05
CONTACT_MADE: Contact = "answers"
RESET_NEAR = frozenset({"fault", "starting", "unknown"})
"""Kinds of state in or after which a drive may be reset, even without a lost reply."""
FORGOTTEN_AFTER = 3
"""Failed cycles in a row after which another drive may answer."""
RESTART_AFTER = 1.0
"""Seconds after which a monitor that failed by an internal error restarts."""
RATE_OVER = 6
"""Cycles over which the rate is measured."""

Listener = Callable[[Snapshot], None]


class PollHeldBack(DriveError):
    """A drive is not polled on purpose; the text gives the reason."""


class Monitor:
    """Polls the monitoring set of one drive in a worker of the line's loop."""

    def __init__(self, session: DriveSession) -> None:
        self.session = session
        self.line = session.line
        self.device = session.device
        self.profile = session.profile
        self.period = 0.5
        """Target cycle time in seconds; a change applies from the next cycle on."""
        self.pause_reason: Callable[[], str] = lambda: ""
        """Returns why the drive must not be polled now; empty to poll it.

        Called before each cycle, in the line's thread.
        """
        self.freely: Callable[[], bool] = lambda: True
        """Returns True if the keeper may read cycles without a call of `pause_reason` for each."""
        self.reader = Reader(session)
        self.steady = SteadyCycles(session, self.reader)
        self.restarts = 0
        """Number of restarts after an internal error."""
        self._latest: Snapshot | None = None
        self._using = ""
        self._kind = "unknown"
        """Kind of the last state read."""
        self.was = ""
        """Headline of the last known state; empty before the first."""
        self._block_notes = BlockNotes(session, self.reader)
        self._all_due = True
        self._full_reads_done = 0
        self._learn_due = True
        self._trend = Trend(session.profile)
        self._notes = TrendNotes(session.line.facts, session.device, self._trend)
        self._listeners: tuple[Listener, ...] = ()
        self._started: Rates | None = None
        """Rates of `start`; None after `stop`."""
        self._also: tuple[tuple[str, ...], ...] = ()
        """Codes of each `also_read` that has not ended."""
        self._worker: LineWorker | None = None

    @property
    def latest(self) -> Snapshot | None:
        """The last snapshot; None until the first cycle ends."""
        return self._latest

    @property
    def trend(self) -> tuple[TrendPoint, ...]:
        """The trend of the last minutes, oldest first."""
        return self._trend.points

    @property
    def last_point(self) -> TrendPoint | None:
        """The newest point of the trend; None without any."""
        return self._trend.last

    def add_to_trend(self, cycle: TrendCycle) -> None:
        """Add a cycle, or a check between the cycles, to the trend. In the line's thread."""
        self._notes.ask()
        self._notes.add(self._trend.add(cycle))

    def recall(self, earlier: Trend) -> None:
        """Continue the trend of a record; not while a worker adds to it."""
        self._trend.resume(earlier)

    @property
    def running(self) -> bool:
        """True while it polls, by `start` or `also_read`, unless the line has ended the worker."""
        return self._worker is not None and not self._worker.done()

    @property
    def started(self) -> bool:
        """True from `start` to `stop`, unless the line has ended the worker."""
        return self._started is not None and self.running

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call a function with every snapshot, in the line's thread.

        Returns a function that ends this.
        """
        self._listeners = (*self._listeners, listener)

        def leave() -> None:
            self._listeners = tuple(
                function for function in self._listeners if function is not listener
            )

        return leave

    def start(
        self,
        codes: Sequence[str] | None = None,
        period: float = 0.5,
        *,
        extra: Sequence[str] = (),
    ) -> None:
        """Poll these codes (default: the profile's monitoring set).

        `extra` codes are read at the slow rate: histories, inputs, hours. `period` is the target
        cycle time in seconds.
        """
        self.period = period
        rates = rates_of(self.profile) if codes is None else Rates(tuple(dict.fromkeys(codes)))
        known = {*rates.fast, *rates.changing, *rates.slow}
        more = tuple(code for code in dict.fromkeys(extra) if code not in known)
        if codes is None:
            more += tuple(c for c in deciding_codes(self.profile) if c not in {*known, *more})
        self._started = replace(rates, slow=rates.slow + more)
        self._begin()

    def also_read(self, codes: Sequence[str], period: float) -> Callable[[], None]:
        """Read these codes in each cycle, also while the monitor is not started.

        Without `start` it polls them with the state of the drive and the values of its trend, each
        `period` seconds. Returns a function that ends this.
        """
        also = tuple(codes)
        if self._started is None:
            self.period = period
        self._also = (*self._also, also)
        self._begin()

        def end() -> None:
            if any(item is also for item in self._also):
                self._also = tuple(item for item in self._also if item is not also)
                self._begin()

        return end

    def stop(self) -> None:
        """Stop polling, except for `also_read`; does not wait for an exchange in progress."""
        self._started = None
        self._begin()

    def close(self) -> None:
        """Stop polling."""
        self._also = ()
        self.stop()

    def _begin(self) -> None:
        """Poll by the present rates from now on; stop if there are none."""
        if self._worker is not None:
            self._worker.cancel()
            self._worker = None
        self._notes.end()
        if self._started is None and not self._also:
            return
        self._notes.ask()
        self.session.note_profile()  # with the scales that were learned since
        rates = self._started or Rates(codes_of_state(self.profile))
        rates = rates.with_fast([code for codes in self._also for code in codes])
        self._worker = self.line.spawn(
            lambda: self._keep_watching(rates), f"monitor {self.profile.id} {self.device}"
        )

    async def _keep_watching(self, rates: Rates) -> None:
        """Poll until cancelled; report an internal error and restart after it."""
        while True:
            try:
                await self._watch(rates)
            except Exception as error:
                log.exception("watching device %s failed", self.device)
                self.restarts += 1
                reported = f"Watching failed ({type(error).__name__}: {error}) and restarts."
                self._tell_failure(reported)
                await self.session.clock.sleep(RESTART_AFTER)

    def _tell_failure(self, text: str) -> None:
        """Publish the last values with their age, and the reason why there are no new ones."""
        if (latest := self._latest) is None:
            return
        clock = self.session.clock
        now = clock.monotonic()
        snapshot = replace(latest, time=now, wall=clock.wall_of(now), rate=0.0, error=text)
        self._latest = snapshot
        self._hand_out(snapshot)

    def _hand_out(self, snapshot: Snapshot) -> None:
        """Pass a snapshot to every listener; an error in one does not affect the others."""
        for listener in self._listeners:
            try:
                listener(snapshot)
            except Exception:
                log.exception("a listener to device %s failed", self.device)

    async def _watch(self, rates: Rates) -> None:
        readings: dict[str, Reading] = {}
        begun: deque[float] = deque(maxlen=RATE_OVER)
        due = Rotation(SLOW_FACTOR)
        self._all_due = True
        self.reader.also = frozenset(rates.seldom)
        cycle = failures = 0
        try:
            self.steady.begin_recorded((*rates.fast, *rates.seldom))
            while True:
                started = self.steady.begun
                cycle += 1
                error, contact = "", CONTACT_MADE
                period = self._period(rates)
                self.reader.max_age = period * SHARED_AGE
                if self._all_due or self._full_reads_done != self.session.full_reads_requested:
                    self._full_reads_done = self.session.full_reads_requested
                    self._all_due, self._learn_due = False, True
                    due.add(rates.seldom)
                try:
                    if why := self.pause_reason():
                        raise PollHeldBack(why)
                    seldom = (*rates.seldom, *self.session.followed)
                    turn = self.steady.turn(due, seldom)
                    readings.update(await self._cycle(rates, readings, turn))
                except (LineError, DriveError) as fault:
                    self.steady.end()
                    error, contact = str(fault), contact_of(fault)
                    failures += 1
                    if contact == "swapped":
                        now = self.session.clock.monotonic()
                        readings = bad_readings(self.profile, rates, now, error)
                    else:  # it may have failed since before this monitor began
                        readings = {**self.reader.known((*rates.fast, *rates.seldom)), **readings}
                    begun.clear()
                    due.failed(self.reader.groups)
                    if self._may_be_another(fault, failures):
                        self.reader.forget()
                        self._all_due = True
                else:
                    failures = 0
                    due.came()
                    begun.append(started)
                # other monitors may have claimed their share of the line during the cycle
                period = self._period(rates)
                self._publish(cycle, readings, rates, _span(begun, period), error, contact)
                if not error:
                    await self._learn(cycle)
                    self._block_notes.note(used=bool(self._using))
                begin = (self.session.clock.monotonic() if error else started) + period
                codes = (*rates.fast, *rates.seldom)
                goes_on = await self.steady.next_recorded(codes, begin, period)
                if goes_on or (not error and await self._goes_on(rates, due, begin)):
                    continue
                self.steady.end()
                await self.session.clock.sleep(max(0.0, begin - self.session.clock.monotonic()))
        finally:
            self.steady.end()
            self.line.pace.release(self)

    async def _goes_on(self, rates: Rates, due: Rotation, at: float) -> bool:
        """Wait for the keeper's next cycle; return False if this program must read it."""
        if due.owes or not self.freely():
            return False
        seldom = (*rates.seldom, *self.session.followed)
        plan = SteadyPlan(rates.fast, seldom, max(self.period, SHORTEST_PERIOD))
        return await self.steady.next(plan, due, at)

    def _period(self, rates: Rates) -> float:
        """Return the target cycle time in seconds; longer if the line cannot keep it for all."""
        cost = self.reader.seconds(rates.fast)
        cost += self.reader.seconds(rates.seldom) / SLOW_FACTOR
        return self.line.pace.claim(self, self.device, cost, max(self.period, SHORTEST_PERIOD))

    def _may_be_another(self, fault: Exception, failures: int) -> bool:
        """Return True if another drive may answer, or this one was reset, after a failed cycle."""
        if failures >= FORGOTTEN_AFTER or isinstance(fault, LineLost | LineClosed):
            return True
        return self._kind in RESET_NEAR

    async def _learn(self, cycle: int) -> None:
        """Learn or compare the slots of the drive's block; the next cycle retries a failure."""
        with suppress(LineError, DriveError):
            if self._learn_due or cycle % SLOW_FACTOR == 0:
                self._learn_due = True
                await self.reader.learn_slots()
                self._learn_due = False
            else:
                await self.reader.compare_slots()

    async def _cycle(
        self, rates: Rates, before: Mapping[str, Reading], turn: tuple[str, ...]
    ) -> dict[str, Reading]:
        """Read the values of one cycle, and the details of the state if it has changed."""
        codes, received = (*rates.fast, *turn), self.steady.received
        found = await self.reader.read(codes, priority=Priority.POLL, polled=received)
        self._using = self.reader.using
        if set(rates.changing) <= set(turn):
            return found
        now = drive_state(self.profile, found)
        same = all(code in before and found[code].raw == before[code].raw for code in rates.key)
        if not same or now.alarm or now.kind == "fault":
            found |= await self.reader.read(rates.changing, priority=Priority.POLL)
        return found

    def _publish(
        self,
        cycle: int,
        readings: Mapping[str, Reading],
        rates: Rates,
        span: float,
        error: str,
        contact: Contact,
    ) -> None:
        now = self.steady.ended(readings.values())
        aged = {
            code: reading.aged(now, stale_after(span, often=code in rates.fast))
            for code, reading in readings.items()
        }
        bad = [item.quality is Quality.BAD for item in aged.values()]
        snapshot = Snapshot(
            cycle=cycle,
            time=now,
            wall=self.session.clock.wall_of(now),
            readings=aged,
            state=drive_state(self.profile, aged),
            rate=0.0 if error else 1.0 / span,
            error=error,
            line=self.line.state,
            block=self._using,
            period=span,
            wished=max(self.period, SHORTEST_PERIOD),
            contact="refused" if bad and all(bad) and not error else contact,
        )
        if not error and snapshot.state.kind != self._kind:
            self._kind = snapshot.state.kind
            self.reader.compare_soon()
        if not error and snapshot.state.kind != "unknown":
            self.was = snapshot.state.headline
        if snapshot.state.kind in RESET_NEAR:
            self.reader.distrust()
        self._latest = snapshot
        self.add_to_trend(snapshot)
        self._hand_out(snapshot)


def _span(begun: Sequence[float], period: float) -> float:
    """Return the measured seconds from one cycle to the next; `period` at least."""
    if len(begun) < 2:
        return period
    return max(period, (begun[-1] - begun[0]) / (len(begun) - 1))
