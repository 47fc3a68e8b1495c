"""The proof of communication loss from Control: what is set, the question, the work."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from rich.text import Text

from tui.bus.errors import LineClosed
from tui.bus.link import SerialLink
from tui.session.drive import DriveSession
from tui.session.proof.prover import Prover
from tui.session.proof.result import proof_entry
from tui.session.timeout_report import TimeoutWatch
from tui.session.work import OutcomeKind, Permit, Task
from tui.widgets.drawing import wrapped
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG

if TYPE_CHECKING:
    from tui.session.console import DriveConsole
    from tui.session.fleet import Fleet

HOW_IT_IS_PROVED = (
    "Polling pauses for longer and longer, around its timeout, until the drive reacts: then it is"
    " in a fault, which x on Monitor resets. It takes about {seconds:.0f} s."
)
PROOF_ON_THE_RUN = (
    "THE MOTOR TURNS: it does what is set, and may coast; a hoist falls. A stop is sent when the"
    " test ends, and at any stop key. "
)
TIMEOUTS_A_PROOF_TAKES = 4.6
"""Timeouts that a proof takes where the drive reacts as set."""


def silence_line(
    session: DriveSession, watch: TimeoutWatch | None, proved: str, width: int
) -> Text:
    """Return the drive's timeout reaction, whether it was tested, and how the drive is reached."""
    rules, link = session.profile.data.communication_fault, session.line.link
    reported = Text("  Timeout       ", FAINT, no_wrap=True)
    if rules is None:
        reported.append("no communication timeout is known", PLAIN)
    elif watch is None:
        reported.append(f"{rules.timeout or 'timeout'} off, or not read yet", ALARM)
    else:
        does = watch.reaction.name if watch.reaction else "its own reaction"
        reported.append(f"{rules.timeout} {watch.timeout:g} s, then ", STRONG)
        reported.append(does, STRONG if watch.trips else ALARM)
        reported.append(f" · {proved or 'not tested'}", PLAIN if proved else FAINT)
    reported.append(f" · address {session.device}", FAINT)
    if isinstance(link, SerialLink):
        reported.append(f" · {link.baud} {link.format}", FAINT)
    reported.truncate(width, overflow="ellipsis")
    return reported


def warning_lines(session: DriveSession, width: int) -> list[Text]:
    """Return the family's warnings about loss of communication."""
    rules = session.profile.data.communication_fault
    lines = []
    for warning in rules.warnings if rules else ():
        for at, line in enumerate(wrapped(warning, width - 7, 3)):
            text = Text(no_wrap=True)
            text.append("     " if at else "   ! ", ALARM)
            lines.append(text.append(line, FAINT))
    return lines


def ask_to_prove(
    ask: Callable[[str, str, str, str, Callable[[int], object]], object],
    session: DriveSession,
    watch: TimeoutWatch | None,
    *,
    turning: bool,
    work: Callable[..., None],
) -> None:
    """Ask whether it is proved now; a motor that turns is named."""
    seconds = TIMEOUTS_A_PROOF_TAKES * watch.timeout if watch is not None else 0.0
    how = (
        HOW_IT_IS_PROVED.format(seconds=seconds)
        if watch is not None
        else HOW_IT_IS_PROVED.partition(" It takes")[0]
    )
    ask(
        f"Prove the communication loss of drive {session.device}?",
        (PROOF_ON_THE_RUN if turning else "") + how,
        "Test",
        "Cancel",
        partial(work, turning=turning),
    )


def begin_proof(fleet: Fleet, console: DriveConsole, stamp: int, *, turning: bool) -> None:
    """Hand the proof to the drive's queue of work. Raises OrderRefused."""
    session, working = console.session, "Communication loss test: polling is paused."

    async def carry_out(permit: Permit) -> str:
        def tell(text: str) -> None:
            # in the place of what is told of the work, which stands before all that was said
            session.work.tell(OutcomeKind.WORKING, f"Test: {text} Polling is paused.")

        prover = Prover(session, console.journal, permit, turning, tell)
        try:
            result = await prover.prove()
            console.journal.add(proof_entry(session, result))
            console.proved = result.short
            text = f"Test: {result.text} {result.changed}".rstrip()
            if turning:
                # before the stop, which ends this work
                fleet.events.add("done" if result.as_set else "failed", text, session.device)
        finally:
            if turning and permit.stamp == session.work.stops:
                with suppress(LineClosed):
                    fleet.stop([session], by="the end of the proof")
        return "" if turning else text

    session.work.put(Task(carry_out, owner=console, working=working), stamp)
