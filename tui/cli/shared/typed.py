"""Time at which a command was typed: a later stop overrides it."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

import click

from .errors import REFUSED_HERE, Failure

if TYPE_CHECKING:
    from tui.session.drive import DriveSession

ONE_COMMAND = object()
"""The `obj` of a context whose process runs this command only."""
_TYPED = "drivepanel.typed"


def note_typed(context: click.Context) -> None:
    """Record that a command was typed now."""
    context.meta[_TYPED] = time.monotonic()


def typed_at(context: click.Context) -> float | None:
    """Time at which a command was typed (monotonic); None if it is not known."""
    if context.obj is ONE_COMMAND:
        return process_began()
    found: float | None = context.meta.get(_TYPED)
    return found


def process_began() -> float:
    """Start of this process (monotonic); the current time if it is not known.

    A busy computer may load the program for seconds after it was typed.
    """
    from tui.session.starts.processes import Processes

    now = time.monotonic()
    try:
        ticks = int(Processes().started(os.getpid()) or "")
        boot: int = getattr(time, "CLOCK_BOOTTIME")  # noqa: B009 - Linux only
        age = time.clock_gettime(boot) - ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, AttributeError):
        return now
    return now - max(0.0, age)


_STOPPED = "Device {device}: it was stopped after this command was typed."
_STOPPED_BY = "Device {device}: it was stopped after this command was typed ({by})."


def refuse_if_stopped(session: DriveSession) -> None:
    """Raise Failure if the drive was stopped after this command was typed.

    Such a stop could cancel nothing, because the command had not reached the line yet.
    """
    context, device = click.get_current_context(silent=True), session.device
    stops = session.line.facts.stops
    if context is None or (stopped := stops.times.get(device)) is None:
        return
    if (typed := typed_at(context)) is None or stopped <= typed:
        return
    session.arming.disarm()
    by = stops.by.get(device, "")
    text = (_STOPPED_BY if by else _STOPPED).format(device=device, by=by)
    raise Failure(f"{text} Nothing was sent. Type it again if it is meant.", REFUSED_HERE)
