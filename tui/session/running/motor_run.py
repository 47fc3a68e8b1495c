"""One motor from its run command to its standstill, for a command or a script."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Literal, Protocol

from tui.bus.errors import LineError
from tui.safety import STATE_FRESH

from ..command.stop_report import Phase
from ..console import DriveConsole
from ..fleet import Fleet
from ..journal import Entry
from ..monitor.snapshot import Snapshot
from ..monitor.timeout import polling_stop_text
from ..reading import with_text
from ..timeout_report import TimeoutWatch
from .ending import Ending, MotorStopped, MotorTripped, NotStopped
from .watching import latest_of, learned_timeout

RUN_POLL_INTERVAL = 0.05
CYCLES_AT_REST = 2
"""Cycles in a row that show a motor at rest before it counts as stopped on its own."""
UNNAMED_SOURCE = "another source"
FAULT_NAMED_WITHIN = 1.0
"""Seconds after a trip in which the monitor reads the name of the fault."""
STOPS_THAT_MAY_FAIL = 2
"""Stops that may fail on a line without trouble before the motor is reported as running."""

RunEvent = Literal["control", "reference", "order", "ended", "stopping", "stopped", "left-running"]


class RunObserver(Protocol):
    """Shows the progress of a run; called in the loop of the run."""

    def report(self, event: RunEvent, text: str) -> None:
        """Report an event."""

    def show(self, latest: Snapshot, timeout_text: Callable[[], str]) -> None:
        """Show a cycle; `timeout_text` gives what happens to the motor when polling stops."""

    def warn(self, text: str) -> None:
        """Report at once that the motor could not be stopped yet."""


@dataclass(slots=True)
class MotorRun:
    """One motor from its run command to its stop, in any loop."""

    fleet: Fleet
    console: DriveConsole
    ending: Ending
    observer: RunObserver
    by: str
    """Program that stops the motor at the end, for the journal and other programs."""
    prepare: Callable[[], Awaitable[None]]
    """Prepares the run command: arms the drive and takes control."""
    command: Callable[[], Awaitable[None]]
    """Sends the run command and waits until the motor runs."""
    seconds: float | None = None
    """The duration; None for no limit."""
    leave_running: bool = False
    is_stopped_here: Callable[[], bool] = lambda: False
    """Returns True if this program has given a stop of its own: no other program did."""
    watch: TimeoutWatch | None = field(default=None, init=False)
    """The drive's communication timeout, once it is known."""
    _commanding: bool = field(default=False, init=False)
    """True if the run command is on its way, so that it may be sent at any time."""
    _earlier: tuple[Entry, ...] = field(init=False)
    _stops: int = field(init=False)
    _has_ended: bool = field(default=False, init=False)
    """True if it was reported that the motor stopped on its own."""
    _warned: bool = field(default=False, init=False)
    """True if it was reported that the motor does not stop."""

    def __post_init__(self) -> None:
        self._earlier = self.fleet.journal.sent
        self._stops = self.console.session.work.stops

    async def carry_out(self) -> None:
        """Run the motor until the end; then stop it, even after an error, or leave it running.

        Raises MotorStopped if it stopped on its own, and NotStopped. Returns after standstill.
        """
        left, stopped = False, ""
        try:
            if await self._started():
                stopped = await self._follow()
                left = self.leave_running
        finally:
            if self.may_turn and not left:
                await self._bring_to_rest()
        if left:
            self.observer.report("left-running", self._timeout_text())
        elif stopped:
            raise MotorStopped(
                f"Device {self.console.device} was stopped by {stopped} before the end."
            )

    @property
    def may_turn(self) -> bool:
        """True if a command of this run was sent, answered or not; a reference moves nothing."""
        earlier = set(map(id, self._earlier))
        return self._commanding or any(
            entry.device == self.console.device and not entry.why.startswith("reference")
            for entry in self.fleet.journal.sent
            if id(entry) not in earlier
        )

    def _timeout_text(self) -> str:
        """Return the drive's reaction if polling stops."""
        return polling_stop_text(self.console.session, watch=self.watch)

    async def _started(self) -> bool:
        """Send the run command; return False if the end came first."""
        if self.ending.event.is_set():
            return False
        start = asyncio.create_task(self._start())
        end = asyncio.create_task(self.ending.event.wait())
        try:
            await asyncio.wait({start, end}, return_when=asyncio.FIRST_COMPLETED)
            if start.done():
                await start
            return start.done()
        finally:
            start.cancel()
            end.cancel()

    async def _start(self) -> None:
        self.watch = await learned_timeout(self.fleet, self.console)
        await self.prepare()
        self._commanding = True
        try:
            await self.command()
        except Exception:
            self._commanding = False
            raise
        self._commanding = False

    async def _follow(self) -> str:
        """Show the motor until the end; raises MotorStopped if it stops on its own.

        Returns the source of a stop before the end, if its standstill was not seen yet.
        """
        begun = time.monotonic()
        seen, rest = 0, 0
        while True:
            latest = latest_of(self.console)
            if other := self.console.session.contradiction:
                stopped = MotorStopped(f"The run has ended: another drive answers. {other}")
                self.observer.report("ended", str(stopped))
                raise stopped
            if latest.cycle != seen and latest.time > begun:
                seen = latest.cycle
                self.observer.show(latest, self._timeout_text)
                rest = rest + 1 if self._at_rest(latest) else 0
            ended = self.ending.event.is_set()
            if rest >= CYCLES_AT_REST or (rest and ended and latest.state.fault):
                with suppress(LineError):
                    await self.console.read(self.console.session.followed)
                stopped = self._stopped_on_its_own(latest)
                self._has_ended = True
                self.observer.report("ended", str(stopped))
                raise stopped
            if ended:
                return self._stop_of_others()
            if self.seconds is not None and time.monotonic() - begun >= self.seconds:
                self.ending.end(f"after {self.seconds:g} s")
            with suppress(TimeoutError):
                await asyncio.wait_for(self.ending.event.wait(), RUN_POLL_INTERVAL)

    def _stop_of_others(self) -> str:
        """Name the source of a stop since the run began; empty for none or one of this program."""
        work = self.console.session.work
        is_other = work.stops > self._stops and not self.is_stopped_here()
        return (work.stopped_by or UNNAMED_SOURCE) if is_other else ""

    def _at_rest(self, latest: Snapshot) -> bool:
        """Return True if the motor is not running; a drive may stay in its quick stop at 0 Hz."""
        if latest.error:
            return False
        kind = latest.state.kind
        at_zero = kind == "stopping" and self._frequency(latest) == 0
        return at_zero or kind in ("fault", "stopped", "ready", "blocked")

    def _frequency(self, latest: Snapshot) -> float | None:
        """Return the output frequency in Hz; None if unknown."""
        frequency = self.console.session.profile.quantity("output_frequency")
        reading = with_text(latest.readings).get(frequency.code) if frequency else None
        return reading.number if reading is not None else None

    def _stopped_on_its_own(self, latest: Snapshot) -> MotorStopped:
        """Return the error with the reason why the motor no longer runs."""
        if latest.state.fault:
            return self._tripped(latest)
        text = "It was stopped by the drive or by another source."
        if by_others := self._stop_of_others():
            text = f"It was stopped by {by_others}."
        elif lost := self.console.commander.given.changed_words():
            text = f"It was stopped by another program or master on the line: {lost}."
        elif latest.state.local:
            text = "It was stopped at its terminals or keypad."
        state = latest.state.headline
        return MotorStopped(f"Device {self.console.device} no longer runs: {state}. {text}")

    def _tripped(self, latest: Snapshot) -> MotorTripped:
        """Return the error of a trip, with its fault if that is known."""
        fault = latest.state.fault
        named = f"{fault.code}, {fault.name}" if fault else latest.state.headline
        return MotorTripped(
            f"Device {self.console.device} tripped: {named}. Check the machine, remove the cause,"
            " then reset the fault."
        )

    async def _bring_to_rest(self) -> None:
        """Stop the motor and wait for standstill; on a lost line, as soon as it is connected again.

        Raises NotStopped if the drive answers and does not stop.
        """
        session, stopper, failed = self.console.session, self.fleet.stopper, 0
        why = self.ending.why or "the run has ended"
        self.observer.report("stopping", f"stopping ({why})")
        while True:
            ordered = time.monotonic()
            stopper.stop([session], by=self.by)
            while not (await stopper.ended([session], RUN_POLL_INTERVAL)).ended:
                if stopper.reports[session.device].phase is Phase.UNHEEDED:
                    self._warn()
            report = stopper.reports[session.device]
            if report.phase is Phase.STOPPED:
                await self._check_trip()
                self.observer.report("stopped", f"Device {session.device}: stopped.")
                return
            bad = await self._line_was_bad(ordered)
            if self._stands():
                await self._check_trip()
                self.observer.report("stopped", f"Device {session.device} is at standstill.")
                return
            # a ramp may take longer than a stop is monitored
            if not bad and latest_of(self.console).state.kind != "stopping":
                failed += 1
            if failed == STOPS_THAT_MAY_FAIL:
                raise NotStopped(f"Device {session.device}: {report.text}")

    async def _check_trip(self) -> None:
        """Raise MotorTripped if the drive tripped while it was stopped.

        The stop has just read the state; the name of the fault comes with the next cycle.
        """
        if self._has_ended or self.console.session.state(STATE_FRESH).kind != "fault":
            return
        since, latest = time.monotonic(), latest_of(self.console)
        while latest.state.fault is None and time.monotonic() - since < FAULT_NAMED_WITHIN:
            await asyncio.sleep(RUN_POLL_INTERVAL)
            latest = latest_of(self.console)
        tripped = self._tripped(latest)
        self.observer.report("ended", str(tripped))
        raise tripped

    def _warn(self) -> None:
        """Report once that a silent drive was not stopped yet, and what happens now."""
        error = latest_of(self.console).error
        if error and not self._warned:
            self._warned = True
            self.observer.warn(
                f"NOT STOPPED yet: {error}\n{self._timeout_text()} The motor is stopped as soon as"
                " the drive answers. Until then, stop it at the machine."
            )

    def _stands(self) -> bool:
        """Return True if the motor is at standstill, even if the drive did not accept the stop."""
        latest = latest_of(self.console)
        enabled = latest.state.motion == "running"
        return self._at_rest(latest) and not enabled and self._frequency(latest) == 0

    async def _line_was_bad(self, since: float) -> bool:
        """Wait until the drive answers; return True if it failed to answer since a time."""
        requested, bad = time.monotonic(), False
        while True:
            latest = latest_of(self.console)
            if latest.error and latest.time > since:
                bad = True
                self._warn()
            elif not latest.error and latest.time > requested:
                self._warned = False
                return bad
            await asyncio.sleep(RUN_POLL_INTERVAL)
