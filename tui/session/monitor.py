"""Watching one drive from the line's own loop, whatever the screen does.

The monitor keeps the latest snapshot; a screen takes it when it likes. Nothing is queued for
a screen, so a terminal that is not read costs the drive nothing.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from tui.bus.errors import LineError
from tui.bus.line import Line, LineState, Priority, Worker
from tui.drive.chart import watched_codes
from tui.drive.errors import DriveError
from tui.drive.profile import Profile
from tui.drive.schema import Quantity

from .drive_state import DriveState, drive_state
from .reader import Reader
from .readings import Reading

STALE_CYCLES = 3
"""Cycles after which a value is no longer taken for the present one."""
SLOW_FACTOR = 10
"""Cycles of the fast values to one of the slow ones."""
TREND_SECONDS = 300.0
TREND_QUANTITIES: tuple[Quantity, ...] = ("output_frequency", "motor_current")
SHORTEST_PERIOD = 0.05


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All values of one cycle, or the last ones with the error of a cycle that failed."""

    cycle: int
    time: float
    """When it was taken, time.monotonic()."""
    wall: float
    """The same as time.time()."""
    readings: Mapping[str, Reading]
    state: DriveState
    rate: float
    """Cycles a second that the line holds; 0 while nothing answers."""
    error: str
    """Why this cycle brought nothing, or empty."""
    line: LineState


@dataclass(frozen=True, slots=True)
class TrendPoint:
    """Values of TREND_QUANTITIES at a time; None where there was none to be trusted."""

    time: float
    values: tuple[float | None, ...]


Listener = Callable[[Snapshot], None]


class Monitor:
    """Polls the monitoring set of one drive in a worker of the line's loop."""

    def __init__(self, line: Line, device: int, profile: Profile) -> None:
        self.line = line
        self.device = device
        self.profile = profile
        self.period = 0.5
        """Wished time of a cycle in seconds; read anew at each."""
        self.reader = Reader(line, device, profile)
        self._latest: Snapshot | None = None
        self._trend: deque[TrendPoint] = deque()
        self._listeners: tuple[Listener, ...] = ()
        self._worker: Worker | None = None
        trend = (profile.quantity(quantity) for quantity in TREND_QUANTITIES)
        self._trend_codes = [parameter.code if parameter else None for parameter in trend]

    @property
    def latest(self) -> Snapshot | None:
        """The last snapshot, or None before the first cycle ended."""
        return self._latest

    @property
    def trend(self) -> tuple[TrendPoint, ...]:
        """The trend of the last minutes, oldest first."""
        return tuple(self._trend)

    @property
    def running(self) -> bool:
        """Whether the worker is at work."""
        return self._worker is not None and not self._worker.done()

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call a function with every snapshot, in the line's thread; returns the way out."""
        self._listeners = (*self._listeners, listener)

        def leave() -> None:
            self._listeners = tuple(one for one in self._listeners if one is not listener)

        return leave

    def start(
        self,
        codes: Sequence[str] | None = None,
        period: float = 0.5,
        *,
        extra: Sequence[str] = (),
    ) -> None:
        """Watch these codes, by default the profile's monitoring set.

        `extra` are read as seldom as the slow values: histories, inputs, hours. `period` is the
        wished time of a cycle in seconds.
        """
        self.stop()
        self.period = period
        fast, slow = self._rates(codes)
        slow += [code for code in extra if code not in fast and code not in slow]
        self._worker = self.line.spawn(
            lambda: self._watch(fast, slow), f"monitor {self.profile.id} {self.device}"
        )

    def stop(self) -> None:
        """Stop watching; an exchange in flight ends by itself."""
        if self._worker is not None:
            self._worker.cancel()
            self._worker = None

    def _rates(self, codes: Sequence[str] | None) -> tuple[list[str], list[str]]:
        """Codes of every cycle and those read less often."""
        if codes is not None:
            return list(dict.fromkeys(codes)), []
        values = self.profile.data.monitoring.values
        slow = [value.parameter for value in values if value.rate == "slow"]
        return [c for c in monitoring_codes(self.profile) if c not in slow], slow

    async def _watch(self, fast: list[str], slow: list[str]) -> None:
        readings: dict[str, Reading] = {}
        slow_due = 0.0
        spent = 0.0
        cycle = 0
        while True:
            started = time.monotonic()
            cycle += 1
            due = [*fast, *slow] if started >= slow_due else fast
            error = ""
            try:
                readings.update(await self.reader.read(due or slow, priority=Priority.POLL))
            except (LineError, DriveError) as fault:
                error = str(fault)
                self.reader.forget()  # what answers next may be another drive
            else:
                spent = time.monotonic() - started
                if due is not fast:
                    slow_due = started + SLOW_FACTOR * self.period
            self._publish(cycle, readings, set(slow), max(spent, self.period), error)
            await asyncio.sleep(self._rest(started))

    def _rest(self, started: float) -> float:
        """Time to the next cycle; one that came late is skipped, never caught up."""
        period = max(self.period, SHORTEST_PERIOD)
        return period - (time.monotonic() - started) % period

    def _publish(
        self,
        cycle: int,
        readings: Mapping[str, Reading],
        slow: set[str],
        span: float,
        error: str,
    ) -> None:
        now = time.monotonic()
        limit = STALE_CYCLES * span
        aged = {
            code: reading.aged(now, limit * SLOW_FACTOR if code in slow else limit)
            for code, reading in readings.items()
        }
        snapshot = Snapshot(
            cycle=cycle,
            time=now,
            wall=time.time(),
            readings=aged,
            state=drive_state(self.profile, aged),
            rate=0.0 if error else 1.0 / span,
            error=error,
            line=self.line.state,
        )
        self._latest = snapshot
        self._add_to_trend(snapshot)
        for listener in self._listeners:
            listener(snapshot)

    def _add_to_trend(self, snapshot: Snapshot) -> None:
        """A failed cycle leaves a gap in the trend, never a repeated value."""
        readings = snapshot.readings
        values = tuple(
            readings[code].number if code and code in readings and not snapshot.error else None
            for code in self._trend_codes
        )
        self._trend.append(TrendPoint(snapshot.time, values))
        while self._trend[0].time < snapshot.time - TREND_SECONDS:
            self._trend.popleft()


def monitoring_codes(profile: Profile) -> list[str]:
    """Codes of a profile's monitoring set with the words that tell its state and fault."""
    codes = [value.parameter for value in profile.data.monitoring.values]
    codes += watched_codes(profile)
    if profile.data.faults.parameter:
        codes.append(profile.data.faults.parameter)
    return list(dict.fromkeys(codes))
