"""A client's side of a shared line: hands this program's requests to the owner's queue."""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Callable, Coroutine
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import OWNER_SILENT, LineError, NotShared
from ..line_events import (
    ControlDenied,
    ControlRequested,
    DevicesStopped,
    DeviceWritten,
    LineEvent,
    NoteReceived,
    NoticeReceived,
)
from ..link import label
from ..model import LineState, LineStatus
from ..notes import NOTES_A_LOOK, LineNote
from ..schedule.inside import LineInside, Say
from ..shared_state import LinePublisher, SharedState, commanded_by
from .carried import Polled, error_from
from .heartbeat import Heartbeat
from .messages import (
    VERSION,
    Alive,
    Answer,
    AnyMessage,
    Armed,
    Claim,
    DriveRequested,
    Facts,
    Failed,
    Goodbye,
    Hello,
    News,
    NoMessage,
    Notified,
    PollPause,
    PollWish,
    RequestDenied,
    RequestGranted,
    StopGiven,
    TurnedAway,
    Welcome,
    next_message,
    packed,
)
from .owner_watch import WATCH_INTERVAL, OwnerWatch, is_stop
from .place import Owner, short_path
from .polls import PollsSubmitted
from .requested import PendingRequests

log = logging.getLogger(__name__)

LEAVE_WITHIN = 1.0
"""Seconds that a program which leaves waits for the port to be closed."""
STOP_UNHEARD = ("a stop while the line had no owner", "a stop while this program was suspended")
STOOD_STILL = "This program was suspended and counted as exited: it no longer commands any drive."


class NewsHeard:
    """Keeps this program's picture of the line as its owner describes it; in the line's loop."""

    def __init__(self, inside: LineInside, say: Say) -> None:
        self.note = ""
        """Added to the state of a connected line, after a space."""
        self._inside = inside
        self._say = say
        self._state: LineState | None = None
        self._failure: LineError | None = None

    def hear(self, news: News) -> None:
        """Store the news."""
        inside = self._inside
        for device, state in news.devices.items():
            inside.devices.copy(device, state)
        inside.around.tally.copy(news.counters, news.counted)
        inside.pace.others, inside.pace.stretch = news.shares, news.stretch
        for frame in news.frames:
            inside.around.trace.append(frame)
        if news.state != self._state:
            self._state = news.state
            self._failure = error_from(news.failure) if news.failure is not None else None
            self.tell_state()

    def tell_state(self) -> None:
        """Give the line the state that the owner named last."""
        if self._state is not None:
            connected = self._state.status is LineStatus.CONNECTED
            reason = self._shared_with() if connected else self._state.reason
            self._say(self._state.status, reason, self._failure)

    def _shared_with(self) -> str:
        """The programs that share the line, and its settings if they differ from the requested
        ones."""
        names = ", ".join(other.text for other in self._inside.facts.others)
        shared = [f"Shared with {names}."] if names else []
        return " ".join([*shared, self.note] if self.note else shared)


class OwnerAway(Exception):
    """No process answers on the owner's socket: the owner is starting, or has just ended."""


