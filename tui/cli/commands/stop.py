"""`drivepanel stop`: stop one drive, or every drive of a line. Needs no arming."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from ..shared.errors import DRIVE_REFUSED, LINE_TROUBLE, REFUSED_HERE, Failure, told
from ..shared.options import (
    Target,
    connect_drive,
    drive_options,
    line_argument,
    on_line,
    read_only_option,
    unidentified,
)
from ..shared.say import say
from .orders import close_journal, complain

if TYPE_CHECKING:
    from tui.drive.profile.schema import OrderId
    from tui.session.command.stop import Stopper
    from tui.session.command.stop_report import StopReport
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

USUAL_ADDRESSES = "1-10"
STOP_POLL_INTERVAL = 0.05


@click.command()
@line_argument
@drive_options
@click.option("--all", "every", is_flag=True, help="Stop every drive found on the line.")
@click.option(
    "--addresses",
    metavar="LIST",
    help=f"With --all: where to look, like 1-10 or 1,2,31; {USUAL_ADDRESSES} unless told"
    " otherwise, or the drives of a simulated line.",
)
@click.option("--quick", is_flag=True, help="By the drive's quick stop.")
@click.option("--freewheel", is_flag=True, help="Let the motor coast.")
@click.option(
    "--give-back",
    is_flag=True,
    help="Then give the control back to the terminals; a run command waiting there starts the"
    " motor, so this part wants --arm.",
)
@click.option("--arm", is_flag=True, help="Let --give-back write to the drive; no stop needs it.")
@read_only_option
@told
def stop(
    target: Target,
    every: bool,
    addresses: str | None,
    quick: bool,
    freewheel: bool,
    give_back: bool,
    arm: bool,
    read_only: bool,
) -> None:
    """Stop a motor on its ramp and wait until it stands. Needs no arming."""
    if quick and freewheel:
        raise click.UsageError("Either --quick or --freewheel.")
    if addresses and not every:
        raise click.UsageError("--addresses goes with --all.")
    if give_back and every:
        raise click.UsageError("--give-back is for one drive, not for --all.")
    if read_only:
        raise Failure("The line is read-only: nothing is written, a stop neither.", REFUSED_HERE)
    order: OrderId = "quick-stop" if quick else "freewheel" if freewheel else "stop"
    devices = _devices(addresses) if every else None

    async def work(opened: OpenLine) -> int:
        if not every:
            found = await _wanted(opened, target)
            status = await _stop_one(opened, found, order)
            if give_back and not status:
                from ..running.giving_back import give_control_back

                await give_control_back(found.session, arm=arm)
            return status
        wanted = devices or opened.devices or tuple(_devices(USUAL_ADDRESSES))
        return await _stop_all(opened, wanted, order, target.profile_id)

    if worst := on_line(target, work):
        raise click.exceptions.Exit(worst)


def _devices(text: str | None) -> list[int]:
    from tui.session.connect.addresses import parse_addresses

    return parse_addresses(text) if text is not None else []


def has_order(session: DriveSession, order: OrderId) -> bool:
    """Whether the family has such an order at all."""
    charts = session.profile.data.charts
    return any(one.id == order for chart in charts for one in chart.orders)


async def ended(stopper: Stopper, device: int) -> StopReport:
    """The report of a stop that was ordered, once nothing more is awaited."""
    from tui.session.command.stop_report import Phase

    while True:
        report = stopper.reports[device]
        if report.phase in (Phase.STOPPED, Phase.FAILED):
            return report
        await asyncio.sleep(STOP_POLL_INTERVAL)


@dataclass(frozen=True, slots=True)
class StoppableDrive:
    """A drive that can be stopped, and what it is called."""

    session: DriveSession
    name: str


async def _wanted(opened: OpenLine, target: Target) -> StoppableDrive:
    """The wanted drive; raises UsageError where it is not known what stops it."""
    from tui.bus.api import Priority
    from tui.drive.profile import library
    from tui.session.connect.identify import identify_drive

    if target.profile_id is None:
        # what a stop needs to know comes before all polls, and past a frozen owner of the line
        identity = await identify_drive(opened.line, target.device, priority=Priority.STOP)
        found = await asyncio.to_thread(_session, opened, identity, None)
        if found is None:
            raise unidentified(identity)
        return found
    session = await connect_drive(opened, target)
    return StoppableDrive(session, library.load(target.profile_id).name)


async def _stop_one(opened: OpenLine, found: StoppableDrive, order: OrderId) -> int:
    from tui.session.command.stop import Stopper
    from tui.session.journal import Journal

    if not has_order(found.session, order):
        raise Failure(
            f"Device {found.session.device}, {found.name}, has no {order.replace('-', ' ')};"
            " stop it without that option.",
            REFUSED_HERE,
        )
    journal = Journal()
    try:
        return await _seen_through(Stopper(opened.line, journal), found, order)
    finally:
        close_journal(journal)


async def _seen_through(stopper: Stopper, found: StoppableDrive, order: OrderId) -> int:
    """Stop a drive, tell what became of it; returns the exit status."""
    from tui.session.command.stop_report import Phase

    session = found.session
    stopper.stop([session], order, by="drivepanel stop")
    report = await ended(stopper, session.device)
    who = f"Device {session.device}, {found.name}"
    if report.phase is Phase.STOPPED:
        with suppress(OSError):  # a reader that went away must not end the other stops
            say(f"{who}: {report.text}.")
        return 0
    complain(f"{who}: {report.text}")
    return await _why(session)


async def _why(session: DriveSession) -> int:
    """The status of a stop that failed: whether the drive answers at all."""
    from tui.bus.errors import DeviceException, LineError
    from tui.drive.chart import watched_codes
    from tui.session.read.reader import Reader

    try:
        await Reader(session).read(watched_codes(session.profile)[:1])
    except DeviceException:
        return DRIVE_REFUSED
    except LineError:
        return LINE_TROUBLE
    return DRIVE_REFUSED


async def _stop_all(
    opened: OpenLine, devices: Iterable[int], order: OrderId, profile_id: str | None
) -> int:
    """Stop each drive as soon as it is found; what one does holds up no other.

    Every address is asked once in haste before any is asked with patience: a silent one takes
    seconds to rule out, and meanwhile motors turn.
    """
    from tui.session.command.stop import Stopper
    from tui.session.journal import Journal

    journal = Journal()
    stopper = Stopper(opened.line, journal)
    stops: list[asyncio.Task[int]] = []
    left = list(devices)
    worst = 0
    try:
        for patient in (False, True):
            asked, left = left, []
            for device in asked:
                try:
                    found = await _found(opened, device, profile_id, patient=patient)
                except Failure as failure:
                    complain(failure.format_message())
                    worst = max(worst, failure.exit_code)
                    continue
                if found is None:
                    left.append(device)
                    continue
                # a drive without the wished way is stopped all the same
                way: OrderId = order if has_order(found.session, order) else "stop"
                stops.append(asyncio.create_task(_seen_through(stopper, found, way)))
    finally:
        # whatever went wrong with the search: stops that were begun are seen through
        worst = max([worst, *await asyncio.gather(*stops)])
        close_journal(journal)
    if left:
        complain(f"No answer at {', '.join(map(str, left))}.")
    return worst or (0 if stops else LINE_TROUBLE)


async def _found(
    opened: OpenLine, device: int, profile_id: str | None, *, patient: bool
) -> StoppableDrive | None:
    """The drive at an address; None where nobody answers yet.

    Raises Failure where it cannot be stopped, and why.
    """
    from tui.bus.api import LineStatus, Priority
    from tui.bus.errors import LineError, NoAnswer
    from tui.session.connect.identify import identify_drive

    priority = Priority.OPERATOR_READ if patient else Priority.BACKGROUND
    if opened.line.state.status is LineStatus.LOST:
        # the program that owns the line is frozen: nothing else goes past it
        priority = Priority.STOP
    try:
        identity = await identify_drive(opened.line, device, priority=priority)
    except NoAnswer:
        return None
    except LineError as error:
        if not patient:
            return None  # asked again, with patience
        raise Failure(f"Device {device}: NOT STOPPED: {error}", LINE_TROUBLE) from error
    if (found := await asyncio.to_thread(_session, opened, identity, profile_id)) is not None:
        return found
    fits = ", ".join(identity.candidates) or "drivepanel profiles"
    raise Failure(
        f"Device {device}: NOT STOPPED: it does not say who it is. Name its profile"
        f" with -p ({fits}), or stop it at the machine.",
        DRIVE_REFUSED,
    )


def _session(
    opened: OpenLine, identity: DriveIdentity, profile_id: str | None
) -> StoppableDrive | None:
    """A session with the drive; None where it is not known what stops it.

    A drive that does not say who it is may belong to several families: where the same words stop
    them all, which one it is does not matter.
    """
    from tui.drive.orders import stop_alike
    from tui.drive.profile import library
    from tui.session.drive import DriveSession

    named = identity.profile or profile_id
    profiles = [library.load(one) for one in ([named] if named else identity.candidates)]
    if not stop_alike(profiles):
        return None
    session = DriveSession(opened.line, identity.device, profiles[0], identity)
    return StoppableDrive(session, " or ".join(profile.name for profile in profiles))
