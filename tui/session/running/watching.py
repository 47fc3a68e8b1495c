"""Preparation of a command: the drive's state and its communication timeout are read."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

from tui.bus.errors import LineError
from tui.drive.errors import DriveError
from tui.drive.orders import OrderRefused

from ..clock import patience
from ..work import Outcome, OutcomeKind

if TYPE_CHECKING:
    from ..command.commander import Commander
    from ..console import DriveConsole
    from ..fleet import Fleet
    from ..monitor.snapshot import Snapshot
    from ..timeout_report import TimeoutWatch

COMMAND_POLL_INTERVAL = 0.02
"""Seconds between two checks of the work in the line's thread."""
WATCH_PERIOD = 0.25
"""Target cycle time of the monitor in seconds."""
FIRST_TRIES, FIRST_WITHIN = 3, 5.0
"""Cycles that may fail, and seconds, before the drive counts as silent. Some drives do not answer
reads of words that they lack."""
LEARNT_WITHIN = 10.0
"""Seconds in which a drive's communication timeout is read on a fast line. Some drives do not
answer reads of words that they lack, and a small computer is slow."""


class NotLearned(LineError):
    """A drive's communication timeout was not read in time."""


def latest_of(console: DriveConsole) -> Snapshot:
    """Return the last cycle of a polled drive."""
    latest = console.latest
    assert latest is not None, "a console is handed out after the first cycle"
    return latest


async def first_cycle(console: DriveConsole) -> None:
    """Wait until the state of a watched drive is known. Raises LineError if it does not answer."""
    loop = asyncio.get_running_loop()
    end = loop.time() + FIRST_WITHIN
    while True:
        latest = console.latest
        tried = latest is not None and latest.cycle >= FIRST_TRIES
        if latest is not None and not latest.error and (latest.state.kind != "unknown" or tried):
            return  # the word that selects the chart may be read one cycle later
        if latest is not None and tried and loop.time() > end:
            raise LineError(latest.error)
        await asyncio.sleep(COMMAND_POLL_INTERVAL)


async def learned_timeout(fleet: Fleet, console: DriveConsole) -> TimeoutWatch | None:
    """Return the communication timeout of a drive that is kept alive; None if it has none, or it is
    off.

    Raises NotLearned.
    """
    rules = console.session.profile.data.communication_fault
    if rules is None or not rules.timeout:
        return None
    within = patience(console.session.line, LEARNT_WITHIN)
    end = asyncio.get_running_loop().time() + within
    while console.session in fleet.line_watch.unread():
        if asyncio.get_running_loop().time() > end:
            raise NotLearned(
                f"The communication timeout {rules.timeout} of device {console.device} could not be"
                " read in time."
            )
        await asyncio.sleep(COMMAND_POLL_INTERVAL)
    return fleet.line_watch.watch(console.device)


async def outcome_of(commander: Commander, give: Callable[[], None]) -> Outcome | None:
    """Send a command and wait for its outcome; None if a newer command superseded it.

    Raises OrderRefused if it is not started.
    """
    work = commander.session.work
    before = work.outcome
    give()
    while True:
        outcome = work.outcome if work.outcome is not before else None
        if not work.busy_for(commander):
            # the last look: it may have ended since
            return work.outcome if work.outcome is not before else None
        if outcome is not None and outcome.kind is not OutcomeKind.WORKING:
            return outcome
        await asyncio.sleep(COMMAND_POLL_INTERVAL)


async def outcome_or_error(commander: Commander, give: Callable[[], None]) -> Outcome:
    """Send a command and return its outcome. Raises DriveError and the line's errors."""
    outcome = await outcome_of(commander, give)
    if outcome is None:
        raise OrderRefused("Not sent: superseded by a newer command.")
    if outcome.kind is OutcomeKind.REFUSED:
        error = outcome.error
        raise error if isinstance(error, LineError | DriveError) else DriveError(outcome.text)
    return outcome
