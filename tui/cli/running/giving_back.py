"""Giving the control of a stopped drive back to its terminals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..commands.orders import carried_out, close_journal, journal_document
from ..shared.control import GIVE_BACK_OPTION, taking_of
from ..shared.errors import REFUSED_HERE, Failure

if TYPE_CHECKING:
    from tui.session.drive import DriveSession

WAITS = "a run command that waits at the terminals starts the motor"


async def give_control_back(session: DriveSession, *, arm: bool) -> str:
    """Give it back; the motor was stopped before. Its result; raises Failure."""
    from tui.drive.orders import deciding_codes
    from tui.session.command.commander import Commander
    from tui.session.read.reader import Reader

    if not arm:
        raise Failure(
            f"Not given back: {WAITS}. Look at the machine first, then {GIVE_BACK_OPTION}.",
            REFUSED_HERE,
        )
    await Reader(session).read(deciding_codes(session.profile))
    found = taking_of(session)
    if found is None or not found.can_give_back:
        raise Failure(f"{session.profile.name} has no control to give back.", REFUSED_HERE)
    journal = journal_document()
    try:
        session.arming.arm(seconds=math.inf)
        commander = Commander(session, journal)
        outcome = await carried_out(commander, lambda: commander.order("hand-back"))
        return f"Device {session.device}, {outcome.text}."
    finally:
        session.arming.disarm()
        close_journal(journal)
