"""The owner's side of a shared line: takes the requests of other programs into its one queue."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import struct
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from ..limits import CAUTIOUS, Limits
from ..link import label
from ..model import DeviceState
from ..model import Reply as LineReply
from ..schedule.inside import LineInside
from ..schedule.pace import greatest
from ..schedule.queue import Job
from ..shared_facts import Program, commanded_by
from .messages import (
    VERSION,
    Answer,
    AnyMessage,
    Ask,
    Claim,
    Denied,
    Describe,
    Facts,
    Goodbye,
    Hello,
    Hush,
    News,
    NoMessage,
    Question,
    Reply,
    StopGiven,
    Told,
    TurnedAway,
    Welcome,
    Wish,
    Withdraw,
    failure,
    next_message,
    packed,
    priority_of,
    request_of,
)
from .place import Owner, OwnerLock, SharePlace

log = logging.getLogger(__name__)

NEWS_INTERVAL = 0.2
"""Seconds between the owner's signs of life."""
MOST_UNREAD = 1 << 20
"""Bytes that a client may leave unread; one that stalls is let go, and may come back."""
MOST_ASKED = 256
"""Requests of one client that may wait."""
HELLO_WITHIN = 2.0
FRAMES_TOLD = 200


@dataclass(eq=False, slots=True)
class Client:
    """One attached program."""

    program: Program
    writer: asyncio.StreamWriter
    shares: dict[int, float] = field(default_factory=dict)
    trace: bool = False
    frames: int = 0
    """How many frames of the line it was told of."""
    limits: dict[int, Limits] = field(default_factory=dict)
    asked: dict[int, Job] = field(default_factory=dict)
    known: dict[int, DeviceState] = field(default_factory=dict)
    said_goodbye: bool = False

    def say(self, message: AnyMessage) -> None:
        """Tell it something; never waits."""
        transport = self.writer.transport
        if transport.is_closing():
            return
        if transport.get_write_buffer_size() > MOST_UNREAD:
            log.warning("%s reads nothing any more and is let go", self.program.text)
            transport.abort()
            return
        self.writer.write(packed(message))


