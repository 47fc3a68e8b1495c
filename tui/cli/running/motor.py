"""One motor from its run command to its stop."""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tui.bus.errors import LineError
from tui.session.command.stop_report import Phase
from tui.session.monitor.timeout import left_alone_text
from tui.session.reading import with_text
from tui.session.running.ending import Ending
from tui.session.starts.keeper import StartKeeper

from ..commands.orders import (
    arm_drive,
    carried_out,
    complain,
    latest_of,
    moved,
    watch_of,
    watched,
)
from ..commands.stop import ended
from ..shared.control import GIVE_BACK_OPTION, taking_of, way_to_take
from ..shared.drive_status import fault_text
from ..shared.errors import DRIVE_REFUSED, ENDED_AFTER_WRITING, REFUSED_HERE, Failure
from ..shared.options import Target
from .telling import RunTelling
from .voice import BufferedOutput

if TYPE_CHECKING:
    from tui.drive.profile.schema import OrderId
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.fleet import Fleet
    from tui.session.monitor.snapshot import Snapshot
    from tui.session.timeout_report import TimeoutWatch

RUN_POLL_INTERVAL = 0.05
CYCLES_AT_REST = 2
"""Cycles in a row that show a motor at rest before it counts as stopped on its own."""
STOPS_THAT_MAY_FAIL = 2
"""Stops that may fail on a line without trouble before the motor is reported as running."""


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Options of `run`; `seconds` is the duration."""

    order: OrderId
    reference: str | None
    seconds: float | None
    leave_running: bool
    unrecorded: bool
    as_json: bool
    take_control: bool = False
    """True if the control is taken from the terminals first."""


@dataclass(slots=True)
class Run:
    """One motor from its run order to its stop."""

    fleet: Fleet
    console: DriveConsole
    wish: RunOptions
    telling: RunTelling
    ending: Ending
    watch: TimeoutWatch | None = None
    ordering: bool = False
    """True if the run order is on its way, so that it may be sent at any time."""

    async def carry_out(self) -> None:
        """Run the motor until the end; stop it then, whatever went wrong, or leave it running."""
        left = False
        try:
            if await self._started():
                await self._follow()
                left = self.wish.leave_running
        finally:
            if (moved(self.fleet.journal) or self.ordering) and not left:
                await self._bring_to_rest()
        if left:
            self.telling.tell("left-running", self._left_alone())

    def _left_alone(self) -> str:
        """Return the drive's reaction if polling stops."""
        return left_alone_text(self.console.session, watch=self.watch)

    async def _started(self) -> bool:
        """Give reference and run order; False where the end came first."""
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
        commander, wish = self.console.commander, self.wish
        arm_drive(self.console)
        self.watch = await watch_of(self.fleet, self.console)
        if wish.take_control:
            await self._take_control()
        self.ordering = True
        try:
            outcome = await carried_out(
                commander, lambda: commander.run(wish.order, wish.reference)
            )
        except Failure as failure:
            self.ordering = False
            way = way_to_take(self.console.session)
            raise Failure(failure.message + way, failure.status) from failure
        except Exception:
            self.ordering = False
            raise
        self.ordering = False
        if wish.reference is not None:
            self.telling.tell("reference", commander.given.reference_text)
        self.telling.tell("order", outcome.text)

    async def _take_control(self) -> None:
        """Take the control from the terminals, unless the line has it; raises Failure."""
        session = self.console.session
        found = taking_of(session)
        if found is None or not found.can_take:
            name = session.profile.name
            raise Failure(f"{name} has no control to take: run without that option.", REFUSED_HERE)
        if found.taken:
            return
        commander, wish = self.console.commander, self.wish
        await carried_out(commander, lambda: commander.check_run(wish.order, wish.reference))
        outcome = await carried_out(commander, lambda: commander.order("take-control"))
        text = (
            f"{outcome.text}. It stays with the line after this: {GIVE_BACK_OPTION} gives it back."
        )
        self.telling.tell("control", text)

    async def _follow(self) -> None:
        """Report on the motor until the end; raises Failure if it stops on its own."""
        begun = time.monotonic()
        seen, rest = 0, 0
        while not self.ending.event.is_set():
            latest = latest_of(self.console)
            if latest.cycle != seen and latest.time > begun:
                seen = latest.cycle
                self.telling.show(latest, self._left_alone)
                rest = rest + 1 if self._at_rest(latest) else 0
            if rest >= CYCLES_AT_REST:
                with suppress(LineError):
                    await self.console.read(self.console.session.followed)
                text, status = self._stopped_by_itself(latest)
                self.telling.tell("ended", text)
                raise Failure(text, status)
            if self.wish.seconds is not None and time.monotonic() - begun >= self.wish.seconds:
                self.ending.end(f"after {self.wish.seconds:g} s")
            with suppress(TimeoutError):
                await asyncio.wait_for(self.ending.event.wait(), RUN_POLL_INTERVAL)

    def _at_rest(self, latest: Snapshot) -> bool:
        """Return True if it is seen not to run; a drive may stay in its quick stop at 0 Hz."""
        if latest.error:
            return False
        kind = latest.state.kind
        at_zero = kind == "stopping" and self._frequency(latest) == 0
        return at_zero or kind in ("fault", "stopped", "ready", "blocked")

    def _frequency(self, latest: Snapshot) -> float | None:
        """The output frequency in Hz, as far as it is known."""
        frequency = self.console.session.profile.quantity("output_frequency")
        reading = with_text(latest.readings).get(frequency.code) if frequency else None
        return reading.number if reading is not None else None

    def _stopped_by_itself(self, latest: Snapshot) -> tuple[str, int]:
        """Why the motor no longer runs, and the status: 4 after a trip, 6 if it was stopped."""
        session = self.console.session
        who = f"Device {session.device}"
        if fault := fault_text(latest.state):
            text = f"{who} tripped: {fault}. Look at the machine; reset it when its cause is gone."
            return text, DRIVE_REFUSED
        by = "by the drive or by another source"
        if session.work.stops:
            by = f"by {session.work.stopped_by}"
        elif lost := self.console.commander.given.changed_words():
            by = f"by another program or master on the line: {lost}"
        elif latest.state.local:
            by = "at its terminals or keypad"
        text = f"{who} no longer runs: {latest.state.headline}. It was stopped {by}."
        return text, ENDED_AFTER_WRITING

    async def _bring_to_rest(self) -> None:
        """Stop the motor and wait for its standstill; on a lost line as soon as that is back.

        Raises Failure where the drive answers and does not stop.
        """
        session, stopper, failed = self.console.session, self.fleet.stopper, 0
        self.telling.tell("stopping", f"stopping ({self.ending.why or 'the run has ended'})")
        while True:
            ordered = time.monotonic()
            stopper.stop([session], by="drivepanel run")
            report = await ended(stopper, session.device)
            if report.phase is Phase.STOPPED:
                return self.telling.tell("stopped", f"Device {session.device}: stopped.")
            bad = await self._line_was_bad(ordered)
            if self._stands():
                return self.telling.tell("stopped", f"Device {session.device} is at standstill.")
            # a ramp may be longer than a stop is followed
            if not bad and latest_of(self.console).state.kind != "stopping":
                failed += 1
            if failed == STOPS_THAT_MAY_FAIL:
                raise Failure(f"Device {session.device}: {report.text}", DRIVE_REFUSED)

    def _stands(self) -> bool:
        """Return True if the motor is seen at rest, though the drive did not take the stop."""
        latest = latest_of(self.console)
        enabled = latest.state.motion == "running"
        return self._at_rest(latest) and not enabled and self._frequency(latest) == 0

    async def _line_was_bad(self, since: float) -> bool:
        """Wait until the drive answers; whether it failed to at any time since."""
        requested, bad, reported = time.monotonic(), False, False
        while True:
            latest = latest_of(self.console)
            if latest.error and latest.time > since:
                bad = True
                if not reported:
                    reported = True
                    alone = self._left_alone()
                    complain(
                        f"NOT STOPPED yet: {latest.error}\n{alone} It is stopped as soon as it"
                        " answers; until then stop it at the machine."
                    )
            elif not latest.error and latest.time > requested:
                return bad
            await asyncio.sleep(RUN_POLL_INTERVAL)


async def run_motor(opened: OpenLine, target: Target, wish: RunOptions) -> None:
    """Run a motor as wished, to its end."""
    loop, ending = asyncio.get_running_loop(), Ending()

    def gone() -> None:
        with suppress(RuntimeError):  # the loop has ended: nothing runs any more
            loop.call_soon_threadsafe(ending.end, "its output is no longer read")

    voice = BufferedOutput(gone)
    starts = StartKeeper("run")
    starts.unrecorded, starts.left_running = wish.unrecorded, wish.leave_running
    with ending.by_signals():
        try:
            async with watched(opened, target, starts) as (fleet, console):
                telling = RunTelling(console.session, voice.say, as_json=wish.as_json)
                await Run(fleet, console, wish, telling, ending).carry_out()
        finally:
            voice.finish()
