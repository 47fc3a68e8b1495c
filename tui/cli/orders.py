"""`drivepanel reference` and `reset`, and what every command that gives orders needs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from tui.session.command import Commander, Kind, Outcome

from .errors import DRIVE_REFUSED, LINE_TROUBLE, REFUSED_HERE, Failure, status_of, told
from .options import Target, connect, drive_options, line_argument, on_line, read_only_option

if TYPE_CHECKING:
    from tui.session.drive_session import DriveSession
    from tui.session.journal import Journal
    from tui.session.keeper import Keeper, Watch
    from tui.session.lines import OpenLine
    from tui.session.monitor import Snapshot
    from tui.session.stop import Stopper

LOOK = 0.02
"""Seconds between two looks at what the line's thread has come to."""
PERIOD = 0.25
"""Wished time of a cycle of the monitor in seconds."""
FIRST_TRIES = 3
"""Cycles that may fail before the drive counts as silent."""
LEARNT_WITHIN = 3.0
"""Seconds in which a drive's watch over the line is read."""
FAULT_GONE_WITHIN = 3.0
"""Seconds that a drive may take to leave its fault after a reset."""

arm_option = click.option(
    "--arm", is_flag=True, help="Let this command write to the drive; without it nothing is."
)


def complain(text: str) -> None:
    """Say something on standard error, if anybody is there: what is under way goes on."""
    with suppress(OSError):
        click.echo(f"drivepanel: {text}", err=True)


@dataclass(frozen=True, slots=True)
class Desk:
    """One drive with all that commands it and looks after it."""

    session: DriveSession
    commander: Commander
    stopper: Stopper
    keeper: Keeper
    journal: Journal

    @property
    def moved(self) -> bool:
        """Whether an order was sent, answered or not; a reference alone moves nothing."""
        return any(not entry.why.startswith("reference") for entry in self.journal.recent)

    @property
    def latest(self) -> Snapshot:
        """The last cycle of the monitor."""
        latest = self.session.monitor.latest
        assert latest is not None, "a desk is handed out after the first cycle"
        return latest


@asynccontextmanager
async def desk_of(opened: OpenLine, target: Target) -> AsyncIterator[Desk]:
    """The wanted drive, watched and fed, its state known.

    Raises Failure where it does not answer, and what `connect` raises.
    """
    from tui.session.journal import Journal
    from tui.session.keeper import Keeper
    from tui.session.stop import Stopper

    from .status import shown_codes

    session = await connect(opened, target)
    journal, keeper = Journal(), Keeper(opened.line)
    desk = Desk(
        session,
        Commander(session, journal),
        Stopper(opened.line, journal),
        keeper,
        journal,
    )
    session.monitor.start(period=PERIOD, extra=shown_codes(session.profile))
    keeper.keep(session)
    try:
        await _first_look(session)
        yield desk
    finally:
        keeper.stop()
        session.close()
        journal.close()


async def _first_look(session: DriveSession) -> None:
    while True:
        latest = session.monitor.latest
        if latest is not None and not latest.error:
            return
        if latest is not None and latest.cycle >= FIRST_TRIES:
            raise Failure(latest.error, LINE_TROUBLE)
        await asyncio.sleep(LOOK)


async def carried_out(commander: Commander, give: Callable[[], None]) -> Outcome:
    """Give an order and wait for what becomes of it.

    Raises OrderRefused where it is not even begun; Failure where it is refused, with the status
    of who refused it: 5 here, 4 the drive, 3 no answer.
    """
    commander.outcome = None
    give()
    orders = commander.session.orders
    await _until(lambda: commander.outcome is not None or not orders.busy)
    outcome = commander.outcome
    if outcome is None:
        raise Failure("The order was not sent: a newer one took its place.", REFUSED_HERE)
    if outcome.kind is Kind.REFUSED:
        raise Failure(outcome.text, _status(outcome.error))
    return outcome


async def _until(holds: Callable[[], bool]) -> None:
    """Look until something holds that the line's thread brings about."""
    while True:
        if holds():
            return
        await asyncio.sleep(LOOK)


