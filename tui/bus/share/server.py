"""The owner's side of a shared line: puts the requests of other programs into its one queue."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress

from ..limits import CAUTIOUS
from ..line_events import (
    DevicesStopped,
    DeviceWritten,
    LineEvent,
    NoteReceived,
    NoticeReceived,
    StopDue,
)
from ..link import label
from ..notes import LineNote
from ..program import Program
from ..schedule.inside import LineInside
from ..schedule.pace import greatest
from ..schedule.queue import Job
from ..shared_state import LinePublisher
from .attached import Client
from .carried import Subscribe, Unsubscribe
from .commanding import Commanding
from .greeting import Greeting, Listening, PortHolder
from .heartbeat import HeartbeatSender, programs_back
from .messages import (
    Alive,
    AnyMessage,
    Asking,
    Describe,
    Facts,
    Goodbye,
    NoMessage,
    Notified,
    PollWish,
    StopGiven,
    Welcome,
    Withdraw,
    next_message,
)
from .place import OwnerLock, SharePlace, has_ended
from .polls import PollsServed

log = logging.getLogger(__name__)


class ShareServer:
    """Serves the programs that attach; lives in the line's loop, and is its facts' voice."""

    def __init__(
        self, place: SharePlace, lock: OwnerLock, inside: LineInside, holder: PortHolder
    ) -> None:
        self._inside = inside
        self._holder = holder
        self._loop = asyncio.get_running_loop()
        self._clients: dict[str, Client] = {}
        self._greeting = Greeting(inside, place.group, holder, self._stopped)
        self._listening = Listening(place, lock, inside.facts, label(inside.link), self._welcome)
        self._commanding = Commanding(inside.facts, self._clients, self._tell_facts)
        self._polls = PollsServed(inside)
        self._signs = HeartbeatSender(inside, self._all, self._tell_news)
        self._gone_before: set[str] = set()  # looked after
        self._handling: set[asyncio.Task[None]] = set()
        self._stops_left: list[Job] = []
        self._coming_back: asyncio.Task[None] | None = None
        self._end_passing_on: Callable[[], None] = lambda: None

    async def start(self) -> None:
        """Listen. Raises OSError if no socket can be made."""
        facts = self._inside.facts
        facts.set_programs((facts.me,))
        facts.voice = LinePublisher(self._say)
        self._end_passing_on = facts.events.subscribe(self._pass_on)
        await self._listening.start()
        self._signs.start()
        self._miss_departed(ended=True)
        self._coming_back = self._loop.create_task(self._miss_late(), name="programs before")

    async def close(self) -> None:
        """Stop listening, and remove the socket; the programs start the next keeper."""
        self._inside.facts.voice = None
        self._end_passing_on()
        self._signs.close()
        if self._coming_back is not None:
            self._coming_back.cancel()
        self._polls.close()
        await self._listening.close()
        for client in list(self._clients.values()):
            with suppress(OSError, RuntimeError):
                client.writer.close()
        self._clients.clear()
        for task in list(self._handling):
            task.cancel()

    # Clients

    @property
    def serves(self) -> bool:
        """True while a program is attached."""
        return bool(self._clients)

    def _is_greeting(self) -> bool:
        """True while a program has connected that is not attached yet."""
        return len(self._handling) > len(self._clients)

    @property
    def stops_wait(self) -> bool:
        """True while a stop of a program that has left is not sent yet."""
        return not all(job.answer.done() for job in self._stops_left)

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
            who = "A program" if client is None else client.program.text
            log.warning("%s sent a malformed message and is disconnected: %s", who, error)
        except asyncio.CancelledError:
            pass
        except Exception:
            # one program's message must not take the line from the others
            log.exception("serving a program on the line failed")
        finally:
            self._handling.discard(task)
            try:
                if client is not None:
                    self._gone(client)
                    await self._holder.port_left()
            finally:
                with suppress(OSError, RuntimeError):
                    writer.close()

    async def _hello(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> Client | None:
        message = await self._greeting.heard(reader, writer, self._clients)
        if message is None:
            return None
        facts, inside = self._inside.facts, self._inside
        client = Client(message.program, writer, facts.events, heard=inside.clock())
        own = label(inside.link)
        gone = client.program.id in self._gone_before
        client.say(Welcome(facts.me, own, own == message.label, gone))
        self._gone_before.discard(client.program.id)
        before = self._clients.get(client.program.id)
        self._clients[client.program.id] = client
        if before is not None:
            before.drop()
        others = [program for program in facts.programs if program.id != client.program.id]
        facts.set_programs((*others, client.program))
        client.frames = inside.around.trace.count
        log.info("%s shares the line", client.program.text)
        facts.stops.learn_times(message.stopped)
        ids = [program.id for program in facts.programs]
        if unheard := facts.stops.learn_greeting(client.program.id, message.stops, ids):
            # given while nobody owned the line
            self._hear_stops(unheard, "a stop while the line had no owner", client.program)
        self._holder.moved(arrived=True)
        self._tell_facts()
        self._tell_line(client)
        return client

    def _gone(self, client: Client) -> None:
        """Cancel the requests of a program that has left, and free its drives."""
        self._polls.end_all(client)
        self._stops_left += client.forget()
        if self._clients.get(client.program.id) is not client:
            return
        if due := client.due_stops(self._inside.clock()):
            self._inside.facts.events.emit(StopDue(due, client.program.text))
        del self._clients[client.program.id]
        log.info("%s has left the line", client.program.text)
        facts = self._inside.facts
        self._missing(client.program)
        facts.stops.fold({program.id for program in facts.departed if has_ended(program)})
        self._holder.moved(arrived=False)
        self._tell_facts()

    async def _miss_late(self) -> None:
        await programs_back(self._is_greeting)
        self._miss_departed()

    def _miss_departed(self, *, ended: bool = False) -> None:
        """Treat programs of the previous owner as exited if they are not back, or have `ended`."""
        facts = self._inside.facts
        here = {item.id for item in facts.programs}
        for program in facts.departed:
            if program.id not in here | self._gone_before and (has_ended(program) or not ended):
                self._missing(program)
        self._holder.moved(arrived=False)
        self._tell_facts()

    def _missing(self, program: Program) -> None:
        self._gone_before.add(program.id)
        self._inside.facts.hear_gone(program)

    def _tell_all(self, message: AnyMessage, but: str = "") -> None:
        for client in list(self._clients.values()):
            if client.program.id != but:
                client.say(message)

    def _tell_facts(self) -> None:
        facts = self._inside.facts
        given, times = facts.stops.plain, facts.stops.late_times
        commanders, paused, gone = dict(facts.commanders), dict(facts.paused), facts.departed
        self._tell_all(Facts(facts.programs, commanders, given, paused, times, gone))

    # Messages of clients

    def _hear(self, client: Client, message: AnyMessage) -> None:
        client.hears(message, self._inside.clock())
        match message:
            case Alive():
                pass
            case Goodbye():
                raise EOFError
            case Asking():
                client.ask(self._inside, message)
            case Withdraw(number=number):
                client.withdraw(number)
            case Describe(device=device, limits=limits):
                client.limits[device] = limits
                if self._inside.devices[device].limits is CAUTIOUS:
                    self._inside.devices.describe(device, limits)
            case Subscribe():
                self._polls.start(client, message)
            case Unsubscribe(number=number):
                self._polls.end(client, number)
            case PollWish(shares=shares, trace=trace):
                client.shares, client.trace = shares, trace
            case _:
                self._hear_of_devices(client, message)

    def _hear_of_devices(self, client: Client, message: AnyMessage) -> None:
        match message:
            case StopGiven() if message.program.id == client.program.id:
                client.stops_due |= dict.fromkeys(message.devices, self._inside.clock())
                self._stopped(message)
            case Notified(device=device, text=text):
                self._inside.facts.events.emit(NoticeReceived(device, text))
                self._tell_all(message, but=client.program.id)
            case LineNote(data=b""):
                for note in self._inside.facts.notes.of(message.device, message.kind):
                    client.say(note)
            case LineNote():
                self._inside.facts.notes.keep(message)
            case _ if not self._commanding.hears(client.program, message):
                raise NoMessage(type(message).__name__)

    # Messages of this program

    def _say(self, message: AnyMessage) -> None:
        """Called in any thread."""
        with suppress(RuntimeError):  # the loop has ended, and with it every receiver
            self._loop.call_soon_threadsafe(self._message, message)

    def _message(self, message: AnyMessage) -> None:
        match message:
            case StopGiven():
                self._tell_stop(message)
            case LineNote(data=b""):
                for note in self._inside.facts.notes.of(message.device, message.kind):
                    self._inside.facts.events.emit(NoteReceived(note))
            case LineNote():
                pass  # kept already
            case _ if not self._commanding.hears(self._inside.facts.me, message):
                self._tell_all(message)

    def _pass_on(self, event: LineEvent) -> None:
        """Send a write to all programs before any later reply, which may show its effect."""
        if isinstance(event, DeviceWritten):
            self._tell_all(event)

    def _stopped(self, stop: StopGiven) -> None:
        """Another program stops devices; a repeated message counts once."""
        facts, program = self._inside.facts, stop.program
        by = f"{stop.by}, {program.text}"
        if new := facts.stops.note(program.id, stop.devices, stop.counts, by, stop.when):
            self._hear_stops(new, stop.by, program)

    def _hear_stops(self, devices: tuple[int, ...], by: str, program: Program) -> None:
        facts = self._inside.facts
        facts.events.emit(DevicesStopped(devices, by, program))
        self._tell_stop(StopGiven(devices, facts.stops.of(program.id, devices), by, program))

    def _tell_stop(self, stop: StopGiven) -> None:
        self._inside.dispatcher.void()
        self._tell_all(stop, but=stop.program.id)
        self._tell_facts()

    # News

    def _all(self) -> list[Client]:
        return list(self._clients.values())

    def _tell_news(self) -> None:
        self._listening.keep()
        self._polls.share_out(self._wishes())
        self.tell_state()

    def tell_state(self) -> None:
        """Send the changed state of the line immediately."""
        for client in self._all():
            self._tell_line(client)

    def _tell_line(self, client: Client) -> None:
        shares = greatest(self._inside.pace.own, self._wishes(but=client))
        client.say(client.news(self._inside, shares))

    def _wishes(self, but: Client | None = None) -> dict[int, float]:
        return greatest(*(client.shares for client in self._clients.values() if client is not but))
