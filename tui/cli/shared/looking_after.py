"""A command that owns a line looks after the motors of programs that share it and are gone."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from .say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine


MOTORS_STOP_WITHIN = 60.0
"""Seconds that a command waits at its end for motors of other programs to stop."""
GUARD_LOOK_INTERVAL = 0.05


def guard_motors(opened: OpenLine, name: str = "") -> Callable[[], None]:
    """From now on stop the motors of a program that is gone, as far as this one owns the line.

    Says why this program holds the line in place of a keeper, if it does.

    `name` is what the line is called where a command has several. Returns what waits until those
    motors are stopped, before the line is closed.
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