def _status(error: Exception | None) -> int:
    return REFUSED_HERE if error is None else status_of(error) or REFUSED_HERE


def need_arming(arm: bool, does: str) -> None:
    """Raise Failure where --arm was not given; `does` says what the command does to the drive."""
    if not arm:
        raise Failure(
            f"Not armed: {does}.\n--arm lets this one command write to this one drive. Look at the"
            " machine first, then add it.",
            REFUSED_HERE,
        )


async def watch_of(desk_session: DriveSession, keeper: Keeper) -> Watch | None:
    """A kept drive's watch over the line; None where it has none, or it is off.

    Raises Failure where it could not be learnt.
    """
    rules = desk_session.profile.data.communication_fault
    if rules is None or not rules.timeout:
        return None
    readings = await desk_session.read([rules.timeout])
    raw = readings[rules.timeout].raw
    if raw is None or raw in (rules.off, 0):
        return None
    end = asyncio.get_running_loop().time() + LEARNT_WITHIN
    while (watch := keeper.watch(desk_session.device)) is None:
        if asyncio.get_running_loop().time() > end:
            raise Failure(f"{rules.timeout} is set and could not be learnt.", LINE_TROUBLE)
        await asyncio.sleep(LOOK)
    return watch


def left_alone(session: DriveSession, watch: Watch | None) -> str:
    """What the drive does when nobody asks it any more, in a sentence."""
    does = "goes on running: it does not watch the line"
    if watch is not None:
        reaction = watch.reaction.does if watch.reaction else "its own reaction follows"
        does = f"acts {watch.timeout:g} s after the last request: {reaction}"
    who = f"Device {session.device}, {session.profile.name}"
    return f"{who}: left alone it {does.rstrip('.')}."


def _ordered(
    target: Target, read_only: bool, work: Callable[[Desk], Coroutine[Any, Any, str]]
) -> None:
    """Do the work at the armed drive and print what it came to."""

    async def at_desk(opened: OpenLine) -> str:
        async with desk_of(opened, target) as desk:
            desk.commander.arm()
            return await work(desk)

    click.echo(on_line(target.line_text, at_desk, read_only=read_only))


@click.command()
@line_argument
@click.argument("text", metavar="REFERENCE")
@drive_options
@arm_option
@read_only_option
@told
def reference(
    target: Target,
    text: str,
    arm: bool,
    read_only: bool,
) -> None:
    """Give a drive its reference: 30, 30.5Hz, 900rpm. Starts no motor."""
    need_arming(arm, "reference writes the drive's reference; a running motor follows it")

    async def work(desk: Desk) -> str:
        commander = desk.commander
        return (await carried_out(commander, lambda: commander.refer(text))).text

    _ordered(target, read_only, work)


@click.command()
@line_argument
@drive_options
@arm_option
@read_only_option
@told
def reset(
    target: Target,
    arm: bool,
    read_only: bool,
) -> None:
    """Reset a drive's fault. Its cause must be gone; starts no motor."""
    need_arming(arm, "reset writes the drive's command word and ends its fault")

    async def work(desk: Desk) -> str:
        outcome = await carried_out(desk.commander, lambda: desk.commander.order("reset"))
        await _out_of_fault(desk, outcome)
        return f"{outcome.text.partition(':')[0]}: {desk.latest.state.headline}"

    _ordered(target, read_only, work)


async def _out_of_fault(desk: Desk, outcome: Outcome) -> None:
    """Wait until the drive shows no fault any more; raises Failure where it stays in it."""
    end = outcome.time + FAULT_GONE_WITHIN
    while True:
        latest = desk.latest
        fresh = latest.time > outcome.time and not latest.error
        if fresh and latest.state.kind not in ("fault", "unknown", "starting"):
            return
        if latest.time > end:
            break
        await asyncio.sleep(LOOK)
    if latest.error:
        raise Failure(latest.error, LINE_TROUBLE)
    raise Failure(
        f"The drive stays in {latest.state.headline}: its cause is not gone. Look at the machine.",
        DRIVE_REFUSED,
    )
