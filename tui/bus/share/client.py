"""A client's side of a shared line: hands this program's requests to the owner's queue."""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Callable, Coroutine
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import LineClosed, LineError, LineLost, NotShared, RequestRefused
from ..link import label
from ..model import LineState, LineStatus, Priority
from ..requests import BROADCAST
from ..schedule.inside import LineInside
from ..schedule.queue import Job
from ..shared_facts import Program
from ..trace import Frame
from .failures import error_of
from .lease import SILENT_OWNER
from .messages import (
    VERSION,
    Answer,
    AnyMessage,
    Ask,
    Claim,
    Denied,
    Describe,
    Facts,
    Failed,
    Goodbye,
    Hello,
    Here,
    News,
    NoMessage,
    Question,
    Reply,
    RollCall,
    StopGiven,
    Told,
    TurnedAway,
    Welcome,
    Wish,
    Withdraw,
    next_message,
    packed,
    request_form,
)
from .past_owner import PastOwner
from .place import Owner, short_path
from .voices import ProgramVoice

log = logging.getLogger(__name__)

LOOK_INTERVAL = 0.1
WAITED_ENOUGH = 5.0
"""Seconds that a request waits for a frozen owner before it is told so."""
ENDED = "The program that owned the line ended"
FATE = " Whether it was taken is not known; read the register back before trying again."

Say = Callable[[LineStatus, str], None]


class OwnerAway(Exception):
    """Nobody answers on the owner's socket: it is just beginning, or has just ended."""