class ShareClient:
    """Attachment to one owner until it ends; lives in the line's loop, and publishes its state."""

    def __init__(self, inside: LineInside, owner: Owner, say: Say) -> None:
        self._inside = inside
        self._owner = owner
        self._say = say
        self._loop = asyncio.get_running_loop()
        self.writer: asyncio.StreamWriter | None = None
        self._requested = PendingRequests(inside, self._tell)
        self._polls = PollsSubmitted(
            inside, self._tell, self._requested.describe, lambda: not self.watching.frozen
        )
        self._news = NewsHeard(inside, say)
        self._wish: tuple[dict[int, float], bool] = ({}, False)
        self._gone, self._reported = False, ""
        self.again = False  # attached to the line before
        self.taken_in = False  # attached to this owner
        self.watching = OwnerWatch(inside.clock, owner)
        self._heartbeat: Heartbeat | None = None

    async def serve(self) -> None:
        """Serve this program's requests until the owner ends.

        Raises OwnerAway if there is none, NotShared if it rejects this program.
        """
        try:
            with short_path(Path(self._owner.socket)) as address:
                reader, writer = await asyncio.open_unix_connection(address)
        except (OSError, ValueError) as error:
            raise OwnerAway from error
        self.writer = writer
        self.watching.connected(writer.get_extra_info("socket"))
        closing = True
        try:
            self._greet()
            await self._until_one_ends(self._watch(), self._attached(reader))
            closing = False
        finally:
            self._inside.facts.voice = None
            self._inside.pace.carrier, self._inside.pace.stretch = None, 1.0
            self._polls.lose_all()
            # later messages would not be received: a stop takes another way
            self.writer = None
            self.watching.close()
            if self._heartbeat is not None:
                self._heartbeat.close()
            if closing and self.taken_in and not self.watching.frozen:
                await self._leave(reader, writer)
            with suppress(OSError, RuntimeError):
                writer.close()
            self._requested.give_up_all(closing=closing)

    async def _until_one_ends(self, *works: Coroutine[Any, Any, None]) -> None:
        """Do several things at once until one of them ends; its error is raised."""
        tasks = [self._loop.create_task(work) for work in works]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)
        for task in done:
            task.result()

    async def _leave(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Notify the owner, and wait for its answer: a program that needs the port may follow."""
        with suppress(OSError, RuntimeError, TimeoutError):
            writer.write(packed(Goodbye()))
            async with asyncio.timeout(LEAVE_WITHIN):
                while await reader.read(1 << 12):
                    pass

    def _greet(self) -> None:
        facts = self._inside.facts
        # first: later stops are sent as messages, earlier ones in the greeting
        facts.voice = LinePublisher(self._soon, self._owner.socket)
        given, times = facts.stops.plain, facts.stops.late_times
        self._tell(Hello(VERSION, facts.me, label(self._inside.link), given, times))

    async def _attached(self, reader: asyncio.StreamReader) -> None:
        await self._welcomed(reader)
        await self._until_one_ends(self._forward(), self._listen(reader))

    async def _welcomed(self, reader: asyncio.StreamReader) -> None:
        try:
            message = await next_message(reader)
        except (EOFError, OSError, NoMessage) as error:
            raise OwnerAway from error
        self._hear_life(message)
        if isinstance(message, TurnedAway):
            raise NotShared(message.why)
        if not isinstance(message, Welcome):
            raise NotShared(f"{self._owner.program.text} owns the line and does not share it.")
        if not message.requested:
            self._news.note = f"It is open as {message.label}."
        self._gone, self.taken_in = message.gone, True
        self._heartbeat = Heartbeat(self._owner.socket, self._inside.facts.me.id)
        self._inside.pace.carrier = self._polls
        self._claim()

    def _claim(self) -> None:
        """Report this program's drives to the owner, or give them up if it counts as exited."""
        facts = self._inside.facts
        if self._gone:
            _give_up_own(facts, STOOD_STILL)
        _report_own(facts, self._tell)
        if self._gone:
            self._inside.dispatcher.void_older(self._inside.clock(), STOOD_STILL)

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        while True:
            try:
                message = await next_message(reader)
                self._hear_life(message)
                self._hear(message)
            except (EOFError, OSError):
                return
            except NoMessage as error:
                log.error("%s sent a malformed message: %s", self._owner.program.text, error)
                return

    # Requests

    async def _forward(self) -> None:
        """Pass this program's requests to the owner immediately."""
        dispatcher = self._inside.dispatcher
        while True:
            for job in await dispatcher.all_waiting():
                self._requested.send(job)

    # An owner that is frozen

    async def _watch(self) -> None:
        """Detect an owner that no longer answers, and one that answers again."""
        notes = iter(self._inside.facts.notes.all)
        while True:
            await asyncio.sleep(WATCH_INTERVAL)
            if self._heartbeat is not None:
                self._heartbeat.turn()
            for note in itertools.islice(notes, NOTES_A_LOOK * self.taken_in):
                self._tell(note)
            wish = self._inside.pace.own, self._inside.around.trace.looked_at
            if wish != self._wish:
                self._wish = wish
                self._tell(PollWish(*wish))
            self.watching.look(attached=self.taken_in)
            if self.watching.frozen:
                self._wait_for_owner()

    def _hear_life(self, message: AnyMessage) -> None:
        self.watching.hear(message)
        if self._reported:
            self._reported = ""
            self._news.tell_state()

    def _wait_for_owner(self) -> None:
        """Fail the requests to a frozen owner, once it is known that this program cannot end it."""
        remedy = self.watching.remedy
        reported = f"{self._owner.program.text} {OWNER_SILENT}. {remedy}".rstrip()
        if reported != self._reported:
            self._reported = reported
            self._say(LineStatus.LOST, reported, None)
        for job in self._inside.dispatcher.take_all():
            self._requested.send(job)
        self._polls.lose_all()
        if remedy:
            self._requested.fail_all(reported)

    # Messages of the owner

    def _hear(self, message: AnyMessage) -> None:
        facts, inside = self._inside.facts, self._inside
        match message:
            case Alive():
                pass
            case Answer() | Failed():
                self._requested.answered(message)
            case Polled():
                self._polls.hear(message)
            case News():
                self._news.hear(message)
            case Facts():
                self._hear_facts(message)
            case Notified() | LineNote() | DeviceWritten():
                facts.events.emit(_event_of(message))
            case StopGiven(devices=devices, by=by, program=program) if program.id != facts.me.id:
                counts, who = message.counts, f"{by}, {program.text}"
                facts.stops.note(program.id, devices, counts, who, message.when)
                facts.events.emit(DevicesStopped(devices, by, program))
                inside.dispatcher.void()
            case RequestDenied(device=device, holder=holder):
                facts.note_commander(device, holder.id)
                facts.events.emit(ControlDenied(device, commanded_by(device, holder)))
            case DriveRequested(device=device, program=program):
                facts.events.emit(ControlRequested(device, program))
            case RequestGranted(device=device, yes=yes, why=why):
                facts.hear_reply(device, why, yes=yes)
            case _:
                log.error("the owner says %s", type(message).__name__)

    def _hear_facts(self, reported: Facts) -> None:
        facts = self._inside.facts
        unheard = facts.learn(reported)
        if unheard and self.again:  # given while this program was with no owner
            by = STOP_UNHEARD[self._gone]
            facts.events.emit(DevicesStopped(unheard, by, self._owner.program))
            self._inside.dispatcher.void()

    def _soon(self, message: AnyMessage) -> None:
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._tell, message)

    def pass_on(self, stop: bytes) -> bool:
        """Send a finished stop to the owner; False if no owner accepts it."""
        if self.writer is None or self.watching.frozen:
            return False
        self.writer.write(stop)
        self.watching.note_stop()
        return True

    def _tell(self, message: AnyMessage) -> None:
        if self.writer is not None and not self.writer.transport.is_closing():
            self.writer.write(packed(message))
            if is_stop(message):
                self.watching.note_stop()


def _event_of(message: Notified | LineNote | DeviceWritten) -> LineEvent:
    match message:
        case Notified(device=device, text=text):
            return NoticeReceived(device, text)
        case LineNote():
            return NoteReceived(message)
    return message


def _report_own(facts: SharedState, send: Callable[[AnyMessage], None]) -> None:
    """Send the holder of a line what this program has armed, commands, keeps alive or pauses.

    For drives that it had armed before, the care for them.
    """
    me = facts.me.id
    for device, lease in facts.leases.of(me).items():
        send(Armed(device, lease.stamp, lease.until, lease.care))
    for alive in facts.keep_alives.of(me):
        send(alive)
    for device, holder in facts.commanders.items():
        if holder == me:
            send(Claim(device, True))
    for device, (program, why) in facts.paused.items():
        if program == me:
            send(PollPause(device, why))


def _give_up_own(facts: SharedState, why: str) -> None:
    """Give up all drives: this program counted as exited."""
    me = facts.me.id
    for device in facts.leases.of(me):
        facts.leases.disarm(device)
    for device, holder in facts.commanders.items():
        if holder == me:
            facts.release(device)
            facts.events.emit(ControlDenied(device, why))
