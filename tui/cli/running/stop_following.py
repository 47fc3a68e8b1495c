"""Stops that are followed to the standstill of the motor, for every command."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

from tui.bus.errors import DeviceException, LineError
from tui.drive.chart import watched_codes

from ..shared.drive_commands import carried_out, complain
from ..shared.errors import DRIVE_REFUSED, LINE_TROUBLE, Failure

if TYPE_CHECKING:
    from tui.session.command.stop import Stopper
    from tui.session.command.stop_report import StopReport
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.work import Outcome

STOP_POLL_INTERVAL = 0.05


async def ended(
    stopper: Stopper, device: int, warn: Callable[[str], None] = lambda _: None
) -> StopReport:
    """The report of a stop that was ordered, once nothing more is awaited.

    `warn` gets at once why a motor is not going to stop, as far as is known.
    """
    from tui.session.command.stop_report import OVER, Phase

    warned = False
    while True:
        report = stopper.reports[device]
        if report.phase in OVER:
            return report
        if report.phase is Phase.UNHEEDED and not warned:
            warned = True
            warn(report.text)
        await asyncio.sleep(STOP_POLL_INTERVAL)


async def status_of_failed(session: DriveSession) -> int:
    """The status of a stop that failed: whether the drive answers at all."""
    from tui.session.read.reader import Reader

    try:
        await Reader(session).read(watched_codes(session.profile)[:1])
    except DeviceException:
        return DRIVE_REFUSED
    except LineError:
        return LINE_TROUBLE
    return DRIVE_REFUSED


async def carried_to_rest(fleet: Fleet, console: DriveConsole, give: Callable[[], None]) -> Outcome:
    """Give a command and wait for its result; after half of it, wait for standstill too.

    Raises as `carried_out`. A motor that did not stop is reported as NOT STOPPED, with the status
    of its stop.
    """
    from tui.session.command.access import HalfSent
    from tui.session.command.stop_report import Phase
    from tui.session.fleet import HALF_SENT

    try:
        return await carried_out(console.commander, give)
    except Failure as failure:
        error = failure.__cause__
        if not isinstance(error, HalfSent) or not error.needs_stop:
            raise
        session, text, status = console.session, failure.message, failure.status
    who = f"Device {session.device}"
    fleet.stop([session], by=HALF_SENT)
    report = await ended(fleet.stopper, session.device, lambda why: complain(f"{who}: {why}"))
    if report.phase is Phase.STOPPED:
        raise Failure(f"{text}\n{who}: {report.text}.", status) from error
    status = await status_of_failed(session)
    raise Failure(f"{text}\n{who}: {report.text}", status) from error
