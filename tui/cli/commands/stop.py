"""`drivepanel stop`: stop one drive, or every drive of a line. Needs no arming."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import click

from tui.bus.api import LineStatus, ModbusLine, Priority
from tui.bus.errors import LineError, LineLost
from tui.drive.orders import INSTEAD, deciding_codes
from tui.session.connect.addresses import parse_addresses

from ..running.stop_following import ended, status_of_failed
from ..running.stop_targets import (
    StoppableDrive,
    StopWish,
    first_stopped,
    found_at,
    remembered,
)
from ..running.stop_telling import StopTelling
from ..shared.control import GIVE_BACK_OPTION, taking_of
from ..shared.drive_commands import carried_out, close_journal, complain, journal_document
from ..shared.errors import DRIVE_REFUSED, LINE_TROUBLE, REFUSED_HERE, Failure, end_with
from ..shared.left_behind import forget_start
from ..shared.options import (
    Target,
    drives_options,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.output import print_json
from ..shared.pending_timeouts import PolledDrive, look_after
from ..shared.registration import WRITING, command

if TYPE_CHECKING:
    from tui.drive.profile.schema import OrderId
    from tui.session.command.stop import Stopper
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

USUAL_ADDRESSES = "1-10"
SILENT_FOR = 4.0
"""Seconds without an answer to the first stop after which it is reported."""
NOT_ANSWERED = (
    "NOT STOPPED yet: device {device} has not answered for {seconds:g} s. The stop is repeated."
    " Stop it at the machine."
)
NAMES_NO_FAMILY = (
    "Device {}: NOT STOPPED: it does not identify itself. Name its profile with -p (see drivepanel"
    " profiles), or stop it at the machine."
)


@command("Stop one drive, or every drive on a line.", group="Run", statuses=WRITING, acts=True)
@line_argument
@drives_options
@click.option("--all", "every", is_flag=True, help="Stop every drive found on the line.")
@click.option(
    "--addresses",
    metavar="LIST",
    help=f"Scan these addresses with --all (default: {USUAL_ADDRESSES}).",
)
@click.option("--quick", is_flag=True, help="Stop by the drive's quick stop.")
@click.option("--freewheel", is_flag=True, help="Stop by freewheel: the motor coasts.")
@click.option(
    "--give-back",
    is_flag=True,
    help="Give control back to the terminals. Requires --arm.",
)
@click.option("--arm", is_flag=True, help="Arm the drive for --give-back; no stop needs it.")
@read_only_option
@json_option
def stop(
    target: Target,
    every: bool,
    addresses: str | None,
    quick: bool,
    freewheel: bool,
    give_back: bool,
    arm: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Stop a motor on its ramp and wait for standstill. Needs no arming."""
    if quick and freewheel:
        raise click.UsageError("Either --quick or --freewheel.")
    if addresses and not every:
        raise click.UsageError("--addresses requires --all.")
    if give_back and (every or target.others):
        raise click.UsageError("--give-back is for one drive, not for several.")
    if read_only:
        raise Failure("The line is read-only: nothing is written, not even a stop.", REFUSED_HERE)
    order: OrderId = "quick-stop" if quick else "freewheel" if freewheel else "stop"
    devices = _devices(addresses) if every else [item.device for item in target.each()]
    telling = StopTelling(target.line_text, as_json=as_json)

    async def work(opened: OpenLine) -> int:
        journal = journal_document()
        wish = StopWish(opened, target.profile_id, order, journal, telling)
        try:
            if every or target.others:
                status = await _stop_all(wish, devices)
                if status and opened.line.state.status is LineStatus.LOST:
                    complain(opened.line.state.reason)
                return status
            status, session = await _stop_one(wish, target.device)
        finally:
            close_journal(journal)
        if give_back and not status:
            telling.gave_back(await give_control_back(session, arm=arm))
        return status

    # the start of a keeper would hold up the stop
    worst = on_line(target, work, keeper=False)
    if as_json:
        several = every or len(target.each()) > 1
        print_json(telling.documents if several else telling.documents[0])
    end_with(worst)


def _devices(text: str | None) -> list[int]:
    return parse_addresses(text) if text is not None else []


def has_order(session: DriveSession, order: OrderId) -> bool:
    """Return True if the family has such an order at all."""
    charts = session.profile.data.charts
    return any(item.id == order for chart in charts for item in chart.orders)


@asynccontextmanager
async def silence_reported(line: ModbusLine, device: int) -> AsyncIterator[None]:
    """Report once, while this goes on, that a drive has not answered its stop."""
    begun = time.monotonic()

    async def warn() -> None:
        await asyncio.sleep(SILENT_FOR)
        heard = line.device_state(device).heard
        if heard is None or heard < begun:
            complain(NOT_ANSWERED.format(device=device, seconds=SILENT_FOR))

    warning = asyncio.create_task(warn())
    try:
        yield
    finally:
        warning.cancel()


