"""`drivepanel run`: a motor that runs as long as this command does, and is stopped at its end."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from tui.session.reading import with_text

from ..running.buffered_output import BufferedOutput
from ..shared.control import GIVE_BACK_OPTION, taking_of, way_to_take
from ..shared.drive_commands import (
    arm_drive,
    arm_option,
    carried_out,
    complain,
    need_arming,
    watched,
)
from ..shared.drive_status import shown_fields, shown_values
from ..shared.errors import REFUSED_HERE, Failure
from ..shared.numbers import seconds as seconds_range
from ..shared.options import (
    Target,
    drive_options,
    json_option,
    line_argument,
    never_forced,
    on_line,
    read_only_option,
)
from ..shared.pending_timeouts import timeout_field
from ..shared.registration import WRITING, command

if TYPE_CHECKING:
    from tui.drive.profile.schema import OrderId
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.monitor.snapshot import Snapshot

    from ..documents.drive_documents import PrintedRunEvent

REPORT_INTERVAL = 1.0
"""Seconds between two lines about the motor."""


class RunTelling:
    """Reports on one motor; `say` puts a line out."""

    def __init__(self, session: DriveSession, say: Callable[[str], None], *, as_json: bool) -> None:
        self._session = session
        self._say = say
        self._as_json = as_json
        self._trouble = 0.0
        """When the last cycle failed, time.monotonic()."""
        self._reported = 0.0

    def show(self, latest: Snapshot, timeout_text: Callable[[], str]) -> None:
        """A line about the motor once a second; trouble on the line when it begins and ends.

        `timeout_text` gives what happens to the motor when polling stops.
        """
        if latest.error:
            if not self._trouble:
                complain(f"{latest.error}\n{timeout_text()} Retrying.")
            self._trouble = latest.time
        elif self._trouble:
            complain("The drive answers again.")
            self._trouble = 0.0
        if latest.time - self._reported < REPORT_INTERVAL * 0.9:
            return
        self._reported = latest.time
        self._print("state", self._state_line(latest), latest)

    def _state_line(self, latest: Snapshot) -> str:
        if latest.error:
            return f"no answer: {latest.error}"
        values = shown_values(self._session.profile, with_text(latest.readings))
        return "  ".join([latest.state.headline, *(f"{k} {v}" for k, v in values.items())])

    def report(self, event: PrintedRunEvent, text: str) -> None:
        """Print one line, or one JSON object a line, about an event."""
        self._print(event, text)

    def warn(self, text: str) -> None:
        """Print it on standard error."""
        complain(text)

    def _print(self, event: PrintedRunEvent, text: str, latest: Snapshot | None = None) -> None:
        from msgspec.structs import replace

        from tui.session.monitor.timeout import timeout_now

        from ..documents.drive_documents import RunDocument
        from ..shared.output import iso_time, json_text

        now = time.time()
        if not self._as_json:
            self._say(f"{time.strftime('%H:%M:%S', time.localtime(now))}  {text}")
            return
        document = RunDocument(
            time=iso_time(now),
            device=self._session.device,
            event=event,
            text=text,
            timeout=timeout_field(timeout_now(self._session)),
        )
        if latest is not None:
            state = latest.state
            document = replace(
                document,
                state=None if latest.error else state.kind,
                direction=None if latest.error else state.direction,
                fault=state.fault.code if state.fault and not latest.error else None,
                values=shown_fields(self._session.profile, with_text(latest.readings)),
                error=latest.error or None,
            )
        self._say(json_text(document))


@command("Run a motor until this command ends.", group="Run", statuses=WRITING, acts=True)
@line_argument
@drive_options
@click.option("--reverse", is_flag=True, help="Run reverse.")
@click.option("--reference", metavar="REFERENCE", help="Set this reference first: 30Hz, 900rpm.")
@click.option(
    "--for",
    "seconds",
    type=seconds_range(above=True),
    metavar="S",
    help="Stop the motor after S seconds.",
)
@arm_option
@click.option(
    "--leave-running", is_flag=True, help="Leave the motor running at the end of this command."
)
@click.option(
    "--unrecorded",
    is_flag=True,
    help="Start even if the start cannot be recorded.",
)
@click.option(
    "--take-control",
    is_flag=True,
    help="Take control from the terminals; their stop is disabled.",
)
@read_only_option
@json_option
@never_forced
def run(
    target: Target,
    reverse: bool,
    reference: str | None,
    seconds: float | None,
    arm: bool,
    leave_running: bool,
    unrecorded: bool,
    take_control: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Run a motor until this command ends; Ctrl-C stops it on its ramp.

    Other signals that end a program, a closed standard output and the end of --for stop it, too.
    """
    need_arming(arm, "run starts the motor")
    wish = RunOptions(
        "reverse" if reverse else "forward",
        reference,
        seconds,
        leave_running,
        unrecorded,
        as_json,
        take_control,
    )
    on_line(target, lambda opened: run_motor(opened, target, wish), read_only=read_only)


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
class RunCommand:
    """The run command with its options."""

    console: DriveConsole
    options: RunOptions
    telling: RunTelling

    async def prepare(self) -> None:
        """Arm the drive and take its control, if that is wanted; raises Failure."""
        arm_drive(self.console)
        if self.options.take_control:
            await self._take_control()

    async def give(self) -> None:
        """Give reference and run command; raises Failure if they are refused."""
        commander, options = self.console.commander, self.options
        try:
            outcome = await carried_out(
                commander, lambda: commander.run(options.order, options.reference)
            )
        except Failure as failure:
            way = way_to_take(self.console.session)
            text = f"{failure.message} {way}" if way else failure.message
            raise Failure(text, failure.status) from failure
        if options.reference is not None:
            self.telling.report("reference", commander.given.reference_text)
        self.telling.report("order", outcome.text)

    async def _take_control(self) -> None:
        """Take the control from the terminals, unless the line has it; raises Failure."""
        session, options = self.console.session, self.options
        found = taking_of(session)
        if found is None or not found.can_take:
            name = session.profile.name
            raise Failure(f"{name} has no control to take: run without that option.", REFUSED_HERE)
        if found.taken:
            return
        commander = self.console.commander
        await carried_out(commander, lambda: commander.check_run(options.order, options.reference))
        outcome = await carried_out(commander, lambda: commander.order("take-control"))
        text = (
            f"{outcome.text}. It stays with the line after this: {GIVE_BACK_OPTION} gives it back."
        )
        self.telling.report("control", text)


async def run_motor(opened: OpenLine, target: Target, wish: RunOptions) -> None:
    """Run a motor as wished, to its end."""
    from tui.session.running.ending import Ending
    from tui.session.running.motor_run import MotorRun
    from tui.session.starts.keeper import StartKeeper

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
                command = RunCommand(console, wish, telling)
                await MotorRun(
                    fleet,
                    console,
                    ending,
                    telling,
                    by="drivepanel run",
                    prepare=command.prepare,
                    command=command.give,
                    seconds=wish.seconds,
                    leave_running=wish.leave_running,
                ).carry_out()
        finally:
            voice.finish()
