"""The calls to one drive, which `Drive` waits for and `AsyncDrive` awaits, and its cycles."""

from __future__ import annotations

import asyncio
import logging
import math
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime

from tui.bus.api import ModbusLine
from tui.drive.chart import Direction
from tui.drive.errors import DriveError

from ..arming import NotArmed
from ..command.stop_report import StopSummary
from ..console import DriveConsole
from ..drive import DriveSession
from ..fleet import Fleet
from ..monitor.monitor import Monitor
from ..monitor.snapshot import Snapshot, as_read
from ..read.reader import Reader
from ..reading import reading_of
from ..running.ending import NotStopped
from ..settings.apply import apply_edits
from ..settings.eeprom import save_to_eeprom
from ..settings.typed import stage_typed
from ..settings.wear import WearGate, agreed
from ..work import Permit
from .guarded_run import GuardedRun, GuardedRuns
from .values import DriveValue, NotWritten, Sample, value_from

log = logging.getLogger(__name__)

SHORTEST_CYCLE, LONGEST_CYCLE = 0.05, 86400.0
"""Seconds of a cycle of `Drive.watch`."""
SAMPLES_WAITING = 64
"""Cycles kept for a script that is slower than the line; older ones are dropped."""


class SampleFeed:
    """Watches a drive until it is closed. Raises DriveError for an impossible cycle time."""

    def __init__(self, session: DriveSession, named: Mapping[str, str], every: float) -> None:
        """`named` maps each code, as requested, to the drive's own."""
        if not SHORTEST_CYCLE <= every <= LONGEST_CYCLE:
            raise DriveError(f"every={every} is not a cycle time. Use 0.05 to 86400 seconds.")
        self._session = session
        self._named = named
        self._waiting: deque[Snapshot] = deque(maxlen=SAMPLES_WAITING)
        self._arrived = asyncio.Event()
        self._since = -math.inf
        self._monitor = Monitor(session)
        self._monitor.listen(self._take)
        self._monitor.start(list(named.values()), every)

    async def next(self) -> Sample:
        """Wait for the next cycle; runs in the line's loop."""
        while not self._waiting:
            self._arrived.clear()
            await self._arrived.wait()
        snapshot = self._waiting.popleft()
        sample = self._sample(snapshot)
        self._since = snapshot.time
        return sample

    def close(self) -> None:
        """Stop watching; any thread may call."""
        self._monitor.stop()

    def _take(self, snapshot: Snapshot) -> None:
        self._waiting.append(snapshot)
        self._arrived.set()

    def _sample(self, snapshot: Snapshot) -> Sample:
        profile, clock = self._session.profile, self._session.clock
        cycle = as_read(profile, list(dict.fromkeys(self._named.values())), snapshot, self._since)
        values = {
            requested: value_from(reading_of(cycle.readings[code]), clock)
            for requested, code in self._named.items()
        }
        time = datetime.fromtimestamp(snapshot.wall, UTC)
        return Sample(time, values, cycle.state.headline, snapshot.error)


STANDS_WITHIN = 120.0
"""Seconds in which a motor must reach standstill after a stop."""


class DriveCalls:
    """One drive of an open line. Coroutines run in the line's loop, the rest in any thread."""

    def __init__(self, console: DriveConsole, fleet: Fleet, runs: GuardedRuns) -> None:
        self.session = console.session
        self.fleet = fleet
        self._console = console
        self._runs = runs

    @property
    def line(self) -> ModbusLine:
        """The line of the drive."""
        return self.session.line

    def named(self, codes: tuple[str, ...]) -> dict[str, str]:
        """The drive's own code for each spelling. Raises DriveError for an unknown one."""
        return {code: self.session.profile.find(code).code for code in codes}

    async def read(self, named: Mapping[str, str]) -> dict[str, DriveValue]:
        """Read current values, by code as requested; one that the drive refuses has no value."""
        found = await Reader(self.session).read(list(named.values()))
        clock = self.session.clock
        return {requested: value_from(found[code], clock) for requested, code in named.items()}

    def watch(self, codes: tuple[str, ...], every: float) -> SampleFeed:
        """Watch values, a cycle each `every` seconds."""
        return SampleFeed(self.session, self.named(codes), every)

    @contextmanager
    def armed(self) -> Iterator[None]:
        """Let the block write to this drive; a stop ends that. Raises DriveError."""
        self.session.arming.arm(seconds=math.inf)
        try:
            yield
        finally:
            self.session.arming.disarm()

    def permit(self, does: str = "Write") -> Permit:
        """The right to write from now on. Raises NotArmed, which says what to do when armed."""
        if not self.session.arming.armed:
            why = self.session.arming.why_disarmed or "Not armed."
            raise NotArmed(f"{why} {does} inside `with drive.armed():`.")
        return self.session.work.permit()

    async def write(
        self, values: Mapping[str, object], permit: Permit, *, rounded: bool, often: bool
    ) -> dict[str, str]:
        """Write settings, each read back; the results by code. Raises as `Drive.write`."""
        typed = [(self.session.profile.find(code).code, str(v)) for code, v in values.items()]
        if len({code for code, _ in typed}) < len(typed):
            raise DriveError("One parameter is given more than once. Which value is meant?")
        edits, _ = await stage_typed(self.session, typed, rounded=rounded)
        journal = self.fleet.journal
        gate = self._gate(often=often)
        done = await apply_edits(
            self.session, journal, edits, permit=permit, why="script", gate=gate
        )
        if missed := {r.edit.code: r.text for r in done.results if not r.done}:
            raise NotWritten(missed)
        return {result.edit.code: result.text for result in done.results}

    async def save(self, permit: Permit, *, often: bool) -> str:
        """Keep the settings in the drive's EEPROM; returns what was done."""
        gate = self._gate(often=often)
        return await save_to_eeprom(self.session, self.fleet.journal, permit, gate)

    def _gate(self, *, often: bool) -> WearGate:
        ask = agreed if often else None
        way = "Pass often=True to write it anyway."
        return WearGate(self.fleet.journal.eeprom, ask=ask, warn=log.warning, way=way)

    def run(self, direction: Direction, reference: str | None) -> GuardedRun:
        """Prepare a run of the motor; nothing is sent before it begins."""
        return GuardedRun(self._runs, self.fleet, self._console, direction, reference)

    def order_stop(self) -> None:
        """Order the ramp stop; no loop is waited for. Raises LineClosed."""
        self._runs.end(self.session.device, "stopped by the script")
        self.fleet.stop([self.session], by="a script")

    @staticmethod
    def stop_text(summary: StopSummary) -> str:
        """The result of a stop. Raises NotStopped unless the motor is at standstill."""
        if summary.failed or not summary.ended:
            raise NotStopped(summary.text)
        return summary.text