async def _stop_one(wish: StopWish, device: int) -> tuple[int, DriveSession]:
    """Stop one drive: first by a word that stops every possible family, then by its own word.

    Returns the exit status and the session. Raises UsageError if no word is known that stops it,
    NoAnswer if it does not answer.
    """
    from tui.session.command.stop import Stopper

    before = (await remembered(wish.opened)).get(device)
    try:
        async with silence_reported(wish.opened.line, device):
            found = await first_stopped(wish, device, before)
    except LineLost as lost:
        raise LineLost(f"NOT STOPPED: {lost} Stop it at the machine.") from lost
    look_after(wish.opened, found.session, wish.opened.text)
    stopper = Stopper(wish.opened.line, wish.journal)
    return await _seen_through(stopper, found, wish), found.session


async def _seen_through(stopper: Stopper, found: StoppableDrive, wish: StopWish) -> int:
    """Stop a drive, report the result; returns the exit status."""
    from tui.session.command.motor_stop import with_other_way
    from tui.session.command.stop_report import Phase

    session, order, telling = found.session, wish.order, wish.telling
    # a drive without the requested kind of stop gets the ramp stop, and the result says so
    way: OrderId = order if order in INSTEAD or has_order(session, order) else "stop"
    stopper.stop([session], way, by="drivepanel stop")
    who = f"Device {session.device}, {found.name}"
    if session.guessed:
        who = f"Device {session.device}"
    report = await ended(stopper, session.device, lambda text: complain(f"{who}: {text}"))
    if telling.as_json:
        await PolledDrive(session, "", goes_on=True).learn()
    if report.phase is Phase.STOPPED:
        text = f"{who}: {with_other_way(report.text, order, way)}."
        telling.stopped(session, text, may_coast=report.may_coast)
        if not report.may_coast:
            await asyncio.to_thread(forget_start, session)
        return 0
    status = await status_of_failed(session)
    profile = None if session.guessed else session.profile.id
    telling.failed(session.device, profile, f"{who}: {report.text}", status)
    return status


async def _stop_all(wish: StopWish, named: Sequence[int]) -> int:
    """Stop each drive as soon as it is found; what one does holds up no other.

    Every address is first asked once, shortly, before any is asked with patience: a silent one
    takes seconds to rule out, and meanwhile motors turn. A silent address is a failure where a
    drive is known to be there: named, simulated, or started from here. It has all patience, as
    one has that says anything; others are asked once more, as a search does. Where its family is
    named, too, it is sent the stop word although it is silent: perhaps it hears.
    """
    from tui.session.command.stop import Stopper

    opened, telling = wish.opened, wish.telling
    stopper = Stopper(opened.line, wish.journal)
    stops: list[asyncio.Task[int]] = []
    started = await remembered(opened)
    devices = named or sorted({*(opened.devices or _devices(USUAL_ADDRESSES)), *started})
    expected = set(named) or {*opened.devices, *started}
    # motors that were started from here turn most likely
    left = sorted(devices, key=lambda device: device not in started)
    likely = set(expected)
    worst = 0
    found: StoppableDrive | None
    try:
        for patient in (False, True):
            requested, left = left, []
            for device in requested:
                patience = Priority.BACKGROUND
                if patient:
                    patience = Priority.OPERATOR_READ if device in likely else Priority.PATIENT
                before = started.get(device)
                blind = device in expected and (wish.profile_id or before) is not None
                try:
                    if patient and blind:
                        found = await first_stopped(wish, device, before)
                    else:
                        found = await found_at(wish, device, before, patience)
                except Failure as failure:
                    telling.failed(device, None, failure.message, failure.status)
                    worst = max(worst, failure.status)
                    continue
                except click.UsageError:
                    telling.failed(device, None, NAMES_NO_FAMILY.format(device), DRIVE_REFUSED)
                    worst = max(worst, DRIVE_REFUSED)
                    continue
                except LineError:
                    likely.add(device)
                    found = None
                if found is None:
                    left.append(device)
                    continue
                look_after(opened, found.session, opened.text)
                stops.append(asyncio.create_task(_seen_through(stopper, found, wish)))
    finally:
        # whatever went wrong with the search: stops that were begun are seen through
        worst = max([worst, *await asyncio.gather(*stops)])
    if missing := sorted(expected.intersection(left)):
        telling.silent(missing, LINE_TROUBLE)
        worst = max(worst, LINE_TROUBLE)
    if empty := sorted(set(left) - expected):
        telling.silent(empty, 0)
    return worst or (0 if stops else LINE_TROUBLE)


WAITS = "a run command that waits at the terminals starts the motor"


async def give_control_back(session: DriveSession, *, arm: bool) -> str:
    """Give it back; the motor was stopped before. Its result; raises Failure."""
    from tui.session.command.commander import Commander
    from tui.session.read.reader import Reader

    await Reader(session).read(deciding_codes(session.profile))
    found = taking_of(session)
    if found is None or not found.can_give_back:
        raise Failure(f"{session.profile.name} has no control to give back.", REFUSED_HERE)
    if not arm:
        raise Failure(
            f"Not given back: {WAITS}. Check the machine, then {GIVE_BACK_OPTION}.", REFUSED_HERE
        )
    journal = journal_document()
    try:
        session.arming.arm(seconds=math.inf)
        commander = Commander(session, journal)
        outcome = await carried_out(commander, lambda: commander.order("hand-back"))
        return f"Device {session.device}, {outcome.text}."
    finally:
        session.arming.disarm()
        close_journal(journal)
