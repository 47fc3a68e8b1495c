"""`drivepanel stop`: stop one drive, or every drive of a line. Needs no arming."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterable
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from .errors import DRIVE_REFUSED, LINE_TROUBLE, REFUSED_HERE, Failure, told
from .options import Target, connect, drive_options, line_argument, on_line, read_only_option
from .orders import complain

if TYPE_CHECKING:
    from tui.drive.schema import OrderId
    from tui.session.drive_session import DriveSession
    from tui.session.lines import OpenLine
    from tui.session.stop import Stopper, StopReport

USUAL_ADDRESSES = "1-10"
LOOK = 0.05


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
@read_only_option
@told
def stop(
    target: Target,
    every: bool,
    addresses: str | None,
    quick: bool,
    freewheel: bool,
    read_only: bool,
) -> None:
    """Stop a motor on its ramp and wait until it stands. Needs no arming."""
    if quick and freewheel:
        raise click.UsageError("Either --quick or --freewheel.")
    if addresses and not every:
        raise click.UsageError("--addresses goes with --all.")
    if read_only:
        raise Failure("The line is read-only: nothing is written, a stop neither.", REFUSED_HERE)
    order: OrderId = "quick-stop" if quick else "freewheel" if freewheel else "stop"
    devices = _devices(addresses) if every else None

    async def work(opened: OpenLine) -> int:
        if not every:
            session = await connect(opened, target)
            return await _stop_one(opened, session, order)
        wanted = devices or opened.devices or tuple(_devices(USUAL_ADDRESSES))
        return await _stop_all(opened, wanted, order, target.profile_id)

    if worst := on_line(target.line_text, work):
        raise click.exceptions.Exit(worst)


def _devices(text: str | None) -> list[int]:
    from tui.session.addresses import parse_addresses

    return parse_addresses(text) if text is not None else []


def has_order(session: DriveSession, order: OrderId) -> bool:
    """Whether the family has such an order at all."""
    charts = session.profile.data.charts
    return any(one.id == order for chart in charts for one in chart.orders)


async def ended(stopper: Stopper, device: int) -> StopReport:
    """The report of a stop that was ordered, once nothing more is awaited."""
    from tui.session.stop import Phase

    while True:
        report = stopper.reports[device]
        if report.phase in (Phase.STOPPED, Phase.FAILED):
            return report
        await asyncio.sleep(LOOK)


async def _stop_one(opened: OpenLine, session: DriveSession, order: OrderId) -> int:
    from tui.session.journal import Journal
    from tui.session.stop import Stopper

    if not has_order(session, order):
        raise Failure(
            f"Device {session.device}, {session.profile.name}, has no {order.replace('-', ' ')};"
            " stop it without that option.",
            REFUSED_HERE,
        )
    journal = Journal()
    try:
        return await _seen_through(Stopper(opened.line, journal), session, order)
    finally:
        journal.close()


async def _seen_through(stopper: Stopper, session: DriveSession, order: OrderId) -> int:
    """Stop a drive, tell what became of it; returns the exit status."""
    from tui.session.stop import Phase

    stopper.stop([session], order)
    report = await ended(stopper, session.device)
    who = f"Device {session.device}, {session.profile.name}"
    if report.phase is Phase.STOPPED:
        with suppress(OSError):  # a reader that went away must not end the other stops
            click.echo(f"{who}: {report.text}.")
        return 0
    complain(f"{who}: {report.text}")
    return await _why(session)


async def _why(session: DriveSession) -> int:
    """The status of a stop that failed: whether the drive answers at all."""
    from tui.bus.errors import DeviceException, LineError
    from tui.drive.chart import watched_codes

    try:
        await session.read(watched_codes(session.profile)[:1])
    except DeviceException:
        return DRIVE_REFUSED
    except LineError:
        return LINE_TROUBLE
    return DRIVE_REFUSED


async def _stop_all(
    opened: OpenLine, devices: Iterable[int], order: OrderId, profile_id: str | None
) -> int:
    """Stop each drive as soon as it is found; what one does holds up no other.

    Drives that say at once who they are come first: a silent address takes seconds to rule out.
    """
    from tui.session.journal import Journal
    from tui.session.stop import Stopper

    journal = Journal()
    stopper = Stopper(opened.line, journal)
    stops: list[asyncio.Task[int]] = []
    silent: list[int] = []
    worst = 0
    try:
        async for device in _soonest_first(opened, devices):
            found = await _found(opened, device, profile_id)
            if isinstance(found, int):
                worst = max(worst, found)
            elif found is None:
                silent.append(device)
            else:
                # a drive without the wished way is stopped all the same
                way: OrderId = order if has_order(found, order) else "stop"
                stops.append(asyncio.create_task(_seen_through(stopper, found, way)))
    finally:
        # whatever went wrong with the search: stops that were begun are seen through
        worst = max([worst, *await asyncio.gather(*stops)])
        journal.close()
    if silent:
        complain(f"No answer at {', '.join(map(str, silent))}.")
    return worst or (0 if stops else LINE_TROUBLE)


async def _soonest_first(opened: OpenLine, devices: Iterable[int]) -> AsyncIterator[int]:
    """Addresses, those where somebody answers one short question before all others."""
    from tui.bus.errors import LineError, NoAnswer
    from tui.bus.line import Priority

    later: list[int] = []
    for device in devices:
        try:
            await opened.line.identify(device, priority=Priority.OPERATOR_READ)
        except NoAnswer:
            later.append(device)
            continue
        except LineError:
            pass  # who it is, or what is wrong, is found out next
        yield device
    for device in later:
        yield device


async def _found(
    opened: OpenLine, device: int, profile_id: str | None
) -> DriveSession | int | None:
    """The drive at an address; None where nobody answers, a status where it cannot be stopped."""
    from tui.bus.errors import LineError, NoAnswer
    from tui.drive import library
    from tui.session.drive_session import DriveSession
    from tui.session.identify import identify

    try:
        identity = await identify(opened.line, device)
    except NoAnswer:
        return None
    except LineError as error:
        complain(f"Device {device}: NOT STOPPED: {error}")
        return LINE_TROUBLE
    profile = identity.profile or profile_id
    if profile is None:
        fits = ", ".join(identity.candidates) or "drivepanel profiles"
        complain(
            f"Device {device}: NOT STOPPED: it does not say who it is. Name its profile"
            f" with -p ({fits}), or stop it at the machine."
        )
        return DRIVE_REFUSED
    return DriveSession(opened.line, device, library.load(profile), identity)
