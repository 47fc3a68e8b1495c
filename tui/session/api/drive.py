"""One drive for a script: read, watched, written to, stopped."""

from __future__ import annotations

import math
import queue
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime

from tui.bus.errors import LineClosed
from tui.drive.errors import DriveError

from ..arming import NotArmed
from ..drive import DriveSession
from ..fleet import Fleet
from ..monitor.cycle import as_read
from ..monitor.monitor import Monitor
from ..monitor.snapshot import Snapshot
from ..read.reader import Reader
from ..reading import Reading
from ..settings.apply import apply_edits
from ..settings.eeprom import save_to_eeprom
from ..settings.typed import stage_typed
from ..work import Permit
from .values import DriveValue, NotStopped, NotWritten, Sample, value_from
from .work import LOOK_WHETHER_OPEN, waited

STANDS_WITHIN = 120.0
"""Seconds in which a motor must reach standstill after a stop."""
SHORTEST_CYCLE, LONGEST_CYCLE = 0.05, 86400.0
"""Seconds of a cycle of `Drive.watch`."""
SAMPLES_WAITING = 64
"""Cycles kept for a script that is slower than the line; older ones are dropped."""


class Drive:
    """One drive of an open line."""

    def __init__(self, session: DriveSession, fleet: Fleet) -> None:
        self._session = session
        self._fleet = fleet

    @property
    def address(self) -> int:
        """Its slave address."""
        return self._session.device

    @property
    def profile(self) -> str:
        """The id of its profile."""
        return self._session.profile.id

    @property
    def reference(self) -> str:
        """Reference that it reports; empty if none."""
        return self._session.known_identity.reference

    def read(self, *codes: str) -> dict[str, DriveValue]:
        """Present values, by code as requested; one that the drive refuses has no value."""
        named = self._named(codes)
        found = waited(self._session.line, lambda: Reader(self._session).read(list(named.values())))
        return {requested: self._value(found[code]) for requested, code in named.items()}

    def watch(self, *codes: str, every: float = 1.0) -> Iterator[Sample]:
        """Cycle after cycle, `every` so many seconds, until the script takes no more.

        A value is good if it was read in that very cycle. Raises DriveError for a cycle time that
        is not a number from 0.05 s to a day.
        """
        if not SHORTEST_CYCLE <= every <= LONGEST_CYCLE:
            raise DriveError(f"every={every} is not a cycle time. Use 0.05 to 86400 seconds.")
        named = self._named(codes)
        waiting: queue.Queue[Snapshot] = queue.Queue(SAMPLES_WAITING)

        def take(snapshot: Snapshot) -> None:
            with suppress(queue.Empty):
                while waiting.full():
                    waiting.get_nowait()
            waiting.put(snapshot)

        monitor = Monitor(self._session)
        monitor.listen(take)
        monitor.start(list(named.values()), every)
        since = -math.inf
        try:
            while True:
                try:
                    snapshot = waiting.get(timeout=LOOK_WHETHER_OPEN)
                except queue.Empty:
                    if not monitor.running:
                        raise LineClosed from None
                    continue
                yield self._sample(named, snapshot, since)
                since = snapshot.time
        finally:
            monitor.stop()

    @contextmanager
    def armed(self) -> Iterator[None]:
        """Let the block write to this drive; a stop ends that. Raises DriveError."""
        self._session.arming.arm(seconds=math.inf)
        try:
            yield
        finally:
            self._session.arming.disarm()

    def write(self, values: Mapping[str, object], *, rounded: bool = False) -> dict[str, str]:
        """Write settings, each read back: numbers in the parameter's unit, or as they are typed.

        Returns the results, by code. Raises NotWritten where one was not, WouldRound where the
        drive can hold only another value and `rounded` is not given, and other DriveErrors.
        """
        permit = self._permit()
        typed = [(self._session.profile.find(code).code, str(v)) for code, v in values.items()]
        if len({code for code, _ in typed}) < len(typed):
            raise DriveError("One parameter is given more than once. Which value is meant?")

        async def work() -> dict[str, str]:
            edits, _ = await stage_typed(self._session, typed, rounded=rounded)
            journal = self._fleet.journal
            done = await apply_edits(self._session, journal, edits, permit=permit, why="script")
            if missed := {r.edit.code: r.text for r in done.results if not r.done}:
                raise NotWritten(missed)
            return {result.edit.code: result.text for result in done.results}

        return waited(self._session.line, work)

    def save(self) -> str:
        """Keep the settings in the drive's EEPROM; armed. Returns what was done."""
        permit = self._permit()
        session, journal = self._session, self._fleet.journal
        return waited(session.line, lambda: save_to_eeprom(session, journal, permit))

    def stop(self) -> str:
        """Stop the motor on its ramp and wait for standstill; needs no arming.

        Raises NotStopped if it does not reach standstill.
        """
        self._fleet.stop([self._session], by="a script")
        summary = self._fleet.stopper.wait([self._session], STANDS_WITHIN)
        if summary.failed or not summary.ended:
            raise NotStopped(summary.text)
        return summary.text

    def _permit(self) -> Permit:
        if not self._session.arming.armed:
            why = self._session.arming.why_disarmed or "Not armed."
            raise NotArmed(f"{why} Write inside `with drive.armed():`.")
        return self._session.work.permit()

    def _named(self, codes: tuple[str, ...]) -> dict[str, str]:
        return {code: self._session.profile.find(code).code for code in codes}

    def _sample(self, named: Mapping[str, str], snapshot: Snapshot, since: float) -> Sample:
        profile = self._session.profile
        now = as_read(profile, list(dict.fromkeys(named.values())), snapshot, since)
        values = {requested: self._value(now.readings[code]) for requested, code in named.items()}
        time = datetime.fromtimestamp(snapshot.wall, UTC)
        return Sample(time, values, now.state.headline, snapshot.error)

    def _value(self, reading: Reading) -> DriveValue:
        return value_from(reading, self._session.clock)
