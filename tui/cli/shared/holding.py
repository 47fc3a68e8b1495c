"""Keeps polling drives so that they do not time out: --hold and hold."""

from __future__ import annotations

import asyncio
import math
import sys
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import ExitStack, asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import click

from tui.session.running.ending import Ending
from tui.session.signals import BY_SIGNAL

from .drive_commands import complain

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.monitor.look import Look

    from ..documents.drive_documents import HoldEvent

Tell = Callable[["HoldEvent", int, str], None]
"""Is given an event, a device and a sentence."""

HOLD_POLL_INTERVAL = 0.2
_IN_FAULT = "Device {device} is in fault: {fault}."
_NO_FAULT = "Device {device} is no longer in fault."


@dataclass(slots=True)
class Holding:
    """Drives that are kept polled, from the moment each is found."""

    fleet: Fleet
    tell: Tell
    lost: set[int] = field(default_factory=set)
    faults: dict[int, str] = field(default_factory=dict)
    """The fault that each drive was last seen in; empty for none."""

    def take(self, session: DriveSession) -> None:
        """Keep polling a drive from now on."""
        self.fleet.take(session)

    async def until(self, ending: Ending, seconds: float | None = None) -> None:
        """Go on until the command is to end, at most so many seconds."""
        loop = asyncio.get_running_loop()
        end = math.inf if seconds is None else loop.time() + seconds
        while not ending.event.is_set() and loop.time() < end:
            self.look()
            with suppress(TimeoutError):
                left = min(HOLD_POLL_INTERVAL, max(0.0, end - loop.time()))
                await asyncio.wait_for(ending.event.wait(), left)

    def look(self) -> None:
        """Report changes: drives that do not answer, or do again, and faults."""
        looks = self.fleet.line_watch.looks
        for device, look in looks.items():
            self._compare(device, look)

    def _compare(self, device: int, look: Look) -> None:
        if look.error:
            if device not in self.lost:
                self.lost.add(device)
                self.tell("lost", device, f"{look.error} Retrying.")
            return
        if device in self.lost:
            self.lost.discard(device)
            self.tell("back", device, f"Device {device} answers again.")
        fault = look.state.fault if look.state else None
        text = f"{fault.code}, {fault.name}" if fault else ""
        before = self.faults.get(device)
        self.faults[device] = text
        if text != (before or "") and (text or before):
            now = _IN_FAULT if text else _NO_FAULT
            self.tell("fault", device, now.format(device=device, fault=text))


async def hold_on(
    opened: OpenLine, sessions: Sequence[DriveSession], seconds: float | None
) -> None:
    """Keep polling drives for this many seconds; None returns immediately.

    Raises Exit with 128 plus the number of a signal that ended it earlier.
    """
    await hold_lines_on([("", opened, sessions)], seconds)


async def hold_lines_on(
    lines: Sequence[tuple[str, OpenLine, Sequence[DriveSession]]], seconds: float | None
) -> None:
    """The same for drives of several lines, each with what the line is called."""
    if seconds is None:
        return
    sys.stdout.flush()  # what was printed is for now, whoever reads it
    ending = Ending()
    with ending.by_signals(), ExitStack() as stack:
        held = []
        for name, opened, sessions in lines:
            holding = stack.enter_context(_polling(opened, partial(_complain, name)))
            for session in sessions:
                holding.take(session)
            held.append(holding.until(ending, seconds))
        await asyncio.gather(*held)
    _exit_by_signal(ending)


@asynccontextmanager
async def keep_polling(opened: OpenLine, tell: Tell) -> AsyncIterator[tuple[Holding, Ending]]:
    """The poller of drives, and its end by a signal.

    Raises Exit with 128 and the number of the signal, once the block has ended.
    """
    ending = Ending()
    with ending.by_signals(), _polling(opened, tell) as holding:
        yield holding, ending
    _exit_by_signal(ending)


@contextmanager
def _polling(opened: OpenLine, tell: Tell) -> Iterator[Holding]:
    """Keeps polling the drives of a line until the block ends."""
    from tui.session.fleet import Fleet
    from tui.session.journal import Journal

    fleet = Fleet(opened.line, Journal())
    try:
        yield Holding(fleet, tell)
    finally:
        fleet.forget()


def _exit_by_signal(ending: Ending) -> None:
    if ending.number:
        raise click.exceptions.Exit(BY_SIGNAL + ending.number)


def _complain(line_name: str, _event: HoldEvent, _device: int, text: str) -> None:
    complain(f"{line_name}: {text}" if line_name else text)