class ShareClient:
    """Attached to one owner until it ends; lives in the line's loop, and is its facts' voice."""

    def __init__(self, inside: LineInside, owner: Owner, say: Say, past: PastOwner) -> None:
        self._inside = inside
        self._owner = owner
        self._say = say
        self._loop = asyncio.get_running_loop()
        self._writer: asyncio.StreamWriter | None = None
        self._numbers = itertools.count(1)
        self._asked: dict[int, Job] = {}
        self._described: dict[int, object] = {}
        self._state: LineState | None = None
        self._note = ""
        self._wish: tuple[dict[int, float], bool] = ({}, False)
        self._past = past
        self.again = False
        """Whether this program was attached to the line before."""
        self.heard = inside.clock()
        """When the owner last gave a sign of life."""
        self.quiet_until = 0.0
        """When no reply to the owner's last request may come any more."""

    @property
    def frozen(self) -> bool:
        """Whether the owner does not answer, so that nothing but stops goes out."""
        return self._past.at_work

    async def serve(self) -> None:
        """Serve this program's requests until the owner ends.

        Raises OwnerAway where there is none, NotShared where it takes nobody in.
        """
        try:
            with short_path(Path(self._owner.socket)) as address:
                reader, writer = await asyncio.open_unix_connection(address)
        except (OSError, ValueError) as error:
            raise OwnerAway from error
        self._writer = writer
        closing = True
        try:
            self._greet()
            await self._until_one_ends(self._watch(), self._attached(reader))
            closing = False
        finally:
            self._inside.facts.voice = None
            await self._past.end()
            with suppress(OSError, RuntimeError):
                writer.close()
            self._give_up_asked(closing=closing)

    async def _until_one_ends(self, *works: Coroutine[Any, Any, None]) -> None:
        """Do several things at once until one of them ends; its error is raised."""
        tasks = [self._loop.create_task(work) for work in works]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
        for task in done:
            task.result()

    def _greet(self) -> None:
        facts = self._inside.facts
        # first: what is given from here on is told by itself, what was before in the greeting
        facts.voice = ProgramVoice(facts, self._soon)
        given = {device: dict(counts) for device, counts in facts.stops.given.items()}
        self._tell(Hello(VERSION, facts.me, label(self._inside.link), given))

    async def _attached(self, reader: asyncio.StreamReader) -> None:
        await self._welcomed(reader)
        await self._until_one_ends(self._forward(), self._listen(reader))

    async def _welcomed(self, reader: asyncio.StreamReader) -> None:
        try:
            message = await next_message(reader)
        except (EOFError, OSError, NoMessage) as error:
            raise OwnerAway from error
        self._hear_life()
        if isinstance(message, TurnedAway):
            raise NotShared(message.why)
        if not isinstance(message, Welcome):
            raise NotShared(f"{self._owner.program.text} owns the line and does not share it.")
        self._note = f"Shared with {message.owner.text}."
        if not message.asked:
            self._note += f" It is open as {message.label}."
        facts = self._inside.facts
        for device, holder in facts.commanders.items():
            if holder == facts.me.id:
                self._tell(Claim(device, True))

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        while True:
            try:
                message = await next_message(reader)
            except (EOFError, OSError):
                self._killed()
                return
            except NoMessage as error:
                log.error("%s says nothing sensible: %s", self._owner.program.text, error)
                self._killed()
                return
            self._hear_life()
            if isinstance(message, Goodbye):
                self.quiet_until = self.heard + message.quiet
                return
            self._hear(message)

    def _killed(self) -> None:
        """The owner is gone without a word: it may have sent until a moment ago."""
        last = min(self._inside.clock(), self.heard + SILENT_OWNER)
        self.quiet_until = last + self._inside.timing.late_reply

    # Requests

    async def _forward(self) -> None:
        """Hand on what this program asks, as soon as it asks."""
        dispatcher = self._inside.dispatcher
        while True:
            for job in await dispatcher.all_waiting():
                self._send(job)

    def _send(self, job: Job) -> None:
        if job.answer.cancelled():
            return
        request = job.request
        if why := self._inside.dispatcher.forbidden(job):
            job.fail(RequestRefused(why))
            return
        if self._past.take(job):
            return
        self._describe(request.device, job)
        kind, fields = request_form(request)
        number = next(self._numbers)
        self._asked[number] = job
        job.answer.add_done_callback(lambda answer: self._withdrawn(number, answer.cancelled()))
        limits = job.limits if request.device == BROADCAST else None
        self._tell(
            Ask(
                number, kind, fields, int(job.priority), job.replaceable, job.max_age,
                job.stamp, job.asked, limits,
            )
        )  # fmt: skip

    def _describe(self, device: int, job: Job) -> None:
        if device != BROADCAST and self._described.get(device) is not job.limits:
            self._described[device] = job.limits
            self._tell(Describe(device, job.limits))

    def _withdrawn(self, number: int, cancelled: bool) -> None:
        """Called in any thread: nobody waits for the answer any more."""
        if cancelled:
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._withdraw, number)

    def _withdraw(self, number: int) -> None:
        if self._asked.pop(number, None) is not None:
            self._tell(Withdraw(number))

    def _answered(self, message: Answer | Failed) -> None:
        job = self._asked.pop(message.number, None)
        if job is None or not (job.begun or job.answer.set_running_or_notify_cancel()):
            return
        job.begun = True
        if isinstance(message, Answer):
            self._inside.devices[job.request.device].heard = message.time
            job.finish(message.pdu, message.time)
        else:
            self._failed(job, message)

    def _failed(self, job: Job, message: Failed) -> None:
        if message.error == "LineClosed":
            # the owner's end is not this program's
            self._give_up(job, sent=FATE in message.form.text)
        else:
            job.fail(error_of(message.error, message.form))

    def _give_up_asked(self, *, closing: bool) -> None:
        asked, self._asked = self._asked, {}
        for job in asked.values():
            if closing and job.request.changes:
                job.fail(LineClosed(f"The line was closed during the request.{FATE}"))
            else:
                self._give_up(job, sent=True)

    def _give_up(self, job: Job, *, sent: bool) -> None:
        """The owner ended before it answered: a read is asked anew, a write never is.

        A stop is sent again: it may have got lost, and does no harm twice.
        """
        if not job.request.changes or job.priority is Priority.STOP:
            if not job.answer.cancelled():
                self._inside.dispatcher.put_back(job)
            return
        text = f"{ENDED} during the request.{FATE}" if sent else f"{ENDED}; this was not sent."
        job.fail(LineLost(text))

    # An owner that is frozen

    async def _watch(self) -> None:
        """Notice an owner that does not answer any more, and one that does again."""
        looks = 0
        heard = self.heard
        while True:
            await asyncio.sleep(LOOK_INTERVAL)
            inside = self._inside
            wish = inside.pace.own, inside.around.trace.looked_at
            if wish != self._wish:
                self._wish = wish
                self._tell(Wish(*wish))
            # by looks, too: where this program got no time to look, the owner may be well
            looks = looks + 1 if heard == self.heard else 0
            heard = self.heard
            silent = inside.clock() - heard
            if not self.frozen and silent > SILENT_OWNER and looks >= SILENT_OWNER / LOOK_INTERVAL:
                self._freeze()
            if self.frozen:
                self._help_stops(silent)

    def _freeze(self) -> None:
        self._past.begin()
        who = self._owner.program.text
        log.error("%s owns the line and does not answer", who)
        self._say(
            LineStatus.LOST,
            f"{who} owns the line and does not answer. Stops go out past it; all else waits.",
        )

    def _hear_life(self) -> None:
        self.heard = self._inside.clock()
        if self.frozen:
            self._past.leave()
            self._tell_state()

    def _help_stops(self, silent: float) -> None:
        """Send stops past the frozen owner; tell others that they wait in vain."""
        for number, job in list(self._asked.items()):
            if self._past.take(job):
                self._withdraw(number)
        for job in self._inside.dispatcher.take_all():
            self._send(job)
        if silent < SILENT_OWNER + WAITED_ENOUGH:
            return
        for number, job in list(self._asked.items()):
            if self._inside.clock() - job.asked > WAITED_ENOUGH and not job.answer.done():
                self._withdraw(number)
                fate = FATE if job.request.changes else ""
                text = f"{self._owner.program.text} owns the line and does not answer.{fate}"
                job.fail(LineLost(text))

    # What the owner says

    def _hear(self, message: AnyMessage) -> None:
        facts, inside = self._inside.facts, self._inside
        match message:
            case Answer() | Failed():
                self._answered(message)
            case News():
                self._hear_news(message)
            case Facts():
                self._hear_facts(message)
            case RollCall(number=number):
                # once nothing of this program goes out past the owner any more
                self._past.when_ended(lambda: self._tell(Here(number)))
            case Told(device=device, text=text):
                facts.hear_text(device, text)
            case StopGiven(devices=devices, by=by, program=program):
                facts.stops.note(program.id, devices, message.counts, f"{by}, {program.text}")
                facts.hear_stop(devices, by, program)
                inside.dispatcher.void()
            case Denied(device=device, holder=holder):
                facts.note_commander(device, holder.id)
                facts.hear_denied(device, f"Drive {device} is commanded by {holder.text}.")
            case Question(device=device, program=program):
                facts.hear_question(device, program)
            case Reply(device=device, yes=yes, why=why):
                facts.hear_reply(device, why, yes=yes)
            case _:
                log.error("the owner says %s", type(message).__name__)

    def _hear_facts(self, told: Facts) -> None:
        facts = self._inside.facts
        unheard = facts.learn(told.programs, told.commanders, told.stops)
        if unheard and self.again:
            # given while this program was with no owner
            facts.hear_stop(unheard, "while nobody owned the line", self._owner.program)
            self._inside.dispatcher.void()

    def _hear_news(self, news: News) -> None:
        inside = self._inside
        for device, state in news.devices.items():
            inside.devices.copy(device, state)
        inside.around.tally.copy(news.counters)
        inside.pace.others = news.shares
        for time, direction, data, note in news.frames:
            inside.around.trace.append(
                Frame(time, "out" if direction == "out" else "in", data, note)
            )
        if news.state != self._state:
            self._state = news.state
            self._tell_state()

    def _tell_state(self) -> None:
        if self._state is not None:
            connected = self._state.status is LineStatus.CONNECTED
            self._say(self._state.status, self._note if connected else self._state.reason)

    def _soon(self, message: AnyMessage) -> None:
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._tell, message)

    def _tell(self, message: AnyMessage) -> None:
        if self._writer is not None and not self._writer.transport.is_closing():
            self._writer.write(packed(message))


def owner_text(owner: Owner | None) -> str:
    """Who owns a line, for a person."""
    program: Program | None = owner.program if owner else None
    return program.text if program else "another program"


__all__ = ["LineError", "OwnerAway", "ShareClient", "owner_text"]