class ShareServer:
    """Serves the programs that attach; lives in the line's loop, and is its facts' voice."""

    def __init__(self, place: SharePlace, lock: OwnerLock, inside: LineInside) -> None:
        self._place = place
        self._lock = lock
        self._inside = inside
        self._loop = asyncio.get_running_loop()
        self._clients: dict[str, Client] = {}
        self._server: asyncio.Server | None = None
        self._path: Path | None = None
        self._news: asyncio.Task[None] | None = None
        self._handling: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Listen. Raises OSError where no socket can be made."""
        facts = self._inside.facts
        facts.set_programs((facts.me,))
        facts.voice = self
        await self._listen()
        self._news = self._loop.create_task(self._tell_news(), name="news of the line")

    async def close(self, quiet: float = 0.0) -> None:
        """Say goodbye, listen no more, and leave no socket behind."""
        self._inside.facts.voice = None
        if self._news is not None:
            self._news.cancel()
        if self._server is not None:
            self._server.close()
        for client in list(self._clients.values()):
            client.say(Goodbye(quiet))
            with suppress(OSError, RuntimeError):
                client.writer.close()
        self._clients.clear()
        for task in list(self._handling):
            task.cancel()
        self._unlink()

    # Listening

    async def _listen(self) -> None:
        path = self._place.socket_path()
        with suppress(FileNotFoundError):
            path.unlink()
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            # nobody may connect before the mode is right
            before = os.umask(0o177)
            try:
                listening.bind(str(path))
            finally:
                os.umask(before)
            if self._place.group is not None:
                os.chown(path, -1, self._place.group)
                path.chmod(0o660)
            self._server = await asyncio.start_unix_server(self._welcome, sock=listening)
        except BaseException:
            listening.close()
            raise
        self._path = path
        self._lock.tell(Owner(VERSION, self._inside.facts.me, str(path)))

    def _unlink(self) -> None:
        if self._path is not None:
            with suppress(OSError):
                self._path.unlink()
            self._path = None

    async def _keep_listening(self) -> None:
        """Make the socket anew where its folder was taken away, as at the end of a log-in."""
        if self._path is not None:
            with suppress(OSError):
                os.utime(self._path)  # the last sign of life, should this program be killed
                return
        if self._server is not None:
            self._server.close()
        with suppress(OSError):
            await self._listen()

    # Clients

    async def _welcome(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._handling.add(task)
        client: Client | None = None
        try:
            client = await self._hello(reader, writer)
            while client is not None:
                self._hear(client, await next_message(reader))
        except (EOFError, OSError, TimeoutError):
            pass
        except NoMessage as error:
            log.warning("a program on the socket of the line says nothing sensible: %s", error)
        except asyncio.CancelledError:
            pass
        except Exception:
            # what one program says must not take the line from the others
            log.exception("serving a program on the line failed")
        finally:
            self._handling.discard(task)
            with suppress(OSError, RuntimeError):
                writer.close()
            if client is not None:
                self._gone(client)

    async def _hello(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> Client | None:
        async with asyncio.timeout(HELLO_WITHIN):
            message = await next_message(reader)
        if not isinstance(message, Hello):
            raise NoMessage("no greeting")
        if not self._may_attach(writer):
            writer.write(packed(TurnedAway("This line is shared with other users only.")))
            return None
        facts, inside = self._inside.facts, self._inside
        if message.version != VERSION:
            why = (
                f"{facts.me.text} owns the line, in another version of Drive Panel."
                " Close it, or use the same version."
            )
            writer.write(packed(TurnedAway(why)))
            return None
        facts.learn_stops(message.stops)
        client = Client(message.program, writer)
        own = label(inside.link)
        client.say(Welcome(facts.me, own, own == message.label))
        self._clients[client.program.id] = client
        facts.set_programs((*facts.programs, client.program))
        client.frames = inside.around.trace.count
        log.info("%s shares the line", client.program.text)
        self._tell_facts()
        client.say(self._news_for(client))
        return client

    def _may_attach(self, writer: asyncio.StreamWriter) -> bool:
        """Whether the user at the other end may share the line: the socket's mode, twice."""
        if self._place.group is not None:
            return True
        peer = writer.get_extra_info("socket")
        try:
            found = peer.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
        except (AttributeError, OSError):
            return True
        return struct.unpack("3i", found)[1] in (os.getuid(), 0)

    def _gone(self, client: Client) -> None:
        """A program went: what it asked is dropped, what it commanded is free."""
        if self._clients.pop(client.program.id, None) is None:
            return
        asked, client.asked = client.asked, {}
        for job in asked.values():
            job.answer.cancel()
        log.info("%s has left the line", client.program.text)
        self._inside.facts.hear_gone(client.program)
        self._tell_facts()

    def _tell_all(self, message: AnyMessage, but: str = "") -> None:
        for client in list(self._clients.values()):
            if client.program.id != but:
                client.say(message)

    def _tell_facts(self) -> None:
        facts = self._inside.facts
        self._tell_all(
            Facts(facts.programs, dict(facts.commanders), dict(facts.stops), dict(facts.hushed))
        )

    # What clients say

    def _hear(self, client: Client, message: AnyMessage) -> None:
        match message:
            case Ask():
                self._ask(client, message)
            case Withdraw(number=number):
                job = client.asked.get(number)
                if job is not None:
                    job.answer.cancel()
            case Describe(device=device, limits=limits):
                client.limits[device] = limits
                if self._inside.devices[device].limits is CAUTIOUS:
                    self._inside.devices.describe(device, limits)
            case Wish(shares=shares, trace=trace):
                client.shares, client.trace = shares, trace
                self._inside.pace.others = self._wishes()
            case _:
                self._hear_fact(client, message)

    def _hear_fact(self, client: Client, message: AnyMessage) -> None:
        """What all programs must know."""
        match message:
            case StopGiven(devices=devices, by=by):
                self._stopped(devices, by, client.program)
            case Claim(device=device, take=take):
                self._claimed(client.program, device, take=take)
            case Question(device=device):
                self._asked_for(client.program, device)
            case Reply():
                self._replied(client.program, message)
            case Hush(device=device, why=why):
                self._inside.facts.note_hush(device, client.program.id, why)
                self._tell_facts()
            case Told(device=device, text=text):
                self._inside.facts.hear_text(device, text)
                self._tell_all(message, but=client.program.id)
            case _:
                raise NoMessage(type(message).__name__)

    def _ask(self, client: Client, message: Ask) -> None:
        if len(client.asked) >= MOST_ASKED:
            raise NoMessage("too many requests at once")
        request, priority = request_of(message), priority_of(message.priority)
        limits = message.limits or client.limits.get(request.device, CAUTIOUS)
        job = Job(request, priority, limits, replaceable=message.replaceable)
        job.program, job.stamp = client.program.id, message.stamp
        job.max_age = message.max_age
        client.asked[message.number] = job
        job.answer.add_done_callback(partial(self._answered, client, message.number))
        self._inside.submit(job)

    def _answered(self, client: Client, number: int, answer: Future[LineReply]) -> None:
        if client.asked.pop(number, None) is None or answer.cancelled():
            return
        error = answer.exception()
        if error is not None:
            client.say(failure(number, error))
        else:
            reply = answer.result()
            client.say(Answer(number, reply.pdu, reply.time))

    # The voice of the facts, from any thread

    def stop_given(self, devices: tuple[int, ...], by: str) -> None:
        """Devices are stopped by this program."""
        self._soon(self._told_stop, devices, by, self._inside.facts.me)

    def claim(self, device: int, take: bool) -> None:
        """This program commands a device now, or no longer."""
        self._soon(self._tell_facts)

    def ask(self, device: int) -> None:
        """This program wants a device that another one commands."""
        self._soon(self._asked_for, self._inside.facts.me, device)

    def reply(self, device: int, program: str, yes: bool, why: str) -> None:
        """This program answers one that asked."""
        self._soon(self._replied, self._inside.facts.me, Reply(device, program, yes, why))

    def hushed(self, device: int, why: str) -> None:
        """This program leaves a device alone, or no longer."""
        self._soon(self._tell_facts)

    def told(self, device: int, text: str) -> None:
        """This program has something for all to read."""
        self._soon(self._tell_all, Told(device, text))

    def _soon(self, call: object, *what: object) -> None:
        with suppress(RuntimeError):  # the loop has ended, and with it whoever would hear
            self._loop.call_soon_threadsafe(call, *what)  # type: ignore[arg-type]

    def _stopped(self, devices: tuple[int, ...], by: str, program: Program) -> None:
        facts = self._inside.facts
        facts.count_stop(devices, f"{by}, {program.text}")
        facts.hear_stop(devices, by, program)
        self._told_stop(devices, by, program)

    def _told_stop(self, devices: tuple[int, ...], by: str, program: Program) -> None:
        for device in devices:
            self._inside.dispatcher.void(device)
        self._tell_all(StopGiven(devices, by, program), but=program.id)
        self._tell_facts()

    def _claimed(self, program: Program, device: int, *, take: bool) -> None:
        facts = self._inside.facts
        holder = facts.commanders.get(device)
        if take and holder not in (None, program.id):
            other = facts.program(holder or "")
            client = self._clients.get(program.id)
            if other is not None and client is not None:
                client.say(Denied(device, other))
                return
        if take or holder == program.id:
            facts.note_commander(device, program.id if take else None)
        self._tell_facts()

    def _asked_for(self, program: Program, device: int) -> None:
        """Hand a question on to the program that commands a device."""
        facts = self._inside.facts
        holder = facts.commanders.get(device)
        if holder == facts.me.id:
            facts.hear_question(device, program)
        elif holder is not None and (client := self._clients.get(holder)) is not None:
            client.say(Question(device, program))

    def _replied(self, program: Program, reply: Reply) -> None:
        """Hand an answer on to the program that asked; a yes frees the device."""
        facts = self._inside.facts
        if reply.yes and facts.commanders.get(reply.device) == program.id:
            facts.note_commander(reply.device, None)
            self._tell_facts()
        why = reply.why or ("" if reply.yes else commanded_by(reply.device, program))
        if reply.program == facts.me.id:
            facts.hear_reply(reply.device, why, yes=reply.yes)
        elif (client := self._clients.get(reply.program)) is not None:
            client.say(Reply(reply.device, reply.program, reply.yes, why))

    # News

    async def _tell_news(self) -> None:
        while True:
            await asyncio.sleep(NEWS_INTERVAL)
            await self._keep_listening()
            if not self._lock.stands:
                log.error("the lock of the line was taken away: %s", self._place.lock_path)
            for client in list(self._clients.values()):
                client.say(self._news_for(client))

    def tell_state(self) -> None:
        """The line's state has changed: say so at once."""
        for client in list(self._clients.values()):
            client.say(self._news_for(client))

    def _wishes(self, but: Client | None = None) -> dict[int, float]:
        """What the clients' polls wish for, by device."""
        return greatest(*(one.shares for one in self._clients.values() if one is not but))

    def _news_for(self, client: Client) -> News:
        inside = self._inside
        changed = {}
        for device in inside.devices.known:
            state = inside.devices.state(device)
            if client.known.get(device) != state:
                client.known[device] = changed[device] = state
        frames: tuple[tuple[float, str, bytes, str], ...] = ()
        if client.trace:
            new = min(inside.around.trace.count - client.frames, FRAMES_TOLD)
            last = inside.around.trace.frames()[-new:] if new else ()
            frames = tuple((one.time, one.direction, one.data, one.note) for one in last)
        client.frames = inside.around.trace.count
        others = greatest(inside.pace.own, self._wishes(but=client))
        return News(inside.state(), inside.around.tally.frozen(), changed, others, frames)
