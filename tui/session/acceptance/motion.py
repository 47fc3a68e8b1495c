"""Motions of an acceptance test: each is a guarded run that ends with its motor at standstill.

Whatever ends the test, `MotorRun` brings the motor to rest: a signal, a stop by any program, a lost
line, another commander, a fault, or a step that takes too long.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, TypeVar

from tui.bus.errors import strip_retry_note
from tui.bus.line_events import ControlRequested, DevicesStopped, LineEvent
from tui.drive.chart import Direction
from tui.drive.errors import DriveError
from tui.drive.profile.schema import OrderId

from ..command.stop_report import Phase
from ..console import DriveConsole
from ..fleet import Fleet
from ..monitor.snapshot import Snapshot
from ..running.ending import Ending, MotorStopped, MotorTripped, NotStopped
from ..running.motor_run import MotorRun, RunEvent
from ..running.watching import latest_of, outcome_or_error
from ..work import Permit
from .curve import RunCurve

STOPPED_BY_TEST = "drivepanel accept"
TEST_PERIOD = 0.1
"""Target cycle time in seconds while a test runs."""
FAILED_CYCLES = 2
"""Failed cycles in a row after which the line counts as lost."""
OTHER_REFERENCE_CYCLES = 5
"""Cycles in a row in which the drive holds another reference before the test ends."""
BENCH_POLL_INTERVAL = 0.02
REST_SEEN_WITHIN = 3.0
"""Seconds after a stop within which a cycle shows the motor at rest."""
AT_REST_HERTZ = 0.05

T = TypeVar("T")


class StepFailed(DriveError):
    """A step did not pass."""


class AcceptanceEnded(DriveError):
    """The whole test has ended early."""


@dataclass(frozen=True, slots=True)
class Motion:
    """One run: direction, reference in Hz (None for the present one), longest time in seconds."""

    direction: Direction
    hz: float | None
    at_most: float


@dataclass(slots=True)
class MotionBench:
    """The one motor of a test. All methods run in the loop of the test."""

    fleet: Fleet
    console: DriveConsole
    whole: Ending
    """End of the whole test."""
    say: Callable[[str], None]
    """Reports progress."""
    warn: Callable[[str], None]
    """Reports at once that the motor could not be stopped yet."""
    curve: RunCurve = field(init=False)
    """RunCurve of the last motion."""
    stopped_at: float = field(default=0.0, init=False)
    """When the last motion was stopped (monotonic); 0 while it runs."""
    _own_stop: bool = field(default=False, init=False)
    """True after a stop by a method of the test itself."""
    _polling_paused: bool = field(default=False, init=False)
    _failed_cycles: int = field(default=0, init=False)
    _other_reference: int = field(default=0, init=False)
    """Cycles in a row in which the drive held another reference."""
    _others: str = field(default="", init=False)
    """Why another program ends the test; set in the line's thread."""

    def __post_init__(self) -> None:
        self.curve = RunCurve(self.console.session.profile)

    # End of the whole test

    def check(self) -> None:
        """Raise AcceptanceEnded if the test has ended."""
        if self._others:
            self.whole.end(self._others)
        if self.whole.event.is_set():
            raise AcceptanceEnded(self.whole.why)

    async def unless_ended(self, work: Coroutine[Any, Any, T]) -> T:
        """Do some work with the motor at rest. Raises AcceptanceEnded, which cancels the work."""
        task, end = asyncio.create_task(work), asyncio.create_task(self.whole.event.wait())
        try:
            await asyncio.wait({task, end}, return_when=asyncio.FIRST_COMPLETED)
            if task.done() and not self.whole.event.is_set():
                return task.result()
            self.check()
            return task.result()
        finally:
            end.cancel()
            task.cancel()
            with suppress(BaseException):
                await task

    def permit(self, *, after_end: bool = False) -> Permit:
        """Arm the drive, and return the permission to write. Raises AcceptanceEnded after a stop by
        another source, unless `after_end` allows it."""
        work = self.console.session.work
        # in this order: a stop that is counted before it is reported cannot be overlooked
        stamp = work.stops
        if not after_end:
            self.check()
        work.arm(stamp, float("inf"))
        return work.permit(stamp)

    def disarm(self) -> None:
        """Let nothing through until the next step."""
        self.console.session.arming.disarm()

    # Motions

    async def run(self, motion: Motion, steps: Callable[[], Awaitable[None]]) -> None:
        """Run the motor, carry out some steps while it runs, and bring it to rest.

        Raises StepFailed, MotorStopped, NotStopped, AcceptanceEnded, and the errors of the run
        command.
        """
        self.check()
        self.curve, self.stopped_at = RunCurve(self.console.session.profile), 0.0
        self._own_stop, self._failed_cycles = False, 0
        ending, started = Ending(), asyncio.Event()
        leave = self.console.monitor.listen(self.curve.take)
        run = MotorRun(
            self.fleet,
            self.console,
            ending,
            self,
            by=STOPPED_BY_TEST,
            prepare=self._prepare,
            command=lambda: self._command(motion, started),
            seconds=motion.at_most,
            is_stopped_here=lambda: self._own_stop,
        )
        following = asyncio.create_task(run.carry_out())
        passing_on = asyncio.create_task(self._pass_on(ending))
        working = asyncio.create_task(self._work(started, steps))
        try:
            await asyncio.wait({following, working}, return_when=asyncio.FIRST_COMPLETED)
            if self._own_stop and not working.done():
                # the standstill that the step waits for
                await asyncio.wait({working}, timeout=REST_SEEN_WITHIN)
        finally:
            early = not working.done()
            working.cancel()
            if self._own_stop:
                ending.end("its stop was tested")
            ending.end("the step has ended")
            try:
                await self._rest(following)
                await self._see_rest()
            finally:
                passing_on.cancel()
                leave()
                self.disarm()
        self._raise(following, working, ending, early=early)

    def _raise(
        self,
        following: asyncio.Task[None],
        working: asyncio.Task[None],
        ending: Ending,
        *,
        early: bool,
    ) -> None:
        """Raise what a motion has to report, the worst first."""
        error = following.exception()
        if isinstance(error, NotStopped):
            raise error
        self.check()
        if not early and not working.cancelled() and (failed := working.exception()) is not None:
            raise failed
        # a trip during a stop of the test fails it, too
        own = isinstance(error, MotorStopped) and not isinstance(error, MotorTripped)
        own = own and self._own_stop
        if error is not None and not own:
            raise error
        if early:
            raise StepFailed(f"The step was not completed: it was ended {ending.why}.")

    @staticmethod
    async def _rest(following: asyncio.Task[None]) -> None:
        """Wait for the end of a run, even if this task is cancelled in the meantime."""
        cancelled: asyncio.CancelledError | None = None
        while not following.done():
            try:
                await asyncio.wait({following})
            except asyncio.CancelledError as late:
                cancelled = late
        if cancelled is not None:
            raise cancelled

    async def _see_rest(self) -> None:
        """Wait until a cycle shows the motor at rest, so that the curve is complete."""
        clock = self.console.session.clock
        end = clock.monotonic() + REST_SEEN_WITHIN
        since = clock.monotonic()
        while clock.monotonic() < end:
            latest = latest_of(self.console)
            if latest.time > since and not latest.error:
                return
            await asyncio.sleep(BENCH_POLL_INTERVAL)

    async def _pass_on(self, ending: Ending) -> None:
        await self.whole.event.wait()
        ending.end(self.whole.why)

    async def _work(self, started: asyncio.Event, steps: Callable[[], Awaitable[None]]) -> None:
        await started.wait()
        await steps()

    async def _prepare(self) -> None:
        self.permit()

    async def _command(self, motion: Motion, started: asyncio.Event) -> None:
        reference = None if motion.hz is None else f"{motion.hz:g}Hz"
        self.curve.marks.append((self.console.session.clock.monotonic(), motion.direction))
        commander = self.console.commander
        await outcome_or_error(commander, lambda: commander.run(motion.direction, reference))
        started.set()

    async def refer(self, hz: float) -> None:
        """Change the reference of the running motor. Raises as a command."""
        commander = self.console.commander
        await outcome_or_error(commander, lambda: commander.refer(f"{hz:g}Hz"))

    async def stop_by(self, order: OrderId, within: float) -> float:
        """Stop the motor by a command, and return the seconds to standstill.

        Raises StepFailed if it takes longer than `within`; the ramp stop then follows.
        """
        session = self.console.session
        clock = session.clock
        self._own_stop = True
        self.stopped_at = begun = clock.monotonic()
        self.curve.marks.append((begun, order))
        self.fleet.stop([session], order, by=STOPPED_BY_TEST)
        while clock.monotonic() - begun <= within:
            latest = latest_of(self.console)
            if latest.time > begun and self.at_rest(latest):
                return latest.read_at - begun
            # of a drive that stays enabled at standstill, only the stop itself knows
            report = self.fleet.stopper.reports.get(session.device)
            if report is not None and report.time >= begun and report.phase is Phase.STOPPED:
                return report.since - begun
            await asyncio.sleep(BENCH_POLL_INTERVAL)
        raise StepFailed(f"The motor was not at standstill {within:g} s after {order}.")

    def at_rest(self, latest: Snapshot) -> bool:
        """Return True if a cycle shows that the motor has stopped; a drive that was stopped may
        stay in its quick stop at 0 Hz."""
        if latest.error or latest.state.kind == "running":
            return False
        hertz = self.hertz(latest)
        if hertz is None:
            return latest.state.kind not in ("stopping", "unknown", "starting")
        return abs(hertz) <= AT_REST_HERTZ

    def hertz(self, latest: Snapshot) -> float | None:
        """Return the output frequency of a cycle in Hz, without its sign; None if unknown."""
        parameter = self.console.session.profile.quantity("output_frequency")
        shown = latest.readings.get(parameter.code) if parameter is not None else None
        number = shown.current_number if shown is not None else None
        return None if number is None else abs(number)

    async def sleep(self, seconds: float) -> None:
        """Wait while the motor runs."""
        await asyncio.sleep(seconds)

    # Test of communication loss, which pauses polling

    def pause_watch(self) -> None:
        """Let cycles fail, as polling is paused on purpose."""
        self._polling_paused = True

    def resume_watch(self) -> None:
        """Let failed cycles end the test again."""
        self._polling_paused, self._failed_cycles = False, 0

    # Events of the line, in its thread

    def hear(self, event: LineEvent, end: Callable[[str], None]) -> None:
        """End the test if another program stops or requests the drive; in the line's thread."""
        device = self.console.device
        if isinstance(event, DevicesStopped) and device in event.devices:
            self._others = f"device {device} was stopped by {event.by} ({event.program.text})"
        elif isinstance(event, ControlRequested) and event.device == device:
            self._others = f"{event.program.text} requested device {device}"
        else:
            return
        end(self._others)

    # Reports of a run

    def report(self, event: RunEvent, text: str) -> None:
        """Note the stop, for the curve and its times; at an early end, report the standstill."""
        if event == "stopping" and not self.stopped_at:
            self.stopped_at = self.console.session.clock.monotonic()
            self.curve.marks.append((self.stopped_at, "stop"))
        if event == "stopped" and self.whole.event.is_set():
            self.say(text)

    def show(self, latest: Snapshot, timeout_text: Callable[[], str]) -> None:
        """End the test if the line is lost, or another source commands the drive."""
        if self._polling_paused:
            return
        if latest.error:
            self._failed_cycles += 1
            if self._failed_cycles >= FAILED_CYCLES:
                self.whole.end(f"the line was lost: {strip_retry_note(latest.error)}")
            return
        self._failed_cycles = 0
        if self._own_stop:
            return
        device = self.console.device
        if lost := self.console.commander.given.lost_orders():
            self.whole.end(f"device {device}: {lost}")
        elif latest.state.local:
            self.whole.end(f"device {device} is commanded at its terminals or keypad")
        elif other := self.console.session.line.facts.commander(device):
            self.whole.end(f"{other.text} commands device {device}")
        elif self._is_other_reference():
            self.whole.end(f"another source changed the reference of device {device}")

    def _is_other_reference(self) -> bool:
        """Return True if the drive holds another reference for several cycles: a reference of this
        test is noted only after it was read back."""
        wanted = self.console.commander.given.wanted
        if wanted is None:
            return False
        held = self.console.session.image.raws.get(wanted.parameter.code, wanted.raw)
        self._other_reference = self._other_reference + 1 if held != wanted.raw else 0
        return self._other_reference >= OTHER_REFERENCE_CYCLES
