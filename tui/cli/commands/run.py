"""`drivepanel run`: a motor that runs as long as this command does, and is stopped at its end."""

from __future__ import annotations

import asyncio
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from tui.bus.errors import LineError
from tui.session.monitor.timeout import left_alone_text
from tui.session.starts.keeper import StartKeeper

from ..shared.errors import DRIVE_REFUSED, REFUSED_HERE, Failure, told
from ..shared.options import (
    Target,
    drive_options,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.say import printable
from .orders import (
    arm_drive,
    arm_option,
    carried_out,
    complain,
    latest_of,
    moved,
    need_arming,
    watch_of,
    watched,
)
from .status import fault_text, shown_values, values_json

if TYPE_CHECKING:
    from tui.drive.profile.schema import OrderId
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.fleet import Fleet
    from tui.session.monitor.snapshot import Snapshot
    from tui.session.monitor.timeout import TimeoutWatch

TOLD_EVERY = 1.0
"""Seconds between two lines about the motor."""
RUN_POLL_INTERVAL = 0.05
CYCLES_AT_REST = 2
"""Cycles in a row that show a motor at rest before it counts as stopped by itself."""
STOPS_THAT_MAY_FAIL = 2
"""Stops that may fail on a line without trouble before it is told that the motor runs."""
LINES_WAITING = 64
"""Lines kept for a reader that is slower than they come; older ones are dropped."""
HEARD_OUT = 2.0
"""Seconds that the reader has for the last lines."""
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


@dataclass(slots=True)
class Ending:
    """Whether the command is to end, and why; belongs to the loop."""

    event: asyncio.Event = field(default_factory=asyncio.Event)
    why: str = ""

    def end(self, why: str) -> None:
        """End the command; the first reason stays."""
        self.why = self.why or why
        self.event.set()

    @contextmanager
    def by_signals(self) -> Iterator[None]:
        """While inside, signals end the command and nothing else, however often they come."""
        loop = asyncio.get_running_loop()
        numbers = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
        # a hangup that the person has ignored on purpose (nohup) stays ignored
        numbers = [
            number
            for number in numbers
            if number == signal.SIGINT or signal.getsignal(number) != signal.SIG_IGN
        ]
        before = {number: signal.getsignal(number) for number in numbers}
        for number in numbers:
            self._handle(loop, number)
        try:
            yield
        finally:
            for number, handler in before.items():
                with suppress(NotImplementedError):
                    loop.remove_signal_handler(number)
                signal.signal(number, handler)

    def _handle(self, loop: asyncio.AbstractEventLoop, number: int) -> None:
        why = f"ended by {signal.Signals(number).name}"
        try:
            loop.add_signal_handler(number, self.end, why)
        except NotImplementedError:  # Windows

            def handle(_number: int, _frame: FrameType | None) -> None:
                loop.call_soon_threadsafe(self.end, why)

            signal.signal(number, handle)


class Voice:
    """Lines for standard output, in a thread: a reader that takes none must not hold up a stop."""

    def __init__(self, gone: Callable[[], None]) -> None:
        self._gone = gone
        self._lines: queue.Queue[bytes] = queue.Queue(LINES_WAITING)
        self._out = sys.stdout.fileno()
        self._encoding = sys.stdout.encoding or "utf-8"
        threading.Thread(target=self._work, name="output", daemon=True).start()

    def say(self, text: str) -> None:
        """Put a line out as soon as the reader takes it."""
        line = f"{printable(text, self._encoding)}{os.linesep}".encode(self._encoding)
        while True:
            try:
                return self._lines.put_nowait(line)
            except queue.Full:
                with suppress(queue.Empty):
                    self._lines.get_nowait()
                    self._lines.task_done()

    def finish(self) -> None:
        """Give the reader time for the last lines."""
        end = time.monotonic() + HEARD_OUT
        while self._lines.unfinished_tasks and time.monotonic() < end:
            time.sleep(RUN_POLL_INTERVAL)

    def _work(self) -> None:
        broken = False
        while True:
            line = self._lines.get()
            try:
                # past Python's own buffer: its lock would hold up the end of the process
                while line and not broken:
                    line = line[os.write(self._out, line) :]
            except OSError:
                broken = True
                self._gone()
            finally:
                self._lines.task_done()


@dataclass(frozen=True, slots=True)
class Wish:
    """What `run` was asked for; `seconds` is how long."""

    order: OrderId
    reference: str | None
    seconds: float | None
    leave_running: bool
    unrecorded: bool
    as_json: bool


@dataclass(slots=True)
class Run:
    """One motor from its run order to its stop."""

    fleet: Fleet
    console: DriveConsole
    wish: Wish
    voice: Voice
    ending: Ending
    watch: TimeoutWatch | None = None
    trouble: float = 0.0
    """When the last cycle failed, time.monotonic()."""
    told: float = 0.0
    ordering: bool = False
    """Whether the run order is on its way, so that it may be sent at any time."""

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
            self._tell("left-running", left_alone_text(self.console.session, watch=self.watch))

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
        if wish.reference is not None:
            text = wish.reference
            outcome = await carried_out(commander, lambda: commander.refer(text))
            self._tell("reference", outcome.text)
        self.watch = await watch_of(self.fleet, self.console)
        self.ordering = True
        try:
            outcome = await carried_out(commander, lambda: commander.order(wish.order))
        except Exception:
            self.ordering = False
            raise
        self.ordering = False
        self._tell("order", outcome.text)

    async def _follow(self) -> None:
        """Tell about the motor until the end; raises Failure where it stops by itself."""
        begun = time.monotonic()
        seen, rest = 0, 0
        while not self.ending.event.is_set():
            latest = latest_of(self.console)
            if latest.cycle != seen and latest.time > begun:
                seen = latest.cycle
                self._show(latest)
                rest = rest + 1 if self._at_rest(latest) else 0
            if rest >= CYCLES_AT_REST:
                with suppress(LineError):
                    await self.console.read(self.console.session.followed)
                text, status = self._stopped_by_itself(latest)
                self._tell("ended", text)
                raise Failure(text, status)
            if self.wish.seconds is not None and time.monotonic() - begun >= self.wish.seconds:
                self.ending.end(f"after {self.wish.seconds:g} s")
            with suppress(TimeoutError):
                await asyncio.wait_for(self.ending.event.wait(), RUN_POLL_INTERVAL)

    def _at_rest(self, latest: Snapshot) -> bool:
        """Whether it is seen not to run; a drive may stay in its quick stop at 0 Hz."""
        if latest.error:
            return False
        kind = latest.state.kind
        at_zero = kind == "stopping" and self._frequency(latest) == 0
        return at_zero or kind in ("fault", "stopped", "ready", "blocked")

    def _frequency(self, latest: Snapshot) -> float | None:
        """The output frequency in Hz, as far as it is known."""
        frequency = self.console.session.profile.quantity("output_frequency")
        reading = latest.readings.get(frequency.code) if frequency else None
        return reading.number if reading is not None else None

    def _stopped_by_itself(self, latest: Snapshot) -> tuple[str, int]:
        """Why the motor no longer runs, and the status: 4 after a trip, 5 where it was stopped."""
        session = self.console.session
        who = f"Device {session.device}"
        if fault := fault_text(latest.state):
            text = f"{who} tripped: {fault}. Look at the machine; reset it when its cause is gone."
            return text, DRIVE_REFUSED
        by = "by itself or from elsewhere"
        if session.work.stops:
            by = f"by {session.work.stopped_by}"
        elif lost := self.console.commander.given.changed_words():
            by = f"by another program or master on the line: {lost}"
        elif latest.state.local:
            by = "at its terminals or keypad"
        return f"{who} no longer runs: {latest.state.headline}. It was stopped {by}.", REFUSED_HERE

    def _show(self, latest: Snapshot) -> None:
        """A line about the motor once a second; trouble on the line when it begins and ends."""
        if latest.error:
            if not self.trouble:
                alone = left_alone_text(self.console.session, watch=self.watch)
                complain(f"{latest.error}\n{alone} It is tried on.")
            self.trouble = latest.time
        elif self.trouble:
            complain("The drive answers again.")
            self.trouble = 0.0
        if latest.time - self.told < TOLD_EVERY * 0.9:
            return
        self.told = latest.time
        self._tell("state", self._state_line(latest), latest)

    def _state_line(self, latest: Snapshot) -> str:
        if latest.error:
            return f"no answer: {latest.error}"
        values = shown_values(self.console.session.profile, latest.readings)
        return "  ".join([latest.state.headline, *(f"{k} {v}" for k, v in values.items())])

    def _tell(self, event: str, text: str, latest: Snapshot | None = None) -> None:
        from ..shared.output import iso_time, json_text

        now = time.time()
        if not self.wish.as_json:
            self.voice.say(f"{time.strftime('%H:%M:%S', time.localtime(now))}  {text}")
            return
        data: dict[str, Any] = {"time": iso_time(now), "device": self.console.session.device}
        data |= {"event": event, "text": text}
        if latest is not None:
            state = latest.state
            data |= {
                "state": None if latest.error else state.kind,
                "direction": None if latest.error else state.direction,
                "fault": state.fault.code if state.fault and not latest.error else None,
                "values": values_json(self.console.session.profile, latest.readings),
                "error": latest.error or None,
            }
        self.voice.say(json_text(data))

    async def _bring_to_rest(self) -> None:
        """Stop the motor and see it stand; on a lost line as soon as that is back.

        Raises Failure where the drive answers and does not stop.
        """
        from tui.session.command.stop_report import Phase

        from .stop import ended

        session, stopper, failed = self.console.session, self.fleet.stopper, 0
        self._tell("stopping", f"stopping ({self.ending.why or 'the run has ended'})")
        while True:
            ordered = time.monotonic()
            stopper.stop([session], by="drivepanel run")
            report = await ended(stopper, session.device)
            if report.phase is Phase.STOPPED:
                return self._tell("stopped", f"Device {session.device}: stopped.")
            bad = await self._line_was_bad(ordered)
            if self._stands():
                return self._tell("stopped", f"Device {session.device}: it stands.")
            # a ramp may be longer than a stop is followed
            if not bad and latest_of(self.console).state.kind != "stopping":
                failed += 1
            if failed == STOPS_THAT_MAY_FAIL:
                raise Failure(f"Device {session.device}: {report.text}", DRIVE_REFUSED)

    def _stands(self) -> bool:
        """Whether the motor is seen at rest, though the drive did not take the stop."""
        latest = latest_of(self.console)
        return self._at_rest(latest) and self._frequency(latest) == 0

    async def _line_was_bad(self, since: float) -> bool:
        """Wait until the drive answers; whether it failed to at any time since."""
        asked, bad, told = time.monotonic(), False, False
        while True:
            latest = latest_of(self.console)
            if latest.error and latest.time > since:
                bad = True
                if not told:
                    told = True
                    alone = left_alone_text(self.console.session, watch=self.watch)
                    complain(
                        f"NOT STOPPED yet: {latest.error}\n{alone} It is stopped as soon as it"
                        " answers; until then stop it at the machine."
                    )
            elif not latest.error and latest.time > asked:
                return bad
            await asyncio.sleep(RUN_POLL_INTERVAL)


async def run_motor(opened: OpenLine, target: Target, wish: Wish) -> None:
    """Run a motor as wished, to its end."""
    loop, ending = asyncio.get_running_loop(), Ending()

    def gone() -> None:
        with suppress(RuntimeError):  # the loop has ended: nothing runs any more
            loop.call_soon_threadsafe(ending.end, "nobody reads the output any more")

    voice = Voice(gone)
    starts = StartKeeper("run")
    starts.unrecorded, starts.left_running = wish.unrecorded, wish.leave_running
    with ending.by_signals():
        try:
            async with watched(opened, target, starts) as (fleet, console):
                await Run(fleet, console, wish, voice, ending).carry_out()
        finally:
            voice.finish()


@click.command()
@line_argument
@drive_options
@click.option("--reverse", is_flag=True, help="Run reverse.")
@click.option("--reference", metavar="REFERENCE", help="Give this reference first: 30Hz, 900rpm.")
@click.option(
    "--for",
    "seconds",
    type=click.FloatRange(min=0, min_open=True),
    metavar="S",
    help="End after S seconds.",
)
@arm_option
@click.option(
    "--leave-running", is_flag=True, help="Do not stop the motor at the end of this command."
)
@click.option(
    "--unrecorded",
    is_flag=True,
    help="Run even where the start cannot be put on record in the state folder.",
)
@read_only_option
@json_option
@told
def run(
    target: Target,
    reverse: bool,
    reference: str | None,
    seconds: float | None,
    arm: bool,
    leave_running: bool,
    unrecorded: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Run a motor as long as this command runs; Ctrl-C stops it on its ramp.

    So do SIGTERM, SIGHUP, a closed standard output and the end of --for.
    """
    need_arming(arm, "run starts the motor")
    wish = Wish(
        "reverse" if reverse else "forward", reference, seconds, leave_running, unrecorded, as_json
    )
    on_line(target.line_text, lambda opened: run_motor(opened, target, wish), read_only=read_only)
