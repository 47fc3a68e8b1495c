"""The run of a motor for a block of a script, at work in the line's loop."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable
from contextlib import suppress

from tui.bus.api import LineWorker
from tui.bus.errors import LineClosed
from tui.drive.chart import Direction
from tui.drive.errors import DriveError

from ..command.stop_report import not_stopped
from ..console import DriveConsole
from ..fleet import Fleet
from ..monitor.snapshot import Snapshot
from ..running.ending import Ending, NotStopped
from ..running.motor_run import MotorRun, RunEvent
from ..running.watching import WATCH_PERIOD, first_cycle, outcome_or_error
from ..work import Permit

log = logging.getLogger(__name__)


class GuardedRuns:
    """The runs of a line that go on, by device; one for each drive."""

    def __init__(self) -> None:
        self._runs: dict[int, GuardedRun] = {}

    def add(self, run: GuardedRun) -> None:
        """Raise DriveError if the motor already runs for a block of this script."""
        if self._runs.setdefault(run.device, run) is not run:
            raise DriveError(f"Device {run.device}: another block of this script runs its motor.")

    def remove(self, run: GuardedRun) -> None:
        """Forget a run that is over."""
        if self._runs.get(run.device) is run:
            del self._runs[run.device]

    def end(self, device: int, why: str) -> None:
        """The script itself stops a drive: end its run, which then reports no stop by others."""
        if (run := self._runs.get(device)) is not None:
            run.end(why, stopped_here=True)

    def close(self, within: float) -> None:
        """Bring all motors to rest; gives up after so many seconds."""
        runs = list(self._runs.values())
        for run in runs:
            run.end("the line is closed")
        for run in runs:
            run.is_over.wait(within)


class GuardedRun:
    """One run of one motor, which ends if the motor stops. Any thread may call."""

    def __init__(
        self,
        runs: GuardedRuns,
        fleet: Fleet,
        console: DriveConsole,
        direction: Direction,
        reference: str | None,
    ) -> None:
        self._runs = runs
        self._fleet = fleet
        self._console = console
        self._direction = direction
        self._reference = reference
        self.is_started = threading.Event()
        """Set once the motor runs, and once the run is over."""
        self.is_over = threading.Event()
        """Set once the motor is at standstill, or this program cannot stop it."""
        self.error: Exception | None = None
        """Why the run failed, or ended before its block; None before, and after a usual end."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._worker: LineWorker | None = None
        self._why = ""
        self._stopped_here = False
        self._ending = Ending()

    @property
    def device(self) -> int:
        """The drive's slave address."""
        return self._console.device

    def begin(self, permit: Permit) -> None:
        """Start the motor under a permit; returns at once.

        Raises LineClosed, and DriveError if the motor already runs for a block of this script.
        """
        if self.is_over.is_set():
            raise DriveError("This block has ended. Call running() again.")
        self._runs.add(self)
        self._worker = self._console.session.line.spawn(lambda: self._work(permit), "run")

    def end(self, why: str, *, stopped_here: bool = False) -> None:
        """Stop the motor, for good; returns at once, also in a signal handler.

        `stopped_here`: this program gives a stop of its own, too.
        """
        self._stopped_here |= stopped_here
        self._why = self._why or why
        if (loop := self._loop) is not None:
            with suppress(RuntimeError):  # the line was closed: the run is over
                loop.call_soon_threadsafe(self._end)

    def settle(self) -> None:
        """Note the end of a run that did not begin: it was refused, or the line was closed."""
        if self._loop is not None or (self._worker is not None and not self._worker.done()):
            return
        if self._worker is not None:
            self.error = LineClosed()
        self._runs.remove(self)
        self._set_over()

    def _set_over(self) -> None:
        self.is_over.set()
        self.is_started.set()

    def _end(self) -> None:
        self._ending.end(self._why)

    async def _work(self, permit: Permit) -> None:
        console, profile = self._console, self._console.session.profile
        self._loop = asyncio.get_running_loop()
        if self._why:
            self._end()
        run = MotorRun(
            self._fleet,
            console,
            self._ending,
            self,
            by="a script",
            prepare=lambda: self._prepare(permit),
            command=lambda: self._command(permit),
            is_stopped_here=lambda: self._stopped_here,
        )
        frequency = profile.quantity("output_frequency")
        console.monitor.start(period=WATCH_PERIOD, extra=[frequency.code] if frequency else [])
        try:
            await run.carry_out()
        except (asyncio.CancelledError, LineClosed):
            closed = not_stopped("the line was closed while the motor ran.")
            text = f"Device {self.device}: {closed}"
            self.error = NotStopped(text) if run.may_turn else LineClosed()
        except Exception as error:
            self.error = error
        finally:
            console.monitor.stop()
            self._runs.remove(self)
            self._set_over()

    async def _prepare(self, permit: Permit) -> None:
        await first_cycle(self._console)
        permit.check()

    async def _command(self, permit: Permit) -> None:
        commander = self._console.commander
        await outcome_or_error(
            commander,
            lambda: commander.run(self._direction, self._reference, permit.stamp),
        )
        self.is_started.set()

    # Reports of the run

    def report(self, event: RunEvent, text: str) -> None:
        """Put an event into the log."""
        log.info("run of device %s: %s, %s", self.device, event, text)

    def show(self, latest: Snapshot, timeout_text: Callable[[], str]) -> None:
        """Nothing: scripts read values with their own calls."""

    def warn(self, text: str) -> None:
        """Put it into the log as an error, which Python prints unless a script arranges it."""
        log.error("%s", text)
