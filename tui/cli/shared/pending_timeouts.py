"""Reaction of drives when a command stops polling them: their communication timeout."""

from __future__ import annotations

import asyncio
import logging
import shlex
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tui.drive.sentences import sentence
from tui.session.clock import patience

from .say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.timeout_report import Timeout, TimeoutWatch

    from ..documents.document import TimeoutField
    from ..documents.parts import OldTimeoutField

TIMEOUT_READ_WITHIN = 3.0
"""Seconds in which a drive reports its timeout at the end of a command, on a quick line."""

log = logging.getLogger(__name__)


@dataclass(slots=True)
class PolledDrive:
    """A drive that a command polls, and its reaction when polling stops."""

    session: DriveSession
    line_text: str
    goes_on: bool
    """False for a simulated drive, which ends with its line."""

    async def learn(self) -> None:
        """Read the drive's timeout, unless it is known; no answer fails nothing."""
        from tui.bus.api import Priority
        from tui.bus.errors import LineError
        from tui.session.monitor.timeout import read_timeout
        from tui.session.read.presence import meets_silence
        from tui.session.read.reader import Reader
        from tui.session.timeout_report import Timeout

        session = self.session
        heard = session.line.device_state(session.device).heard is not None
        if not heard or (session.timeout is not None and session.timeout.known):
            return
        session.timeout = Timeout(known=False)
        with suppress(LineError, TimeoutError):
            # without a repeat where a word that is not there meets silence: the drive waits, too
            once = meets_silence(session.profile)
            priority = Priority.POLL if once else Priority.OPERATOR_READ
            reading = read_timeout(Reader(session), priority)
            within = patience(session.line, TIMEOUT_READ_WITHIN)
            session.timeout = await asyncio.wait_for(reading, within)

    async def tell(self) -> None:
        """Report on standard error a timeout that runs, and the reaction."""
        from tui.session.monitor.timeout import timeout_now

        session = self.session
        heard = session.line.device_state(session.device).heard is not None
        if not heard or not self.goes_on or session.profile.data.communication_fault is None:
            return
        if session.arming.times:
            session.timeout = None  # it may have been written
        await self.learn()
        if text := timeout_warning(session, timeout_now(session), self.line_text):
            with suppress(OSError):
                say(f"drivepanel: {text}", err=True)


BEGINS_WITH_A_COMMAND = (
    "It begins with the first command or reference; it is not known if there was one."
)
_RUNS = (
    "{drive}: its communication timeout {code} runs. After {timeout:g} s without a request:"
    " {reaction}"
)
_RUNS_UNSURE = (
    "{drive}: its communication timeout {code} may run: no document states when it begins. After"
    " {timeout:g} s without a request: {reaction}"
)
_MAY_HAVE_BEGUN = (
    "{drive}: its communication timeout {code} may run: it begins with the first command or"
    " reference. After {timeout:g} s without a request: {reaction}"
)


def timeout_warning(session: DriveSession, found: Timeout, line_text: str) -> str:
    """Return a drive's reaction when polling stops, and the advice; empty if none."""
    who = f"Device {session.device}, {session.profile.name}"
    if not found.known:
        return (
            f"{who}: its communication timeout cannot be read; it may react when polling stops."
            f"\nTo keep polling it: {hold_text(session, line_text)}."
        )
    watch = found.watch
    if watch is None or watch.begun is False:
        return ""
    if watch.begun is None and not session.arming.times:
        # a command that only reads begins nothing: if another master began it, that one polls
        return ""
    does = sentence(watch.reaction.does) if watch.reaction else "Its own reaction follows."
    runs = _MAY_HAVE_BEGUN if watch.begun is None else _RUNS if watch.sure else _RUNS_UNSURE
    text = runs.format(drive=who, code=watch.code, timeout=watch.timeout, reaction=does)
    text = f"{text}\nTo keep polling it: {hold_text(session, line_text)}."
    reset = drive_command("reset", session, line_text)
    return f"{text} After a trip: {reset}." if watch.trips else text


def hold_text(session: DriveSession, line_text: str) -> str:
    """The command that keeps polling a drive."""
    return drive_command("hold", session, line_text)


def drive_command(name: str, session: DriveSession, line_text: str) -> str:
    """Return a complete command for a drive, as a person types it."""
    words = ["drivepanel", name, shlex.quote(line_text), "-d", str(session.device)]
    if session.known_identity.profile != session.profile.id:
        words += ["-p", session.profile.id]
    return " ".join([*words, *(["--arm"] if name == "reset" else [])])


def timeout_field(found: Timeout) -> TimeoutField | None:
    """The object `timeout` of every command: null where a drive has none or it is off.

    Its fields are null if the drive does not report it.
    """
    from ..documents.document import TimeoutField

    if not found.known:
        return TimeoutField(seconds=None, reaction=None, fault=None, begun=None)
    if (watch := found.watch) is None:
        return None
    return TimeoutField(
        seconds=watch.timeout,
        reaction=watch.reaction.name if watch.reaction else None,
        fault=watch.fault or None,
        begun=watch.begun,
    )


def watch_field(watch: TimeoutWatch | None) -> OldTimeoutField | None:
    """A drive's watch over the line; null where it has none."""
    from ..documents.parts import OldTimeoutField

    if watch is None:
        return None
    return OldTimeoutField(
        timeout_s=watch.timeout,
        reaction=watch.reaction.name if watch.reaction else None,
        does=watch.reaction.does if watch.reaction else None,
        begun=watch.begun,
    )


def watch_text(watch: TimeoutWatch | None) -> str:
    """Return a drive's reaction to loss of communication, for a person."""
    if watch is None:
        return "none: it goes on without communication"
    if watch.reaction is not None and not watch.acts:
        return f"off ({watch.reaction.name}): it goes on without communication"
    reaction = sentence(watch.reaction.does) if watch.reaction else "Its own reaction follows."
    text = f"{watch.timeout:g} s. {reaction}"
    return text if watch.active else f"{text} {BEGINS_WITH_A_COMMAND}"


def look_after(opened: OpenLine, session: DriveSession, line_text: str) -> PolledDrive:
    """Report the drive's reaction to the end of polling when the command ends."""
    found = PolledDrive(session, line_text, goes_on=opened.simulation is None)
    opened.farewells[session.device] = found
    return found


async def say_farewells(opened: OpenLine) -> None:
    """Report the reaction of each polled drive, while the line is open."""
    for device, farewell in list(opened.farewells.items()):
        if device in opened.line.pace.others:
            log.info("device %s is polled by another program on the line", device)
        else:
            await farewell.tell()
