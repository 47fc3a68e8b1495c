"""Care for drives: motors while a command holds the line, and their reaction at its end."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine

MOTORS_STOP_WITHIN = 60.0
"""Seconds that a command waits at its end for motors of other programs to stop."""
GUARD_LOOK_INTERVAL = 0.05


def guard_motors(opened: OpenLine, name: str = "") -> Callable[[], None]:
    """Stop the motors of programs that exit, while this one owns the line.

    Reports why this program holds the line instead of a keeper, if it does.

    `name` is the name of the line if a command has several. Call the returned function before the
    line is closed: it waits until those motors are stopped.
    """
    # imported now: the package may be replaced by an upgrade before this program holds the line
    from tui.bus.line_events import LineEvent, NoticeReceived
    from tui.session.journal import Journal
    from tui.session.sharing.orphan_motors import OrphanMotorGuard

    guardian, facts = OrphanMotorGuard(opened.line, Journal()), opened.line.facts
    tell = partial(_tell, f"{name}: " if name else "")

    def hear(event: LineEvent) -> None:
        if isinstance(event, NoticeReceived):
            tell(event.device, event.text)

    facts.events.subscribe(hear)
    if facts.unkept:
        tell(0, facts.unkept)

    def end() -> None:
        limit = time.monotonic() + MOTORS_STOP_WITHIN
        while guardian.busy and time.monotonic() < limit:
            time.sleep(GUARD_LOOK_INTERVAL)

    return end


def say_shared(opened: OpenLine, name: str = "") -> None:
    """Say which other programs are on a line, if there are any."""
    line = opened.line
    if line.facts.voice is not None and line.facts.others:
        _tell(f"{name}: " if name else "", 0, line.state.reason)


def _tell(where: str, device: int, text: str) -> None:
    drive = f"drive {device}: " if device else ""
    say(f"drivepanel: {where}{drive}{text}", err=True)


T = TypeVar("T")


async def to_its_end(lines: Sequence[OpenLine], work: Callable[[], Coroutine[Any, Any, T]]) -> T:
    """Do the work; in any case, report the reactions of drives when polling stops.

    Raises Exit with 128 plus the number of a signal that ended it. A signal after the work ends
    only these reports.
    """
    from tui.session.signals import BY_SIGNAL

    from .pending_timeouts import say_farewells
    from .signals import cancelled_by_signal

    task = asyncio.current_task()
    assert task is not None
    with cancelled_by_signal(task) as came:
        try:
            return await work()
        except asyncio.CancelledError:
            if not came:
                raise
            raise click.exceptions.Exit(BY_SIGNAL + came[0]) from None
        finally:
            try:
                await asyncio.gather(*(say_farewells(line) for line in lines))
            except asyncio.CancelledError:
                # the result of the work, or its error, is reported anyway
                if not came:
                    raise
